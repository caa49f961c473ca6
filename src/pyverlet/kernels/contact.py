"""What happens to two circles that touch, eight pairs at a time: docs/design/contact-law.md, line by line.

A substep goes over the pairs twice. `push_strip`, before the walls: who meets too fast for a contact at rest bounces, there and
then, with friction; other overlaps are pushed apart, and what a contact has slipped is answered likewise. `relax_strip`, after the
walls: approach and slip of those that touch are set to 0, as far as friction goes, and the slip is remembered.

Pushes are added up in `moved`, how far each circle has come since the list was made; `arrive` puts them into the positions and, times
a gain, into the velocities. So velocities in the first sweep are those of the motion, and an impact is what it would be alone.

In the loops over threads nothing is written but by other kernels: Numba drops what is written there to arrays of a tuple.

Two circles whose pair has neither restitution nor friction need no velocities in the first sweep, and are not asked whether they
bounce. What a pair is made of is kept by lane; nothing here depends on what other pairs are made of.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    LANES,
    add_lanes,
    larger,
    load,
    pick,
    place,
    put,
    smaller,
    spread,
    square_root,
    store,
    take,
    where_above,
    where_set,
    where_zero,
    which_above,
)
from pyverlet.compile.stealing import claim, none_claimed
from pyverlet.ground.constants import DEEP, DEEP_PART, DEEP_SWEEPS, FED, GRIP, LARGEST_PUSH, PUSHED
from pyverlet.kernels.bounds import AT_WALL, CARRIED, CARRIES, impact_time
from pyverlet.kernels.motion import IN_PILE, arrive, set_out

# Particles one thread takes at a time where each is on its own.
_CHUNK = 1024

# Deep packs that are too few to be worth a meeting of the threads.
_FEW = 64

NEW = np.inf
"""The slip of a pair that did not touch in the substep before. What it slips in its first one, it may have slipped before it met."""

E, MU, R_I, R_J, TURN_I, TURN_J, MASS = range(7)
"""Rows of `Pairs.made_of`: restitution, friction, radii m, what a push turns each disc by (2 / r times its share), reduced mass kg."""


class Circles(NamedTuple):
    """Circles by slot; what each is: `Slots`, and of contacts `Wide`."""

    position: Any
    velocity: Any
    acceleration: Any
    inverse_mass: Any
    origin: Any
    moved: Any
    resting: Any
    spin: Any
    carries: Any
    fed: Any
    turned: Any
    turn: Any
    lift: Any
    leans: Any
    start: Any
    radius: Any
    restitution: Any
    friction: Any
    hits: Any
    spent: Any


class Pairs(NamedTuple):
    """Candidate pairs by lane, those of strip s from begin[s] to begin[s] + lanes[s]; what each is: `Wide`."""

    begin: Any
    lanes: Any
    apart: Any
    lane_i: Any
    lane_j: Any
    gap: Any
    reach: Any
    share: Any
    made_of: Any
    normal: Any
    depth: Any
    slip: Any
    held: Any
    closing: Any
    deep: Any
    deeps: Any
    spent: Any


class Law(NamedTuple):
    """Numbers of a substep, and what there is to do in it.

    varied: 1, or 0 if reach and share are the same for all and have one pack only; mixed: the same of `made_of`. asks: whether any
    pair may bounce or rub, or somebody listens to who meets how fast. rubs, listens, accounts: likewise. arrives: 1 if what becomes of `moved`
    is to be added to positions and velocities when all pairs have been gone through, 0 if the room does that; always 1 where `asks`. feed: FED / PUSHED / h, 1/s. most: the largest part of the contact distance that a push may see. weight: whether an
    acceleration could stop a pair that parts. carried: m/s, by which a substep feeds the velocity of one that carries weight.
    """

    varied: Any
    mixed: Any
    asks: Any
    rubs: Any
    listens: Any
    accounts: Any
    arrives: Any
    h: Any
    lag: Any
    feed: Any
    most: Any
    rest_speed: Any
    weight: Any
    carried: Any


@kernel
def _carry(circles, i, x, y):
    """Move circle i by (x, y) that is no push and feeds nobody: `moved` gets what of it the position has got, rounded as that is."""
    to_x, to_y = circles.position[i, 0] + x, circles.position[i, 1] + y
    circles.moved[i, 0] += to_x - circles.position[i, 0]
    circles.moved[i, 1] += to_y - circles.position[i, 1]
    circles.position[i, 0], circles.position[i, 1] = to_x, to_y


@kernel
def _bounce(i, j, dx, dy, reach, e, mu, ri, rj, circles, law, spent):
    """An overlapping pair that meets faster than a contact at rest: back to when and where it met, and on from there.

    At the time t ago at which their distance was `reach` they met at the speed v_n along n. They part with e v_n; the impulse
    (1 + e) v_n / W, W = w_i + w_j, keeps the momentum, for e = 1 the energy too, and what was gained in velocity has carried them for
    the time t. Friction takes the slip v_t of the rims, as far as mu times the impulse goes: a disc has I = m r^2 / 2, so that the
    rims have the inverse mass 3 W along the tangent (n_y, -n_x). Returns whether they have met in this substep.
    """
    zero = law.h - law.h
    half = law.h / (law.h + law.h)
    two = (law.h + law.h) / law.h
    three = two + law.h / law.h
    v, a, w = circles.velocity, circles.acceleration, circles.inverse_mass
    wi, wj = w[i], w[j]
    ax, ay = a[j, 0] - a[i, 0], a[j, 1] - a[i, 1]
    vx, vy = v[j, 0] - v[i, 0] + law.lag * ax, v[j, 1] - v[i, 1] + law.lag * ay
    time = impact_time(dx, dy, vx, vy, ax, ay, reach, law.h)
    dx -= time * (vx - half * time * ax)
    dy -= time * (vy - half * time * ay)
    distance = np.sqrt(dx * dx + dy * dy)
    if not distance > zero:
        return False
    nx, ny = dx / distance, dy / distance
    vx -= time * ax
    vy -= time * ay
    hit = -(vx * nx + vy * ny)
    if not hit > law.rest_speed:
        return False
    kick = (hit + e * hit) / (wi + wj)
    px, py = kick * nx, kick * ny
    if spent.shape[0] > 0:
        spent[0] -= half * np.float64(hit) * hit * (1.0 - np.float64(e) * e) / (wi + wj)
    if mu > zero:
        slip = vx * ny - vy * nx + circles.spin[i] * ri + circles.spin[j] * rj
        most = mu * kick
        rub = max(min(-slip / (three * (wi + wj)), most), -most)
        px += rub * ny
        py -= rub * nx
        circles.spin[i] += two * rub * wi / ri
        circles.spin[j] += two * rub * wj / rj
        if spent.shape[0] > 0:
            spent[1] += np.float64(rub) * (slip + 1.5 * (wi + wj) * rub)
    v[i, 0], v[i, 1] = v[i, 0] - px * wi, v[i, 1] - py * wi
    v[j, 0], v[j, 1] = v[j, 0] + px * wj, v[j, 1] + py * wj
    _carry(circles, i, -time * px * wi, -time * py * wi)
    _carry(circles, j, time * px * wj, time * py * wj)
    return True


@kernel
def _make_room(i, j, dx, dy, reach, circles, law):
    """A pair on its way apart goes to where it no longer overlaps, without being thrown apart any faster.

    Without weight, one that parts by itself within the substep is left alone: moving it changes its angular momentum.
    """
    distance = np.sqrt(dx * dx + dy * dy)
    depth = reach - distance
    if not (depth > 0 and distance > 0):
        return
    vx = circles.velocity[j, 0] - circles.velocity[i, 0]
    vy = circles.velocity[j, 1] - circles.velocity[i, 1]
    leaving = (dx * vx + dy * vy) / distance
    carries = circles.carries[i] + circles.carries[j] > 0
    if carries or (law.weight != 0 and leaving * law.h < depth):
        wi, wj = circles.inverse_mass[i], circles.inverse_mass[j]
        by = min(depth, law.most * reach) / ((wi + wj) * distance)
        _carry(circles, i, -by * dx * wi, -by * dy * wi)
        _carry(circles, j, by * dx * wj, by * dy * wj)


@kernel
def _apart(i, j, k, circles, pairs):
    """From i to j, the pair of lane k, m."""
    dx = pairs.gap[0, k] + (circles.moved[j, 0] - circles.moved[i, 0])
    return dx, pairs.gap[1, k] + (circles.moved[j, 1] - circles.moved[i, 1])


@kernel
def _treat(bits, k, at, circles, pairs, law, spent):
    """Pairs of a pack, by bits, that meet or part faster than a contact at rest: one by one, for hardly any does.

    Returns those that are done with: the others turn out to rest.
    """
    done = 0
    v, a, m = circles.velocity, circles.acceleration, pairs.made_of
    for lane in range(LANES):
        if (bits >> lane) & 1:
            i, j = pairs.lane_i[k + lane], pairs.lane_j[k + lane]
            if lane > 0 and i == pairs.lane_i[k + lane - 1] and j == pairs.lane_j[k + lane - 1]:
                done |= ((done >> (lane - 1)) & 1) << lane  # a pair repeated to fill the pack
                continue
            dx, dy = _apart(i, j, k + lane, circles, pairs)
            one, reach = at + lane * law.mixed, pairs.reach[(k + lane) * law.varied]
            vx = v[j, 0] - v[i, 0] + law.lag * (a[j, 0] - a[i, 0])
            vy = v[j, 1] - v[i, 1] + law.lag * (a[j, 1] - a[i, 1])
            along = dx * vx + dy * vy
            if along < 0:
                if not _bounce(i, j, dx, dy, reach, m[E, one], m[MU, one], m[R_I, one], m[R_J, one], circles, law, spent):
                    continue
                dx, dy = _apart(i, j, k + lane, circles, pairs)
            elif not along > law.rest_speed * np.sqrt(dx * dx + dy * dy):
                continue
            _make_room(i, j, dx, dy, reach, circles, law)
            done |= 1 << lane
    return done


@kernel
def push_strip(s, to, circles, pairs, law, looks):
    """The first sweep over strip s; normals go to `to` and up. If `looks`, notes in `deep` the packs that overlap by more than DEEP."""
    moved, lane_i, lane_j = circles.moved, pairs.lane_i, pairs.lane_j
    real = moved.dtype.type
    zero, one, limit = spread(real(0)), spread(real(1)), spread(real(DEEP))
    pushed, most, rest = spread(real(PUSHED)), spread(law.most), spread(law.rest_speed)
    answer = spread(real(-GRIP * PUSHED / (3.0 * FED)))
    begin, end, count = pairs.begin[s], pairs.begin[s] + pairs.lanes[s], 0
    close, to = begin + pairs.apart[s], to - begin
    spent = pairs.spent[s] if law.accounts != 0 else pairs.spent[0, :0]
    for k in range(begin, end, LANES):
        xi, yi = take(moved, lane_i, k)
        xj, yj = take(moved, lane_j, k)
        dx, dy = load(pairs.gap[0], k) + (xj - xi), load(pairs.gap[1], k) + (yj - yi)
        r, part = load(pairs.reach, k * law.varied), load(pairs.share, k * law.varied)
        distance = square_root(dx * dx + dy * dy)
        if (k < close or law.asks != 0) and which_above(r, distance) == 0:
            store(pairs.normal[0], to + k, zero)
            store(pairs.normal[1], to + k, zero)
            if law.asks != 0:
                store(pairs.depth, k, zero)
            continue
        done, at = 0, k * law.mixed
        mu = zero
        if law.asks != 0:
            e, mu = load(pairs.made_of[E], at), load(pairs.made_of[MU], at)
            live = which_above(e + mu, zero)
            if live != 0 or law.listens != 0:
                vxi, vyi = take(circles.velocity, lane_i, k)
                vxj, vyj = take(circles.velocity, lane_j, k)
                closing = zero - (dx * (vxj - vxi) + dy * (vyj - vyi))
                touching = which_above(r, distance)
                if law.listens != 0:
                    speed = larger(closing / where_zero(distance, r, distance), zero)
                    heard = load(pairs.closing, k)
                    store(pairs.closing, k, where_set(touching, larger(heard, speed), heard))
                free = one - pick(circles.carries, lane_i, k) * pick(circles.carries, lane_j, k)
                fast = which_above(free * larger(closing, zero - closing), rest * distance)
                done = live & touching & fast
                if done != 0:
                    done = _treat(done, k, at, circles, pairs, law, spent)
                    xi, yi = take(moved, lane_i, k)
                    xj, yj = take(moved, lane_j, k)
                    dx, dy = load(pairs.gap[0], k) + (xj - xi), load(pairs.gap[1], k) + (yj - yi)
                    distance = square_root(dx * dx + dy * dy)
        depth = where_set(done, zero, smaller(larger(r - distance, zero), most * r))
        dx = where_zero(distance, r, dx)
        distance = where_zero(distance, r, distance)
        per_metre = one / distance
        nx, ny = dx * per_metre, dy * per_metre
        push = pushed * depth
        cx, cy = nx * push, ny * push
        if law.asks != 0:
            store(pairs.depth, k, depth)
            if law.rubs != 0 and which_above(mu, zero) != 0:
                # What the contact has slipped is answered as an overlap is, within the cone of friction.
                slipped = load(pairs.slip, k)
                cone = mu * push
                rub = larger(smaller(answer * where_above(spread(real(NEW)), slipped, slipped, zero), cone), zero - cone)
                store(pairs.held, k, rub)
                cx, cy = cx + rub * ny, cy - rub * nx
                turned_i, turned_j = pick(circles.turned, lane_i, k), pick(circles.turned, lane_j, k)
                place(circles.turned, lane_i, k, turned_i + rub * load(pairs.made_of[TURN_I], at))
                place(circles.turned, lane_j, k, turned_j + rub * load(pairs.made_of[TURN_J], at))
        put(moved, lane_i, k, xi - cx * part, yi - cy * part)
        put(moved, lane_j, k, xj + cx * (one - part), yj + cy * (one - part))
        store(pairs.normal[0], to + k, where_zero(depth, zero, nx))
        store(pairs.normal[1], to + k, where_zero(depth, zero, ny))
        if looks != 0 and which_above(depth, limit * r) != 0:
            pairs.deep[begin // LANES + count] = k
            count += 1
    if looks != 0:
        pairs.deeps[s] = count


@kernel
def refine_strip(s, circles, pairs, law):
    """Part again, there and back, the packs in `deep` that still overlap by more than DEEP; `deeps` becomes how many those are.

    Beyond LARGEST_PUSH it is no weight but a mistake, and has been pushed enough.
    """
    moved, lane_i, lane_j, count = circles.moved, pairs.lane_i, pairs.lane_j, pairs.deeps[s]
    real, first = moved.dtype.type, pairs.begin[s] // LANES
    zero, one, near, nearest = spread(real(0)), spread(real(1)), spread(real(1 - DEEP)), spread(real(1 - LARGEST_PUSH))
    pushed = spread(real(DEEP_PART * PUSHED))
    for sweep in range(DEEP_SWEEPS):
        left = 0
        for m in range(count):
            k = pairs.deep[first + (count - 1 - m if sweep % 2 else m)]
            xi, yi = take(moved, lane_i, k)
            xj, yj = take(moved, lane_j, k)
            dx, dy = load(pairs.gap[0], k) + (xj - xi), load(pairs.gap[1], k) + (yj - yi)
            r, part = load(pairs.reach, k * law.varied), load(pairs.share, k * law.varied)
            distance = square_root(dx * dx + dy * dy)
            excess = where_zero(larger(distance - nearest * r, zero), zero, larger(near * r - distance, zero))
            if which_above(excess, zero) == 0:
                continue
            if sweep == 0:
                pairs.deep[first + left] = k
                left += 1
            push = pushed * excess / larger(distance, nearest * r)
            cx, cy = dx * push, dy * push
            put(moved, lane_i, k, xi - cx * part, yi - cy * part)
            put(moved, lane_j, k, xj + cx * (one - part), yj + cy * (one - part))
        if sweep == 0:
            count = left
    pairs.deeps[s] = count


@kernel
def relax_strip(s, to, circles, pairs, law):
    """The second sweep over strip s: no approach, and no slip but what friction cannot hold, between circles that touch."""
    velocity, lane_i, lane_j = circles.velocity, pairs.lane_i, pairs.lane_j
    real = velocity.dtype.type
    zero, one, third, half3 = spread(real(0)), spread(real(1)), spread(real(1) / real(3)), spread(real(1.5))
    new, feed, fed = spread(real(NEW)), spread(law.feed), spread(law.feed * real(PUSHED))
    memory = spread(real(3) * law.h / real(GRIP))
    begin, end = pairs.begin[s], pairs.begin[s] + pairs.lanes[s]
    close, to = begin + pairs.apart[s], to - begin
    taken = 0.0
    for k in range(begin, end, LANES):
        nx, ny = load(pairs.normal[0], to + k), load(pairs.normal[1], to + k)
        part = load(pairs.share, k * law.varied)
        if (k < close or law.rubs != 0) and which_above(nx * nx + ny * ny, zero) == 0:
            if law.rubs != 0:
                store(pairs.slip, k, new)
            continue
        xi, yi = take(velocity, lane_i, k)
        xj, yj = take(velocity, lane_j, k)
        vx, vy = xj - xi, yj - yi
        speed = vx * nx + vy * ny
        cx, cy = speed * nx, speed * ny
        if law.rubs != 0:
            at = k * law.mixed
            mu = load(pairs.made_of[MU], at)
            if which_above(mu, zero) != 0:
                ri, rj = load(pairs.made_of[R_I], at), load(pairs.made_of[R_J], at)
                depth, before, given = load(pairs.depth, k), load(pairs.slip, k), load(pairs.held, k) * feed
                si, sj = pick(circles.spin, lane_i, k), pick(circles.spin, lane_j, k)
                slides = vx * ny - vy * nx + si * ri + sj * rj
                # As changes of the relative velocity: impulses times W. Together with what the push has given.
                cone = mu * larger(depth * fed - larger(speed, zero), zero)
                rub = larger(smaller(given - third * slides, cone), zero - cone) - given
                if law.accounts != 0:
                    mass = load(pairs.made_of[MASS], at)
                    taken += add_lanes(mass * rub * (slides + half3 * rub), _distinct(lane_i, lane_j, k))
                cx, cy = cx - rub * ny, cy + rub * nx
                place(circles.spin, lane_i, k, si + rub * load(pairs.made_of[TURN_I], at))
                place(circles.spin, lane_j, k, sj + rub * load(pairs.made_of[TURN_J], at))
                # Measured from where the substep started; the velocity would count feeds that have moved nobody yet.
                ui, wi = take(circles.moved, lane_i, k)
                uj, wj = take(circles.moved, lane_j, k)
                rolled = pick(circles.turn, lane_i, k) * ri + pick(circles.turn, lane_j, k) * rj
                slipped = before + (uj - ui) * ny - (wj - wi) * nx + rolled
                most = cone * memory
                slipped = where_above(new, before, larger(smaller(slipped, most), zero - most), zero)
                store(pairs.slip, k, where_above(depth, zero, slipped, new))
        put(velocity, lane_i, k, xi + cx * part, yi + cy * part)
        put(velocity, lane_j, k, xj - cx * (one - part), yj - cy * (one - part))
    if law.accounts != 0:
        pairs.spent[s, 1] += taken


@kernel
def _distinct(lane_i, lane_j, k):
    """Lanes of a pack before it repeats its last pair to be full."""
    lanes = LANES
    while lanes > 1 and lane_i[k + lanes - 1] == lane_i[k + lanes - 2] and lane_j[k + lanes - 1] == lane_j[k + lanes - 2]:
        lanes -= 1
    return lanes


@kernel
def _clear(numbers, a, b):
    """numbers[a:b] = 0."""
    for i in range(a, b):
        numbers[i] = 0


@kernel
def _arrive(a, b, circles, law):
    """Of the circles from a up to b: pushes become places, and velocities; who has been fed so much carries weight."""
    zero, one = law.h - law.h, law.h / law.h
    limit = law.carried * law.carried
    for i in range(a, b):
        x = circles.moved[i, 0] - (circles.position[i, 0] - circles.origin[i, 0])
        y = circles.moved[i, 1] - (circles.position[i, 1] - circles.origin[i, 1])
        circles.position[i, 0] += x
        circles.position[i, 1] += y
        x, y = law.feed * x, law.feed * y
        circles.velocity[i, 0] += x
        circles.velocity[i, 1] += y
        square = x * x + y * y
        circles.carries[i] = one if square > limit else zero
        if law.rubs != 0:  # who rests against others, however lightly, ends the substep as they do
            circles.lift[i] = circles.leans[i] if square > zero else zero
    for i in range(a, b):
        circles.fed[i] = ((circles.fed[i] & (CARRIES | AT_WALL)) * CARRIED) | np.uint8(circles.carries[i])
    if law.rubs != 0:
        for i in range(a, b):
            circles.turn[i] = law.h * circles.spin[i] + circles.turned[i]
            circles.spin[i] += law.feed * circles.turned[i]


@kernel
def _refine_some(first, stop, parity, circles, pairs, law):
    """The strips 2 half + parity, half from `first` up to `stop`."""
    for half in range(first, stop):
        if pairs.deeps[2 * half + parity] > 0:
            refine_strip(2 * half + parity, circles, pairs, law)


@parallel_kernel
def push(circles, pairs, law, cut, looks, sets_out, claims):
    """The first sweep: impacts, and overlaps, and what has been slipped.

    cut: (2, threads + 1), which half s // 2 of the strips s with s % 2 = 0, and 1, each thread begins with. looks: 1 if packs that
    overlap deeply are to be noted. sets_out: 1 if `moved` is yet to be set to position - origin. claims: `compile.stealing`.
    """
    n = circles.position.shape[0]
    chunks = (n + _CHUNK - 1) // _CHUNK
    if sets_out != 0 or law.rubs != 0:
        for c in prange(chunks):
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            if sets_out != 0:
                set_out(circles.position[a:b], circles.origin[a:b], circles.moved[a:b])
            if law.rubs != 0:
                _clear(circles.turned, a, b)
    for parity in range(2):
        none_claimed(claims)
        for part in prange(claims.shape[0]):
            half = claim(claims, cut[parity], part)
            while half >= 0:
                s = 2 * half + parity
                push_strip(s, pairs.begin[s], circles, pairs, law, looks)
                half = claim(claims, cut[parity], part)
    left = 0
    for s in range(pairs.deeps.shape[0]):
        left += pairs.deeps[s]
    for parity in range(2):
        if left < _FEW:
            _refine_some(0, cut[parity, -1], parity, circles, pairs, law)
        else:
            for part in prange(cut.shape[1] - 1):
                _refine_some(cut[parity, part], cut[parity, part + 1], parity, circles, pairs, law)
    if law.asks != 0:
        for c in prange(chunks):
            _arrive(c * _CHUNK, min((c + 1) * _CHUNK, n), circles, law)
    elif law.arrives != 0:
        for c in prange(chunks):
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            arrive(circles.position[a:b], circles.velocity[a:b], circles.origin[a:b], circles.moved[a:b], law.feed)


@parallel_kernel
def relax(circles, pairs, law, cut, marks, claims):
    """The second sweep: touching pairs neither approach nor slip; if `marks` is 1, do what `mark_touching` does, too."""
    n = circles.position.shape[0]
    if law.rubs != 0:
        for c in prange((n + _CHUNK - 1) // _CHUNK):
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            set_out(circles.position[a:b], circles.start[a:b], circles.moved[a:b])
    for parity in range(2):
        none_claimed(claims)
        for part in prange(claims.shape[0]):
            half = claim(claims, cut[parity], part)
            while half >= 0:
                s = 2 * half + parity
                relax_strip(s, pairs.begin[s], circles, pairs, law)
                if marks != 0:
                    a = pairs.begin[s]
                    mark_strip(a, a + pairs.lanes[s], a, pairs.lane_i, pairs.lane_j, pairs.normal, circles.resting)
                half = claim(claims, cut[parity], part)


@kernel
def mark_strip(begin, end, to, lane_i, lane_j, normal, resting):
    """`resting` gains IN_PILE for every circle of a touching pair in the lanes from `begin` up to `end`; their normals are at `to`."""
    zero = spread(normal.dtype.type(0))
    for k in range(begin, end, LANES):
        nx, ny = load(normal[0], to - begin + k), load(normal[1], to - begin + k)
        touches = which_above(nx * nx + ny * ny, zero)
        for lane in range(LANES):
            bit = np.uint8(((touches >> lane) & 1) * IN_PILE)
            resting[lane_i[k + lane]] |= bit
            resting[lane_j[k + lane]] |= bit


@parallel_kernel
def mark_touching(lanes, begin, lane_i, lane_j, normal, resting, cut):
    """`resting` gains IN_PILE for every circle of a touching pair."""
    for parity in range(2):
        for part in prange(cut.shape[1] - 1):
            for half in range(cut[parity, part], cut[parity, part + 1]):
                a = begin[2 * half + parity]
                mark_strip(a, a + lanes[2 * half + parity], a, lane_i, lane_j, normal, resting)
