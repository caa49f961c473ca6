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

from pyverlet.compile.bits import distinct_lanes
from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import (
    LANES,
    add_lanes,
    larger,
    load,
    pick,
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
from pyverlet.compile.rows import put_four, take_four
from pyverlet.ground.constants import DEEP_PART, DEEP_SWEEPS, FED, GRIP, LARGEST_PUSH, PUSHED
from pyverlet.kernels.bounce import slow_lanes, treat
from pyverlet.kernels.kinds import BOUNCES, LISTENS, RUBS, for_each_kind
from pyverlet.kernels.motion import IN_PILE
from pyverlet.kernels.tables import MU, NEW, R_I, R_J, TURN_I, TURN_J, E

ANSWER = -GRIP * PUSHED / (3.0 * FED)
"""Of what a contact has slipped: the push along the tangent that answers it."""


@kernel
def _hear(heard, k, touching, closing, distance):
    """Note how fast those meet that touch, of the eight pairs from k on, if it is faster than before."""
    before, none = load(heard, k), closing - closing
    store(heard, k, where_set(touching, larger(before, larger(closing / distance, none)), before))


def _push_strip(s, to, circles, pairs, law, looks):
    """The first sweep over strip s; normals go to `to` and up. If it `looks`, it notes in `deep` what overlaps deeply."""
    # Named here: in a loop each reading would count who holds the array.
    moved, velocity, rows, carries = circles.moved, circles.velocity, circles.rows, circles.carries
    lane_i, lane_j, gap, reach, share = pairs.lane_i, pairs.lane_j, pairs.gap, pairs.reach, pairs.share
    made_of, normal, depths, slips, heard = pairs.made_of, pairs.normal, pairs.depth, pairs.slip, pairs.closing
    calm = circles.calm
    real = moved.dtype.type
    zero, one, limit = spread(real(0)), spread(real(1)), spread(law.deep)
    pushed, most, rest = spread(real(PUSHED)), spread(law.most), spread(law.rest_speed)
    answer, new = spread(real(ANSWER)), spread(real(NEW))
    begin, end, count = pairs.begin[s], pairs.begin[s] + pairs.lanes[s], 0
    close, to = begin + pairs.apart[s], to - begin
    spent = pairs.spent[s] if law.accounts != 0 else pairs.spent[0, :0]
    for k in range(begin, end, LANES):
        xi, yi = take(moved, lane_i, k)
        xj, yj = take(moved, lane_j, k)
        dx, dy = load(gap[0], k) + (xj - xi), load(gap[1], k) + (yj - yi)
        r, part = load(reach, k * law.sized), load(share, k * law.varied)
        distance = square_root(dx * dx + dy * dy)
        touching = which_above(r, distance)
        if (k < close or BOUNCES) and touching == 0:
            store(normal[0], to + k, zero)
            store(normal[1], to + k, zero)
            if BOUNCES:
                store(depths, k, zero)
            if RUBS:
                store(slips, k, new)
            continue
        done, at, lively = 0, k * law.mixed, 0
        e, mu, slipped = zero, zero, new
        if RUBS:
            slipped = load(slips, k)
        if LISTENS and not BOUNCES and touching != 0:
            vxi, vyi = take(velocity, lane_i, k)
            vxj, vyj = take(velocity, lane_j, k)
            _hear(heard, k, touching, zero - (dx * (vxj - vxi) + dy * (vyj - vyi)), where_zero(distance, r, distance))
        if BOUNCES:
            e, mu = load(made_of[E], at), load(made_of[MU], at)
            lively = which_above(e + mu, zero)  # else these pairs neither bounce nor rub, whatever others do
        if BOUNCES and (lively != 0 or law.listens != 0):
            if RUBS:
                sxi, syi, turned_i, carries_i = take_four(rows, lane_i, k)
                sxj, syj, turned_j, carries_j = take_four(rows, lane_j, k)
            else:
                carries_i, carries_j = pick(carries, lane_i, k), pick(carries, lane_j, k)
            free = one - carries_i * carries_j
            # Where nothing accelerates, nothing that bounces rests: not even who moves alike is pushed, and fed.
            restless = which_above(e, zero) if law.weight == 0 else 0
            meets = e
            if RUBS:
                # They meet in the first substep of their contact: who overlaps in the next one, too, is held there by others.
                again = e if law.weight == 0 else where_above(mu, zero, zero, e)
                meets = where_above(new, slipped, again, e + spread(law.grazes) * mu)
            live = touching & which_above(meets, zero) & (which_above(free, zero) | restless)
            if live != 0 or law.listens != 0:
                vxi, vyi = take(velocity, lane_i, k)
                vxj, vyj = take(velocity, lane_j, k)
                closing = zero - (dx * (vxj - vxi) + dy * (vyj - vyi))
                if law.listens != 0:
                    _hear(heard, k, touching, closing, where_zero(distance, r, distance))
                speed = free * larger(closing, zero - closing)
                done = live & (which_above(speed, rest * distance) | restless)
                if done != 0 and calm.shape[0] > 0:
                    done &= which_above(speed, slow_lanes(calm, lane_i, lane_j, k, rest) * distance) | restless
                if done != 0:
                    done = treat(done, k, at, circles, pairs, law, spent)
                    xi, yi = take(moved, lane_i, k)
                    xj, yj = take(moved, lane_j, k)
                    dx, dy = load(gap[0], k) + (xj - xi), load(gap[1], k) + (yj - yi)
                    distance = square_root(dx * dx + dy * dy)
        depth = where_set(done, zero, smaller(larger(r - distance, zero), most * r))
        dx = where_zero(distance, r, dx)
        distance = where_zero(distance, r, distance)
        per_metre = one / distance
        nx, ny = dx * per_metre, dy * per_metre
        push = pushed * depth
        cx, cy = nx * push, ny * push
        if RUBS:
            store(slips, k, where_above(depth, zero, slipped, where_set(done, zero, new)))
        if BOUNCES:
            store(depths, k, depth)
            if RUBS and which_above(mu, zero) != 0:
                # What the contact has slipped is answered as an overlap is, within the cone of friction.
                cone = mu * push
                rub = larger(smaller(answer * where_above(new, slipped, slipped, zero), cone), zero - cone)
                # Beside the pushes, which it must not change: with it in `moved` single circles of rough piles spun for ever.
                sx, sy = rub * ny, zero - rub * nx
                turned_i = turned_i + rub * part * load(made_of[TURN_I], at)
                turned_j = turned_j + rub * (one - part) * load(made_of[TURN_J], at)
                put_four(rows, lane_i, k, sxi - sx * part, syi - sy * part, turned_i, carries_i)
                put_four(rows, lane_j, k, sxj + sx * (one - part), syj + sy * (one - part), turned_j, carries_j)
        put(moved, lane_i, k, xi - cx * part, yi - cy * part)
        put(moved, lane_j, k, xj + cx * (one - part), yj + cy * (one - part))
        store(normal[0], to + k, where_zero(depth, zero, nx))
        store(normal[1], to + k, where_zero(depth, zero, ny))
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
            r, part = load(pairs.reach, k * law.sized), load(pairs.share, k * law.varied)
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


def _relax_strip(s, to, circles, pairs, law):
    """The second sweep over strip s: no approach, and no slip but what friction cannot hold, between circles that touch."""
    # Named here: in a loop each reading would count who holds the array.
    velocity, rows, moved, carries = circles.velocity, circles.rows, circles.moved, circles.carries
    lane_i, lane_j, reach, share, made_of = pairs.lane_i, pairs.lane_j, pairs.reach, pairs.share, pairs.made_of
    normal, depths, slips, reduced = pairs.normal, pairs.depth, pairs.slip, pairs.reduced
    calm = circles.calm
    real = velocity.dtype.type
    zero, one, third, half3 = spread(real(0)), spread(real(1)), spread(real(1) / real(3)), spread(real(1.5))
    new, feed, fed = spread(real(NEW)), spread(law.feed), spread(law.feed * real(PUSHED))
    pushed, answer = spread(real(PUSHED)), spread(real(ANSWER))
    memory, rest = spread(real(3) * law.h / real(GRIP)), spread(law.rest_speed)
    begin, end = pairs.begin[s], pairs.begin[s] + pairs.lanes[s]
    close, to = begin + pairs.apart[s], to - begin
    taken = lever = 0.0
    for k in range(begin, end, LANES):
        nx, ny = load(normal[0], to + k), load(normal[1], to + k)
        part = load(share, k * law.varied)
        if (k < close or RUBS) and which_above(nx * nx + ny * ny, zero) == 0:
            continue
        if RUBS:
            xi, yi, si, turn_i = take_four(rows, lane_i, k)
            xj, yj, sj, turn_j = take_four(rows, lane_j, k)
        else:
            xi, yi = take(velocity, lane_i, k)
            xj, yj = take(velocity, lane_j, k)
        vx, vy = xj - xi, yj - yi
        speed, at = vx * nx + vy * ny, k * law.mixed
        struck = 0
        if BOUNCES:
            fast = which_above(zero - speed, rest) & which_above(load(made_of[E], at), zero)
            if fast != 0 and calm.shape[0] > 0:
                fast &= which_above(zero - speed, slow_lanes(calm, lane_i, lane_j, k, rest))
            if fast != 0:  # has been struck since its turn in the first sweep, unless both carry weight
                struck = fast & which_above(one - pick(carries, lane_i, k) * pick(carries, lane_j, k), zero)
                speed = where_set(struck, zero, speed)
            if law.accounts != 0:  # what was fed, too, has pushed them apart
                given = where_set(struck, zero, fed * load(depths, k)) - speed
                squeezed = load(reduced, k * law.varied) * load(reach, k * law.sized) * given
                lever += add_lanes(squeezed, distinct_lanes(lane_i, lane_j, k))
        cx, cy = speed * nx, speed * ny
        if RUBS:
            mu = load(made_of[MU], at)
            if which_above(mu, zero) != 0:
                ri, rj = load(made_of[R_I], at), load(made_of[R_J], at)
                depth, before = load(depths, k), load(slips, k)
                cone = mu * (pushed * depth)
                given = feed * larger(smaller(answer * where_above(new, before, before, zero), cone), zero - cone)
                depth = where_set(struck, zero, depth)
                slides = vx * ny - vy * nx + si * ri + sj * rj
                # As changes of the relative velocity: impulses times W. Together with what the push has given.
                cone = mu * larger(depth * fed - larger(speed, zero), zero)
                rub = larger(smaller(given - third * slides, cone), zero - cone) - given
                if law.accounts != 0:
                    mass = load(reduced, k * law.varied)
                    taken += add_lanes(mass * rub * (slides + half3 * rub), distinct_lanes(lane_i, lane_j, k))
                cx, cy = cx - rub * ny, cy + rub * nx
                turned_i = rub * part * load(made_of[TURN_I], at)
                turned_j = rub * (one - part) * load(made_of[TURN_J], at)
                si, sj = si + turned_i, sj + turned_j
                # Measured from where the substep started; the velocity would count feeds that have moved nobody yet.
                ui, wi = take(moved, lane_i, k)
                uj, wj = take(moved, lane_j, k)
                rolled = turn_i * ri + turn_j * rj
                slipped = before + (uj - ui) * ny - (wj - wi) * nx + rolled
                most = cone * memory
                slipped = where_above(new, before, larger(smaller(slipped, most), zero - most), zero)
                store(slips, k, where_above(depth, zero, slipped, where_set(struck, new, before)))
        if RUBS:
            put_four(rows, lane_i, k, xi + cx * part, yi + cy * part, si, turn_i)
            put_four(rows, lane_j, k, xj - cx * (one - part), yj - cy * (one - part), sj, turn_j)
        else:
            put(velocity, lane_i, k, xi + cx * part, yi + cy * part)
            put(velocity, lane_j, k, xj - cx * (one - part), yj - cy * (one - part))
    if BOUNCES and law.accounts != 0:
        pairs.spent[s, 1] += taken
        pairs.spent[s, 2] += lever


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
