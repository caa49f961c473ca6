"""A substep of smooth inelastic circles in a cage, in one pass over the memory.

Stage after stage, a world that does not fit into the processor's caches is fetched from memory seven times a substep. Here all
stages of a strip are done while it is in the cache, each as soon as it may: the loops over the strips are fused, and since a
stage reads what the stage before it makes of the neighbouring strips, each loop runs a few strips behind the one before. Threads
share the strips out; what at the border of two shares needs both is left until both are done, and done then (shift-and-peel:
Manjikian and Abdelrahman, Fusion of Loops for Parallelism and Locality, 1997).

A pair of strip s writes to the circles of strip s and of the lowest row of strip s + 1, so that

    push(s)     comes before push(s - 1) and push(s + 1) if s is even, as ever,
    refine(s)   after push(s - 1), push(s), push(s + 1), and in the same order,
    settle(s)   after refine(s - 1) and refine(s): the circles of strip s arrive, and meet the wall,
    relax(s)    after settle(s) and settle(s + 1), and even strips first,
    leap(s)     after relax(s - 1) and relax(s): the circles of strip s begin the next substep.

So every sum is the same as stage after stage, in the same order, whatever the number of threads.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from pyverlet.compile.jit import driver, kernel, parallel_kernel, prange
from pyverlet.kernels.cage import hold_some
from pyverlet.kernels.contact import mark_strip, push_strip, refine_strip, relax_strip
from pyverlet.kernels.kinds import SMOOTH
from pyverlet.kernels.motion import any_strayed, arrive, kick_drift, set_out
from pyverlet.kernels.tables import Law

_push_strip, _relax_strip = push_strip[SMOOTH], relax_strip[SMOOTH]

BEHIND = 5
"""Strips by which the last stage is behind the first, and that a border leaves for later on both of its sides."""


class Strips(NamedTuple):
    """Where the circles of strip s stand, from held[s] to held[s + 1], and where it keeps its normals until they have been used.

    `looks`: deep packs are to be noted. `leaps`: the next substep is to be begun, under the same acceleration. `marks`: who
    touches is to be marked as resting. `far`: square of the distance that a circle may be from `checked` after a leap, m^2.
    """

    held: Any
    place: Any
    looks: Any
    leaps: Any
    marks: Any
    checked: Any
    far: Any


@kernel
def _refine(s, circles, pairs, law):
    if pairs.deeps[s] > 0:
        refine_strip(s, circles, pairs, law)


@kernel
def _set_out(s, t, circles, strips):
    a, b = strips.held[s], strips.held[t]
    set_out(circles.position[a:b], circles.origin[a:b], circles.moved[a:b])


@kernel
def _settle(s, t, circles, law, room, strips):
    """Of the strips from s up to t."""
    a, b = strips.held[s], strips.held[t]
    arrive(circles.position[a:b], circles.velocity[a:b], circles.origin[a:b], circles.moved[a:b], law.feed)
    hold_some(circles, room[0], room[1], room[2], law.h, law.lag, law.rest_speed, a, b)


@kernel
def _still(s, circles, pairs, law, strips):
    _relax_strip(s, strips.place[s], circles, pairs, law)
    if strips.marks != 0:
        a = pairs.begin[s]
        mark_strip(a, a + pairs.lanes[s], strips.place[s], pairs.lane_i, pairs.lane_j, pairs.normal, circles.resting)


@kernel
def _leap(s, t, circles, law, strips):
    """Of the strips from s up to t; whether one of their circles has strayed."""
    a, b = strips.held[s], strips.held[t]
    kick_drift(circles.position[a:b], circles.velocity[a:b], circles.acceleration[a:b], law.h)
    return any_strayed(circles.position.reshape(-1), strips.checked.reshape(-1), a, b, strips.far)


@kernel
def _share_of_strips(first, stop, circles, pairs, law, room, strips):
    """The strips from `first`, which is even, up to `stop`, but for what needs those of another thread."""
    below, above = (1 if first > 0 else 0), (1 if stop < pairs.lanes.shape[0] else 0)
    strayed = False
    for k in range(first, stop + BEHIND, 2):
        if k < stop:
            _set_out(k, min(k + 2, stop), circles, strips)
        for s in (k, k - 1):
            if first <= s < stop - above:
                _push_strip(s, strips.place[s], circles, pairs, law, strips.looks)
        for s in (k - 2, k - 3):
            if first + 2 * below <= s < stop - 3 * above:
                _refine(s, circles, pairs, law)
        for s in (k - 4, k - 3):
            if first + 3 * below <= s < stop - 3 * above:
                _settle(s, s + 1, circles, law, room, strips)
        for s in (k - 4, k - 5):
            if first + 4 * below <= s < stop - 5 * above:
                _still(s, circles, pairs, law, strips)
        for s in (k - 5, k - 4):
            if strips.leaps != 0 and first + 5 * below <= s < stop - 5 * above:
                strayed |= _leap(s, s + 1, circles, law, strips)
    return strayed


@kernel
def _border(s, circles, pairs, law, room, strips):
    """What two threads have left to be done below and above strip s, the first of one of them."""
    _push_strip(s - 1, strips.place[s - 1], circles, pairs, law, strips.looks)
    for t in (s - 2, s, s - 3, s - 1, s + 1):
        _refine(t, circles, pairs, law)
    _settle(s - 3, s + 3, circles, law, room, strips)
    for t in (s - 4, s - 2, s, s + 2, s - 5, s - 3, s - 1, s + 1, s + 3):
        _still(t, circles, pairs, law, strips)
    return strips.leaps != 0 and _leap(s - 5, s + 5, circles, law, strips)


@parallel_kernel
def _substep(cut, circles, pairs, law, room, strips):
    """From after the integration of a substep to its end, or to after that of the next; whether anyone has strayed in that.

    room: (x, y, radius). cut: (threads + 1,) even strip each thread begins with, at least 2 * BEHIND + 2 apart, and the number of
    strips.
    """
    strayed = 0
    for part in prange(cut.shape[0] - 1):
        strayed += int(_share_of_strips(cut[part], cut[part + 1], circles, pairs, law, room, strips))
    for part in prange(1, cut.shape[0] - 1):
        strayed += int(_border(cut[part], circles, pairs, law, room, strips))
    return strayed > 0


@driver
def substep(cut, circles, pairs, law, room, strips):
    """What `_substep` does, called from Python, which has plain tuples of numbers."""
    return _substep(cut, circles, pairs, Law(*law), room, Strips(*strips))
