# mypy: ignore-errors
"""One-way lines: particles pass in one direction, u, and are held on the side that u points to.

A line holds a particle that does not overlap it and whose centre is, seen from the nearest point of the line, on the side that u
points to. It still holds it while they overlap, until the centre leaves that side. A particle that overlaps a line without having
been held passes, and all other parts of a chain let it pass meanwhile. A particle that is new to a line is held if it is, or was
a substep ago, almost beyond it. This is decided once per substep, and stored.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.obstacles import AFTER, BEFORE, BODY_OF, LENGTH, PLACE, SEGMENT, WAY
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import DRAG, HELD, PUSH, ROLL, SIDES, is_one_way, row_of
from pyverlet.core.surface_shapes import Path, Spot, path_of, spot_of

OVERLAPS = cython.declare(cython.double, 1e-3)
"""Overlaps below this fraction of the reach do not count: the particle lies on the line."""

ROUNDED_AWAY = cython.declare(cython.double, 8)
"""Nor do overlaps below this multiple of the rounding of coordinates."""

SIDEWAYS = cython.declare(cython.double, 1e-6)
"""Least cosine of the angle to u: parts of a line along u hold nothing."""

MOST_PARTS = cython.declare(cython.int, 64)
"""Most consecutive parts of a chain that are searched for the one nearest to a particle beyond a joint."""

SHALLOW = cython.declare(cython.double, 0.1)
"""Fraction of the reach: a particle new to a line that overlaps it by less, or came from beyond it, is held."""

Side = cython.struct(held=cython.bint, overlaps=cython.bint, came=cython.bint)
Nearby = cython.struct(beyond=cython.int, distance=cython.double, held=cython.bint)
"""A particle relative to a segment: -1 before its start, 1 beyond its end; the distance, m; whether it is on the holding side."""


@inlined
def nearby(w: cython.pointer(Step), at: cython.Py_ssize_t, x: cython.double, y: cython.double) -> Nearby:
    """The place of a particle at (x, y) relative to the one-way segment whose row begins at `at`."""
    p: Nearby
    length: cython.double = w.segment[at + LENGTH]
    p.beyond = -1 if x < 0 else 1 if x > length else 0
    x -= min(max(x, 0.0), length)
    p.distance = sqrt(x * x + y * y)
    p.held = x * w.segment[at + WAY] + y * w.segment[at + WAY + 1] > SIDEWAYS * p.distance
    return p


@kernel
def side_of(w: cython.pointer(Step), i: cython.Py_ssize_t, at: cython.Py_ssize_t) -> Side:
    """Whether particle i is on the side where a one-way segment holds, and whether it overlaps it.

    Beyond a joint the nearest part of the chain decides: for a part at the summit, a particle coming up the slope is below.
    """
    found: Side
    s: Spot = spot_of(w, i, at, PLACE)
    f: Path = path_of(w, i, at, cython.address(s))
    p: Nearby = nearby(w, at, s.x, s.y)
    q: Nearby = nearby(w, at, s.x - f.ux * w.h, s.y - f.uy * w.h)  # a substep ago, without impacts since
    reach: cython.double = s.reach
    rounding: cython.double = 2.3e-16 if cython.sizeof(real) == 8 else 1.2e-7
    rounding *= ROUNDED_AWAY * (fabs(w.position[2 * i]) + fabs(w.position[2 * i + 1]))
    found.overlaps = p.distance < reach - OVERLAPS * reach - rounding
    found.came = p.distance > (1 - SHALLOW) * reach or (q.held and q.distance > (1 - OVERLAPS) * reach)
    way: cython.int = p.beyond
    for _ in range(MOST_PARTS):
        joint: cython.Py_ssize_t = at + (BEFORE if way < 0 else AFTER)
        if way == 0 or p.beyond != way or (w.segment[joint] == 0 and w.segment[joint + 1] == 0):
            break
        following: cython.Py_ssize_t = at + way * SEGMENT
        if following < 0 or following >= SEGMENT * w.segments or w.segment[following + BODY_OF] != w.segment[at + BODY_OF]:
            break  # around a closed chain
        s = spot_of(w, i, following, PLACE)
        q = nearby(w, following, s.x, s.y)
        if q.beyond == -way:
            break  # the joint is nearest
        at, p = following, q
    found.held = p.held
    return found


@kernel
def find_sides(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Decide which one-way lines hold particle i in the coming substep."""
    k: cython.Py_ssize_t = w.contact_begin[i]
    end: cython.Py_ssize_t
    at: cython.Py_ssize_t
    while k < w.contact_end[i]:
        at = SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)
        if w.surface[k] < SIDES or not is_one_way(w, at):
            k += 1
            continue
        whose: cython.double = w.segment[at + BODY_OF]
        overlaps: cython.bint = False
        stays: cython.bint = False
        passes: cython.bint = False
        thrown: cython.bint = False
        end = k
        while end < w.contact_end[i] and w.surface[end] >= SIDES:  # segments of an obstacle are consecutive
            at = SEGMENT * (cython.cast(int64_t, w.surface[end]) - SIDES)
            if w.segment[at + BODY_OF] != whose:
                break
            side: Side = side_of(w, i, at)
            held: cython.double = w.contact[row_of(end) + HELD]
            overlaps |= side.overlaps
            passes |= side.overlaps and held < 0
            stays |= side.held and held > 0
            thrown |= side.held and held == 0 and side.overlaps and side.came
            w.contact[row_of(end) + HELD] = 1.0 if side.held else -1.0
            end += 1
        opens: cython.bint = overlaps and not stays and (passes or not thrown)
        for n in range(k, end):
            if opens or w.contact[row_of(n) + HELD] < 0:
                w.contact[row_of(n) + HELD] = -1.0
                w.contact[row_of(n) + PUSH] = w.contact[row_of(n) + DRAG] = w.contact[row_of(n) + ROLL] = 0
                forget_clear(w, i)
        k = end


@kernel
def stops(w: cython.pointer(Step), i: cython.Py_ssize_t, segment: cython.Py_ssize_t, across: cython.double) -> cython.bint:
    """Whether a one-way segment stops the centre of particle i, which starts at the distance `across` to its left, m."""
    at: cython.Py_ssize_t = SEGMENT * segment
    k: cython.Py_ssize_t
    if across * w.segment[at + WAY + 1] <= 0:
        return False
    for k in range(w.contact_begin[i], w.contact_end[i]):
        if w.surface[k] == SIDES + segment:
            return w.contact[row_of(k) + HELD] > 0
    return True  # it was far away
