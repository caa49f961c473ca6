"""A substep of smooth inelastic circles in a cage, in one pass over the memory.

Stage after stage, a world that does not fit into the processor's caches is fetched from memory seven times a substep. Here all
stages of a strip are done while it is in the cache, each as soon as it may: the loops over the strips are fused, and since a
stage reads what the stage before it makes of the neighbouring strips, each loop runs a few strips behind the one before. Threads
share the strips out; what at the border of two shares needs both is left until both are done, and done then (shift-and-peel:
Manjikian and Abdelrahman, Fusion of Loops for Parallelism and Locality, 1997).

A pair of strip s writes to the circles of strip s and of the lowest row of strip s + 1, so that

    project(s)  comes before project(s - 1) and project(s + 1) if s is even, as ever,
    refine(s)   after project(s - 1), project(s), project(s + 1), and in the same order,
    settle(s)   after refine(s - 1) and refine(s): the circles of strip s arrive, and meet the wall,
    still(s)    after settle(s) and settle(s + 1), and even strips first,
    leap(s)     after still(s - 1) and still(s): the circles of strip s begin the next substep.

So every sum is the same as stage after stage, in the same order, whatever the number of threads.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import LANES
from pyverlet.kernels.cage import hold_some
from pyverlet.kernels.motion import any_strayed, arrive, kick_drift, set_out
from pyverlet.kernels.packs import mark_strip, project_strip, refine_strip, still_strip

BEHIND = 5
"""Strips by which the last stage is behind the first, and that a border leaves for later on both of its sides."""


class Bodies(NamedTuple):
    """Circles in the order of their cells; those of strip s from held[s] to held[s + 1]. What each is: `Slots`, `Packs`."""

    held: Any
    position: Any
    velocity: Any
    acceleration: Any
    radius: Any
    inverse_mass: Any
    resting: Any
    hits: Any
    origin: Any
    moved: Any
    checked: Any


class Pairs(NamedTuple):
    """The pairs of `Packs`; `place[s]`: where in `normal` (2, room) strip s keeps its own until they have been used."""

    begin: Any
    lanes: Any
    apart: Any
    lane_i: Any
    lane_j: Any
    gap: Any
    reach: Any
    share: Any
    varied: Any
    deep: Any
    deeps: Any
    place: Any
    normal: Any


class Rules(NamedTuple):
    """Numbers, and what else there is to do.

    `looks`: deep packs are to be noted. `leaps`: the next substep is to be begun, under the same acceleration. `marks`: who
    touches is to be marked as resting. `far`: square of the distance that a circle may be from `checked` after a leap, m^2.
    """

    looks: Any
    leaps: Any
    marks: Any
    feed: Any
    most: Any
    x0: Any
    y0: Any
    size: Any
    h: Any
    lag: Any
    rest_speed: Any
    far: Any


@kernel
def _project(s, bodies, pairs, rules):
    a, b, at = pairs.begin[s], pairs.begin[s] + pairs.lanes[s], pairs.place[s]
    count = project_strip(
        bodies.moved, pairs.apart[s], pairs.lane_i[a:b], pairs.lane_j[a:b], pairs.gap[0, a:b], pairs.gap[1, a:b],
        pairs.reach[a * pairs.varied :], pairs.share[a * pairs.varied :], pairs.varied, rules.most,
        pairs.normal[0, at : at + b - a], pairs.normal[1, at : at + b - a], pairs.normal[0, :0],
        pairs.deep[a // LANES : b // LANES], rules.looks != 0,
    )  # fmt: skip
    if rules.looks != 0:
        pairs.deeps[s] = count


@kernel
def _refine(s, bodies, pairs):
    if pairs.deeps[s] > 0:
        a, b = pairs.begin[s], pairs.begin[s] + pairs.lanes[s]
        pairs.deeps[s] = refine_strip(
            bodies.moved, pairs.lane_i[a:b], pairs.lane_j[a:b], pairs.gap[0, a:b], pairs.gap[1, a:b],
            pairs.reach[a * pairs.varied :], pairs.share[a * pairs.varied :], pairs.varied,
            pairs.deep[a // LANES : b // LANES], pairs.deeps[s],
        )  # fmt: skip


@kernel
def _set_out(s, t, bodies):
    a, b = bodies.held[s], bodies.held[t]
    set_out(bodies.position[a:b], bodies.origin[a:b], bodies.moved[a:b])


@kernel
def _settle(s, t, bodies, rules):
    """Of the strips from s up to t."""
    a, b = bodies.held[s], bodies.held[t]
    arrive(bodies.position[a:b], bodies.velocity[a:b], bodies.origin[a:b], bodies.moved[a:b], rules.feed)
    hold_some(
        rules.x0, rules.y0, rules.size, bodies.position, bodies.velocity, bodies.acceleration, bodies.radius,
        bodies.inverse_mass, bodies.resting, bodies.hits, rules.h, rules.lag, rules.rest_speed, a, b,
    )  # fmt: skip


@kernel
def _still(s, bodies, pairs, rules):
    a, b, at = pairs.begin[s], pairs.begin[s] + pairs.lanes[s], pairs.place[s]
    normal = (pairs.normal[0, at : at + b - a], pairs.normal[1, at : at + b - a])
    lanes = (pairs.lane_i[a:b], pairs.lane_j[a:b])
    one = rules.most / rules.most
    still_strip(bodies.velocity, pairs.apart[s], *lanes, pairs.share[a * pairs.varied :], pairs.varied, one, *normal)
    if rules.marks != 0:
        mark_strip(bodies.resting, *lanes, *normal)


@kernel
def _leap(s, t, bodies, rules):
    """Of the strips from s up to t; whether one of their circles has strayed."""
    a, b = bodies.held[s], bodies.held[t]
    kick_drift(bodies.position[a:b], bodies.velocity[a:b], bodies.acceleration[a:b], rules.h)
    return any_strayed(bodies.position.reshape(-1), bodies.checked.reshape(-1), a, b, rules.far)


@kernel
def _share_of_strips(first, stop, bodies, pairs, rules):
    """The strips from `first`, which is even, up to `stop`, but for what needs those of another thread."""
    below, above = (1 if first > 0 else 0), (1 if stop < pairs.lanes.shape[0] else 0)
    strayed = False
    for k in range(first, stop + BEHIND, 2):
        if k < stop:
            _set_out(k, min(k + 2, stop), bodies)
        for s in (k, k - 1):
            if first <= s < stop - above:
                _project(s, bodies, pairs, rules)
        for s in (k - 2, k - 3):
            if first + 2 * below <= s < stop - 3 * above:
                _refine(s, bodies, pairs)
        for s in (k - 4, k - 3):
            if first + 3 * below <= s < stop - 3 * above:
                _settle(s, s + 1, bodies, rules)
        for s in (k - 4, k - 5):
            if first + 4 * below <= s < stop - 5 * above:
                _still(s, bodies, pairs, rules)
        for s in (k - 5, k - 4):
            if rules.leaps != 0 and first + 5 * below <= s < stop - 5 * above:
                strayed |= _leap(s, s + 1, bodies, rules)
    return strayed


@kernel
def _border(s, bodies, pairs, rules):
    """What two threads have left to be done below and above strip s, the first of one of them."""
    _project(s - 1, bodies, pairs, rules)
    for t in (s - 2, s, s - 3, s - 1, s + 1):
        _refine(t, bodies, pairs)
    _settle(s - 3, s + 3, bodies, rules)
    for t in (s - 4, s - 2, s, s + 2, s - 5, s - 3, s - 1, s + 1, s + 3):
        _still(t, bodies, pairs, rules)
    return rules.leaps != 0 and _leap(s - 5, s + 5, bodies, rules)


@parallel_kernel
def substep(cut, bodies, pairs, rules):
    """From after the integration of a substep to its end, or to after that of the next; whether anyone has strayed in that.

    cut: (threads + 1,) even strip each thread begins with, at least 2 * BEHIND + 2 apart, and the number of strips.
    """
    strayed = 0
    for part in prange(cut.shape[0] - 1):
        strayed += int(_share_of_strips(cut[part], cut[part + 1], bodies, pairs, rules))
    for part in prange(1, cut.shape[0] - 1):
        strayed += int(_border(cut[part], bodies, pairs, rules))
    return strayed > 0
