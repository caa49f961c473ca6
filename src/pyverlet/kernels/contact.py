"""What happens to two circles that touch, eight pairs at a time: docs/design/contact-law.md, line by line.

A substep goes over the pairs twice. `push_strip`, before the walls: who meets too fast for a contact at rest bounces, there and
then, with friction (`kernels.bounce`); other overlaps are pushed apart, and what a contact has slipped is answered likewise.
`relax_strip`, after the walls: approach and slip of those that touch are set to 0, as far as friction goes, and the slip is
remembered.

Pushes are added up in `moved`, how far each circle has come since the list was made; in the end that goes into the positions and,
times a gain, into the velocities. So velocities in the first sweep are those of the motion, and an impact is what it would be
alone.

Two circles whose pair has neither restitution nor friction need no velocities in the first sweep, and are not asked whether they
bounce. What a pair is made of is kept by lane; nothing here depends on what other pairs are made of.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
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
from pyverlet.ground.constants import DEEP_PART, DEEP_SWEEPS, FED, GRIP, LARGEST_PUSH, PUSHED
from pyverlet.kernels.bounce import treat
from pyverlet.kernels.kinds import BOUNCES, RUBS, for_each_kind
from pyverlet.kernels.motion import IN_PILE
from pyverlet.kernels.tables import MASS, MU, NEW, R_I, R_J, TURN_I, TURN_J, E


def _push_strip(s, to, circles, pairs, law, looks):
    """The first sweep over strip s; normals go to `to` and up. If it `looks`, it notes in `deep` what overlaps deeply."""
    moved, lane_i, lane_j = circles.moved, pairs.lane_i, pairs.lane_j
    real = moved.dtype.type
    zero, one, limit = spread(real(0)), spread(real(1)), spread(law.deep)
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
        if (k < close or BOUNCES) and which_above(r, distance) == 0:
            store(pairs.normal[0], to + k, zero)
            store(pairs.normal[1], to + k, zero)
            if BOUNCES:
                store(pairs.depth, k, zero)
            continue
        done, at = 0, k * law.mixed
        mu = zero
        if BOUNCES:
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
                # Where nothing accelerates, nothing that bounces rests: not even who moves alike is pushed, and fed.
                done = live & touching & (fast if law.weight != 0 else fast | which_above(e, zero))
                if done != 0:
                    done = treat(done, k, at, circles, pairs, law, spent)
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
        if BOUNCES:
            store(pairs.depth, k, depth)
            if RUBS and which_above(mu, zero) != 0:
                # What the contact has slipped is answered as an overlap is, within the cone of friction.
                slipped = load(pairs.slip, k)
                cone = mu * push
                rub = larger(smaller(answer * where_above(spread(real(NEW)), slipped, slipped, zero), cone), zero - cone)
                store(pairs.held, k, rub)
                # Beside the pushes, which it must not change: with it in `moved` single circles of rough piles spun for ever.
                ui, wi = take(circles.slid, lane_i, k)
                uj, wj = take(circles.slid, lane_j, k)
                sx, sy = rub * ny, zero - rub * nx
                put(circles.slid, lane_i, k, ui - sx * part, wi - sy * part)
                put(circles.slid, lane_j, k, uj + sx * (one - part), wj + sy * (one - part))
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
    """Part again, there and back, the packs in `deep` that still do so deeply; `deeps` becomes how many those are.

    Beyond LARGEST_PUSH it is no weight but a mistake, and has been pushed enough.
    """
    moved, lane_i, lane_j, count = circles.moved, pairs.lane_i, pairs.lane_j, pairs.deeps[s]
    real, first = moved.dtype.type, pairs.begin[s] // LANES
    zero, one, near, nearest = spread(real(0)), spread(real(1)), spread(real(1) - law.deep), spread(real(1 - LARGEST_PUSH))
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
def _struck(bits, k, circles, pairs):
    """Which of these pairs, that rested at their turn and now approach fast, do not both carry weight: one was struck since."""
    struck = 0
    for lane in range(LANES):
        if (bits >> lane) & 1:
            i, j = pairs.lane_i[k + lane], pairs.lane_j[k + lane]
            if not circles.carries[i] * circles.carries[j] > 0:
                struck |= 1 << lane
    return struck


def _relax_strip(s, to, circles, pairs, law):
    """The second sweep over strip s: no approach, and no slip but what friction cannot hold, between circles that touch."""
    velocity, lane_i, lane_j = circles.velocity, pairs.lane_i, pairs.lane_j
    real = velocity.dtype.type
    zero, one, third, half3 = spread(real(0)), spread(real(1)), spread(real(1) / real(3)), spread(real(1.5))
    new, feed, fed = spread(real(NEW)), spread(law.feed), spread(law.feed * real(PUSHED))
    memory, rest = spread(real(3) * law.h / real(GRIP)), spread(law.rest_speed)
    begin, end = pairs.begin[s], pairs.begin[s] + pairs.lanes[s]
    close, to = begin + pairs.apart[s], to - begin
    taken = lever = 0.0
    for k in range(begin, end, LANES):
        nx, ny = load(pairs.normal[0], to + k), load(pairs.normal[1], to + k)
        part = load(pairs.share, k * law.varied)
        if (k < close or RUBS) and which_above(nx * nx + ny * ny, zero) == 0:
            if RUBS:
                store(pairs.slip, k, new)
            continue
        xi, yi = take(velocity, lane_i, k)
        xj, yj = take(velocity, lane_j, k)
        vx, vy = xj - xi, yj - yi
        speed, at = vx * nx + vy * ny, k * law.mixed
        struck = 0
        if BOUNCES:
            fast = which_above(zero - speed, rest) & which_above(load(pairs.made_of[E], at), zero)
            if fast != 0:
                struck = _struck(fast, k, circles, pairs)
                speed = where_set(struck, zero, speed)
            if law.accounts != 0:  # what was fed, too, has pushed them apart
                given = where_set(struck, zero, fed * load(pairs.depth, k)) - speed
                squeezed = load(pairs.made_of[MASS], at) * load(pairs.reach, k * law.varied) * given
                lever += add_lanes(squeezed, _distinct(lane_i, lane_j, k))
        cx, cy = speed * nx, speed * ny
        if RUBS:
            mu = load(pairs.made_of[MU], at)
            if which_above(mu, zero) != 0:
                ri, rj = load(pairs.made_of[R_I], at), load(pairs.made_of[R_J], at)
                depth, before, given = (
                    where_set(struck, zero, load(pairs.depth, k)),
                    load(pairs.slip, k),
                    load(pairs.held, k) * feed,
                )
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
    if BOUNCES and law.accounts != 0:
        pairs.spent[s, 1] += taken
        pairs.spent[s, 2] += lever


@kernel
def _distinct(lane_i, lane_j, k):
    """Lanes of a pack before it repeats its last pair to be full."""
    lanes = LANES
    while lanes > 1 and lane_i[k + lanes - 1] == lane_i[k + lanes - 2] and lane_j[k + lanes - 1] == lane_j[k + lanes - 2]:
        lanes -= 1
    return lanes


@kernel
def mark_strip(begin, end, to, lane_i, lane_j, normal, resting):
    """`resting` gains IN_PILE for every circle of a touching pair in the lanes from `begin` up to `end`, of normals at `to`."""
    zero = spread(normal.dtype.type(0))
    for k in range(begin, end, LANES):
        nx, ny = load(normal[0], to - begin + k), load(normal[1], to - begin + k)
        touches = which_above(nx * nx + ny * ny, zero)
        for lane in range(LANES):
            bit = np.uint8(((touches >> lane) & 1) * IN_PILE)
            resting[lane_i[k + lane]] |= bit
            resting[lane_j[k + lane]] |= bit


push_strip = for_each_kind(kernel, _push_strip)
relax_strip = for_each_kind(kernel, _relax_strip)
