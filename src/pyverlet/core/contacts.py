# mypy: ignore-errors
"""Contacts of discs: soft constraints with accumulated impulses (TGS-soft: Catto, Solver2D, 2024), eight pairs at a time."""

from __future__ import annotations

import cython
from cython.cimports.lanes import (
    above,
    any_above,
    any_lane,
    bits_of,
    both,
    choose,
    either,
    gather,
    lanes,
    lanes2,
    larger,
    load,
    mask,
    real,
    smaller,
    spread,
    store,
    take,
)
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import team_give_number, team_take_number

from pyverlet.core.event_recording import record_approach
from pyverlet.core.impacts import resolve_impacts
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pairs_in_lanes import Motion, apply_impulses, arm_of, clamped, held_roll, motion_of, slip_of
from pyverlet.core.rebounds import IN_LIST, REBOUND, STAMP
from pyverlet.core.step import ELASTIC, NEAR, TOUCHED, Step
from pyverlet.core.surfaces import bounce_surfaces, has_rebounds, meets_none
from pyverlet.core.warm_start import Normals, measure_pairs, turned_normals

NO_WAY = cython.declare(real, 1e-12 if cython.sizeof(real) == 8 else 1e-5)
"""Smaller gaps, over the contact distance, are rounding of positions."""

GENTLE = cython.declare(real, 0.1)
DEEP = cython.declare(real, 0.05)
"""When links are solved with contacts, springs separate at the fraction GENTLE of their speed, and only beyond this depth over
the smaller radius: links would pass it on, and nets exploded."""

SLOW = cython.declare(real, 0.1)
LINKED_DEEP = cython.declare(real, 0.8)
"""Overlapping pairs that separate more slowly than this fraction of the springs' speed are pushed, too. If forces may press them
together again, only beyond DEEP, or heaps would rest less; in worlds with links beyond LINKED_DEEP, or rag dolls exploded."""

STRAIGHT_WAY = cython.declare(real, 0.1)
"""Circles without restitution and friction also have impacts if their approach per substep, over the distance, exceeds this."""

INSIDE = cython.declare(real, 0.4)
UNDER_LOAD = cython.declare(real, 0.2)
MORE_SWEEPS = cython.declare(cython.int, 3)
"""A group with a pair that overlaps by more than these fractions of its contact distance is swept so many more times: a crowd
separates from its rim inwards, and under forces it must carry those above. Not with links, which would pass the push on; and
without forces rows would separate faster than necessary."""

MOST_PASSES = cython.declare(cython.int, 100)
"""Passes over a group of cell rows until no pair in it has an impact; a row of touching discs needs one for each."""


@inlined
def smaller_radius(w: cython.pointer(Step), k: cython.Py_ssize_t) -> lanes:
    """The smaller radius of each of the pairs from k on, m."""
    return smaller(load(w.radius_i, k * w.mixed), load(w.radius_j, k * w.mixed))


@inlined
def near_of(w: cython.pointer(Step), k: cython.Py_ssize_t) -> lanes:
    """The largest gap at which the pairs from k on carry load, m."""
    return spread(w.near) + spread(NEAR) * smaller_radius(w, k)


@inlined
def fast_ones(
    w: cython.pointer(Step),
    k: cython.Py_ssize_t,
    speed: lanes,
    depth: lanes,
    nx: lanes,
    ny: lanes,
    first_search: cython.bint,
    again: cython.bint,
) -> mask:
    """Mask of the pairs from k on that have an impact in this substep.

    Such pairs have restitution or friction or, in the first search of a substep, approach so far that the normal would turn
    before contact. They are faster than resting contacts, and than four times the load that they carried; were apart a substep
    ago; and would also meet without contact impulses: pairs that only these press together carry load.
    again: after other impacts; pairs that keep their energy may then hit what carries them.
    """
    rest: lanes = spread(-w.least_bounce)
    # Contact at the very end of a substep is left to the next: a spring would stop it, for a depth of rounding.
    rounding: lanes = spread(NO_WAY) * load(w.reach, k * w.sized)
    fast: mask = both(above(rest, speed), above(rounding - spread(w.h) * speed, -depth))
    if any_lane(fast):
        u: lanes2 = take(w.free, w.i, k)
        v: lanes2 = take(w.free, w.j, k)
        if not w.falls_free:
            rest = smaller(rest, spread(-w.resting) * larger(gather(w.strength, w.i, k), gather(w.strength, w.j, k)))
            fast = both(fast, above(rest, speed))
        fast = both(fast, above(rest, (v.x - u.x) * nx + (v.y - u.y) * ny))
        at: cython.Py_ssize_t = k * w.mixed
        bounces: lanes = load(w.restitution, at) + load(w.friction, at)
        if first_search and not w.linked:
            way: lanes = -spread(w.h) * speed - spread(STRAIGHT_WAY) * load(w.reach, k * w.sized)
            bounces = larger(bounces, larger(way, -near_of(w, k) - depth))
        fast = both(fast, above(bounces, spread(0)))
        if not w.restless:
            carried: lanes = load(w.load, k)
            free: mask = both(above(spread(TOUCHED), carried), above(rest + spread(4) * carried, speed))
            fast = both(fast, either(free, above(load(w.restitution, at), spread(ELASTIC))) if again else free)
    return fast


@kernel
def store_hits(w: cython.pointer(Step), k: cython.Py_ssize_t, bits: cython.int, place: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Write to `hit`, from `place` on, those of the eight pairs from k on whose bits are set; returns their number.

    Pairs that carry load are left out, unless another impact has thrown one particle at the other.
    """
    count: cython.Py_ssize_t = 0
    lane: cython.Py_ssize_t
    for lane in range(k, k + 8):
        if (bits >> (lane - k)) & 1:
            if lane > k and w.i[lane] == w.i[lane - 1] and w.j[lane] == w.j[lane - 1]:
                continue  # repeated to fill a batch
            if not w.restless and w.load[lane] >= TOUCHED and w.thrown[w.i[lane]] == 0 and w.thrown[w.j[lane]] == 0:
                continue
            w.hit[place + count] = lane
            count += 1
    return count


@inlined
def find_hits(w: cython.pointer(Step), s: cython.Py_ssize_t, at: cython.Py_ssize_t, rough: cython.bint) -> cython.Py_ssize_t:
    """Write to `hit`, from place `at` on, the pairs of group s that have an impact; returns their number."""
    zero: lanes = spread(0)
    first: cython.Py_ssize_t = w.begin[s]
    end: cython.Py_ssize_t = first + w.swept[s]
    count: cython.Py_ssize_t = 0
    k: cython.Py_ssize_t
    for k in range(first, end, 8):
        depth: lanes = load(w.depth, k)
        if any_above(depth + load(w.reach, k * w.sized), zero):
            m: Motion = motion_of(w, k, rough)
            nx: lanes = load(w.normal_x, k)
            ny: lanes = load(w.normal_y, k)
            fast: mask = fast_ones(w, k, (m.vx - m.ux) * nx + (m.vy - m.uy) * ny, depth, nx, ny, False, True)
            if any_lane(fast):
                count += store_hits(w, k, bits_of(fast), at + count)
    return count


@kernel
def list_rebound(w: cython.pointer(Step), s: cython.Py_ssize_t, k: cython.Py_ssize_t) -> cython.void:
    """List pair k of group s as an impact of linked particles, if it is one and not listed yet."""
    row: cython.pointer(cython.double) = w.pair_rebound
    if row[REBOUND * k + STAMP] == w.stamp and row[REBOUND * k + IN_LIST] == 0:
        row[REBOUND * k + IN_LIST] = 1
        w.rebound_pair[w.begin[s] + w.rebounding[s]] = k
        w.rebounding[s] += 1
        w.rebounded[s] = 1


@kernel
def bounce_pairs(w: cython.pointer(Step), s: cython.Py_ssize_t, first: cython.Py_ssize_t, hits: cython.Py_ssize_t) -> cython.bint:
    """Resolve the impacts of group s, in `hit` from `first` on, until there are no more, surfaces included."""
    a: cython.Py_ssize_t
    n: cython.int
    for n in range(MOST_PASSES):
        left: cython.Py_ssize_t = resolve_impacts(w, first, hits) if hits else 0
        if left == 0:
            return n > 0
        for a in range(first, first + left):
            k: cython.Py_ssize_t = w.hit[a] if w.hit[a] >= 0 else -1 - w.hit[a]
            if not meets_none(w, w.i[k]):
                bounce_surfaces(w, w.i[k])
            if not meets_none(w, w.j[k]):
                bounce_surfaces(w, w.j[k])
            if w.linked:
                list_rebound(w, s, k)
                w.rebounded[s] |= has_rebounds(w, w.i[k]) or has_rebounds(w, w.j[k])
        measure_pairs(w, s)
        hits = find_hits(w, s, first, True) if w.rough else find_hits(w, s, first, False)
    return True


@inlined
def solve(
    shared: cython.pointer(Step),
    s: cython.Py_ssize_t,
    at: cython.Py_ssize_t,
    rough: cython.bint,
    soft: cython.bint,
    pushes: cython.bint,
    moves_normals: cython.bint,
) -> cython.Py_ssize_t:
    """One sweep over the contacts of group s; writes impacts to `hit` from `at` on and returns their number.

    soft: springs separate overlaps, and pairs that are apart may close the gap but no more. Otherwise, where contacts carry load,
    the speed of separation is removed (relaxation).
    pushes: if false, soft contacts only keep pairs from approaching, and gently separate deep ones. That is for velocities that
    links have changed, as links would pass on what springs give.
    moves_normals: normals of pairs that turn fast are updated to those after the drift.
    """
    own: Step = shared[0]  # a copy that no store to an array can alias: its fields stay in registers
    w: cython.pointer(Step) = cython.address(own)
    zero: lanes = spread(0)
    # Links pull particles together, and impacts, which are not warm-started, hold too little.
    far: lanes = spread(-w.near - NEAR * cython.cast(real, w.lists.largest) if w.linked else -w.far)
    turning: lanes = spread(w.turning * w.turning)
    first: cython.Py_ssize_t = w.begin[s]
    end: cython.Py_ssize_t = first + w.swept[s]
    count: cython.Py_ssize_t = 0
    crowded: cython.bint = False
    k: cython.Py_ssize_t
    for k in range(first, end, 8):
        before: lanes = load(w.impulse, k)
        loaded: mask = above(before, zero)
        depth: lanes = load(w.depth, k) if soft else zero
        if not any_lane(loaded) and not (soft and any_above(depth, far)):
            continue
        nx: lanes = load(w.normal_x, k)
        ny: lanes = load(w.normal_y, k)
        m: Motion = motion_of(w, k, rough)
        speed: lanes = (m.vx - m.ux) * nx + (m.vy - m.uy) * ny
        after: lanes
        if soft:
            bias: lanes = -smaller(spread(w.rate) * depth, spread(w.push))
            crowded |= any_above(depth, spread(INSIDE if w.restless else UNDER_LOAD) * load(w.reach, k * w.sized))
            inside: lanes = before - spread(w.stiff) * (speed + bias) - spread(w.leak) * before
            nearer: lanes = speed - depth * spread(1 / w.h)
            if not pushes:
                beyond: lanes = larger(depth - spread(DEEP) * smaller_radius(w, k), zero)
                bias = -smaller(spread(w.rate) * beyond, spread(GENTLE * w.push))
                inside, nearer = before - smaller(speed + bias, zero), smaller(nearer, zero)
            apart: lanes = before - nearer
            # A loaded contact with a gap of rounding also has its spring; otherwise it would carry until it sinks in all at once.
            rounding: lanes = spread(NO_WAY) * load(w.reach, k * w.sized)
            after = larger(choose(above(depth, choose(loaded, -rounding, zero)), inside, apart), zero)
            # Separating pairs without load are left alone, except at gaps of rounding, or if they would overlap for long.
            slowly: lanes = spread(SLOW) * -bias
            if not w.restless:
                deep: lanes = spread(LINKED_DEEP if w.linked else DEEP) * smaller_radius(w, k)
                slowly = choose(above(depth, deep), slowly, zero)
            parts: lanes = larger(spread(1 / w.h) * rounding, slowly)
            after = choose(loaded, after, choose(above(speed, parts), zero, choose(above(depth, -near_of(w, k)), after, zero)))
            fast: mask = fast_ones(w, k, speed, depth, nx, ny, True, False)
            if any_lane(fast):
                count += store_hits(shared, k, bits_of(fast), at + count)
                after = choose(fast, before, after)
            if own.records_events:
                record_approach(w, k, speed, nx, ny, before, after)
        else:
            along_x: lanes = m.vx - m.ux
            along_y: lanes = m.vy - m.uy
            if own.turned and any_above(along_x * along_x + along_y * along_y, turning):
                if moves_normals:
                    n: Normals = turned_normals(w, k, before, nx, ny)
                    nx, ny = n.x, n.y
                # Along the normals before the drift, to first order.
                slide: lanes = along_x * ny - along_y * nx
                reach: lanes = load(w.reach, k * w.sized) * spread(1 / w.h)
                speed = along_x * nx + along_y * ny - smaller(slide * slide, reach * reach) / reach
            after = choose(loaded, larger(before - speed, zero), zero)
            after = choose(fast_ones(w, k, speed, depth, nx, ny, False, False), before, after)  # it is the next substep's impact
        store(w.impulse, k, after)
        tangent: lanes = zero
        turning_by: lanes = zero
        roll: lanes = zero
        if rough:
            old: lanes = load(w.tangent_impulse, k)
            arm: lanes = arm_of(w, k, depth if soft else load(w.depth, k))
            new: lanes = clamped(
                old - load(w.grip, k * w.mixed) * slip_of(w, k, m, nx, ny, arm), load(w.friction, k * w.mixed) * after
            )
            store(w.tangent_impulse, k, new)
            tangent = new - old
            turning_by = arm * tangent
            if own.rolls:
                had: lanes = load(w.roll_impulse, k)
                holds: lanes = held_roll(w, k, m, after, turning_by)
                store(w.roll_impulse, k, holds)
                roll = holds - had
        apply_impulses(w, k, rough, m, nx, ny, after - before, tangent, turning_by, roll)
    if soft:
        shared.crowded[s] = crowded
    return count


@inlined
def sweep(
    w: cython.pointer(Step), s: cython.Py_ssize_t, at: cython.Py_ssize_t, soft: cython.bint, pushes: cython.bint,
    moves_normals: cython.bint,
) -> cython.Py_ssize_t:  # fmt: skip
    """`solve`, specialised to worlds with and without friction."""
    if w.rough:
        return solve(w, s, at, True, soft, pushes, moves_normals)
    return solve(w, s, at, False, soft, pushes, moves_normals)


@kernel
def solve_contacts(w: cython.pointer(Step), s: cython.Py_ssize_t, stage: cython.int) -> cython.bint:
    """Solve the soft contacts of group s, then its impacts; returns whether there were any."""
    number: cython.int = team_take_number(w.team)
    at: cython.Py_ssize_t = number * w.lists.scratch_capacity
    hits: cython.Py_ssize_t = sweep(w, s, at, True, True, False)
    more: cython.int = MORE_SWEEPS if w.crowded[s] and not w.linked else 0
    while more > 0:
        hits = sweep(w, s, at, True, True, False)
        more -= 1
    bounced: cython.bint = hits > 0 and bounce_pairs(w, s, at, hits)
    team_give_number(w.team, number)
    w.bounced[s] = stage if bounced else 0
    w.searched[s] = stage
    return bounced


@kernel
def bounced_around(w: cython.pointer(Step), s: cython.Py_ssize_t) -> int32_t:
    """The last stage of this substep with an impact in a group that shares particles with group s; 0: none."""
    latest: int32_t = 0
    rows: cython.Py_ssize_t = w.lists.rows
    if s == rows:  # particles without a cell may touch any
        for g in range(rows):
            latest = max(latest, w.bounced[g])
        return latest
    if s > 0 or w.cells.wraps_v:
        latest = max(latest, w.bounced[s - 1 if s > 0 else rows - 1])
    if s + 1 < rows or w.cells.wraps_v:
        latest = max(latest, w.bounced[s + 1 if s + 1 < rows else 0])
    return max(latest, w.bounced[rows]) if w.groups > rows else latest


@kernel
def bounce_again(w: cython.pointer(Step), s: cython.Py_ssize_t, stage: cython.int) -> cython.bint:
    """Resolve impacts of group s caused by other groups since its last search; returns whether there were any."""
    if bounced_around(w, s) <= w.searched[s]:
        return False
    w.searched[s] = stage
    measure_pairs(w, s)
    number: cython.int = team_take_number(w.team)
    at: cython.Py_ssize_t = number * w.lists.scratch_capacity
    hits: cython.Py_ssize_t = find_hits(w, s, at, True) if w.rough else find_hits(w, s, at, False)
    bounced: cython.bint = bounce_pairs(w, s, at, hits)
    team_give_number(w.team, number)
    if bounced:
        w.bounced[s] = stage
    return bounced


@kernel
def relax_contacts(w: cython.pointer(Step), s: cython.Py_ssize_t) -> cython.void:
    """Relax the contacts of group s; the first such sweep of a substep updates normals to those after the drift."""
    if w.sweep == 0:
        sweep(w, s, 0, False, False, True)
    else:
        sweep(w, s, 0, False, False, False)


@kernel
def hold_contacts(w: cython.pointer(Step), s: cython.Py_ssize_t) -> cython.void:
    """Keep the pairs of group s from approaching further."""
    number: cython.int = team_take_number(w.team)
    sweep(w, s, number * w.lists.scratch_capacity, True, False, False)
    team_give_number(w.team, number)
