# mypy: ignore-errors
"""Sensors touched by particles on their paths in a substep: straight to their last impact, and straight on from there.

Sensors are segments, like those of obstacles, but in no contact list.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import cos, fabs, sin, sqrt
from cython.cimports.libc.stdint import int64_t, uint32_t

from pyverlet.core.cells import BLOCK
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.obstacles import BODY_OF, FACES, FIRST_FACE, LENGTH, PLACE, ROUNDING, SEGMENT, SENSOR, accepts_segment
from pyverlet.core.periodic import wrapped
from pyverlet.core.segments import way_to_line
from pyverlet.core.step import Step

Leg = cython.struct(
    x=cython.double, y=cython.double, dx=cython.double, dy=cython.double,  # start of the centre's path and vector to its end, m
    begin=cython.double, end=cython.double,  # parts of the substep
    reach=cython.double,
)  # fmt: skip
Box = cython.struct(x0=cython.double, y0=cython.double, x1=cython.double, y1=cython.double)
Point = cython.struct(x=cython.double, y=cython.double)

STRAIGHT_ENOUGH = cython.declare(cython.double, 1e-3)
"""Parts of a path that deviate from a straight line by less than this fraction of the reach count as straight."""

MOST_PIECES = cython.declare(cython.double, 4096)


@kernel
def leg_of(w: cython.pointer(Step), i: cython.Py_ssize_t, first: cython.bint) -> Leg:
    """The path of particle i in this substep, before it drifts: after its last impact, or (`first`) up to it."""
    leg: Leg
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    h: cython.double = w.h
    since: cython.double = min(w.since[i], h)
    bend: cython.double = 0.5 * since * (h - since)
    x: cython.double = w.position[2 * i] + v[width * i] * since - w.acceleration[2 * i] * bend
    y: cython.double = w.position[2 * i + 1] + v[width * i + 1] * since - w.acceleration[2 * i + 1] * bend
    if first:
        leg.dx, leg.dy = x - w.begun[2 * i], y - w.begun[2 * i + 1]
        x, y = w.begun[2 * i], w.begun[2 * i + 1]
        leg.begin, leg.end = 0.0, since / h
    else:
        leg.dx, leg.dy = w.position[2 * i] + v[width * i] * h - x, w.position[2 * i + 1] + v[width * i + 1] * h - y
        leg.begin, leg.end = since / h, 1.0
    leg.x = wrapped(cython.cast(real, x), w.cells.low_x, w.cells.period_x)
    leg.y = wrapped(cython.cast(real, y), w.cells.low_y, w.cells.period_y)
    leg.reach = w.radius[i]
    return leg


@inlined
def widen(
    box: cython.pointer(Box), x: cython.double, y: cython.double, dx: cython.double, dy: cython.double, by: cython.double
) -> cython.void:
    """Extend the box by all points within `by` of the line from (x, y) by (dx, dy)."""
    box.x0, box.y0 = min(box.x0, min(x, x + dx) - by), min(box.y0, min(y, y + dy) - by)
    box.x1, box.y1 = max(box.x1, max(x, x + dx) + by), max(box.y1, max(y, y + dy) + by)


@inlined
def nothing() -> Box:
    """An empty box."""
    box: Box
    box.x0 = box.y0 = 1e300
    box.x1 = box.y1 = -1e300
    return box


@kernel
def box_of(w: cython.pointer(Step), k: cython.Py_ssize_t, faces: cython.Py_ssize_t) -> Box:
    """Bounds of segment k, or of the polygon of so many faces that begins with it, during this substep."""
    box: Box = nothing()
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[SEGMENT * k + BODY_OF])
    now: cython.double = w.substep * cython.cast(cython.double, w.h)
    for n in range(k, k + max(faces, 1)):
        at: cython.Py_ssize_t = SEGMENT * n
        x: cython.double = w.segment[at + PLACE]
        y: cython.double = w.segment[at + PLACE + 1]
        far: cython.double = w.segment[at + LENGTH]
        arm: cython.double = fabs(x - w.body[b] - w.body[b + 3] * now) + fabs(y - w.body[b + 1] - w.body[b + 4] * now) + far
        speed: cython.double = fabs(w.body[b + 3]) + fabs(w.body[b + 4]) + fabs(w.body[b + 5]) * arm
        by: cython.double = w.segment[at + ROUNDING] + w.h * speed
        widen(cython.address(box), x, y, far * w.segment[at + PLACE + 2], far * w.segment[at + PLACE + 3], by)
    return box


@kernel
def seen(w: cython.pointer(Step), k: cython.Py_ssize_t, leg: cython.pointer(Leg), part: cython.double) -> Point:
    """A particle after so much of a leg in the frame of segment k: its start is the origin, its end (length, 0)."""
    p: Point
    at: cython.Py_ssize_t = SEGMENT * k
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
    now: cython.double = w.substep * cython.cast(cython.double, w.h)
    time: cython.double = w.h * (leg.begin + part * (leg.end - leg.begin))
    c: cython.double = cos(w.body[b + 5] * time)
    s: cython.double = sin(w.body[b + 5] * time)
    px: cython.double = w.body[b] + w.body[b + 3] * now
    py: cython.double = w.body[b + 1] + w.body[b + 4] * now
    ox: cython.double = leg.x + part * leg.dx - (px + w.body[b + 3] * time)
    oy: cython.double = leg.y + part * leg.dy - (py + w.body[b + 4] * time)
    x: cython.double = c * ox + s * oy - (w.segment[at + PLACE] - px)
    y: cython.double = c * oy - s * ox - (w.segment[at + PLACE + 1] - py)
    p.x = w.segment[at + PLACE + 2] * x + w.segment[at + PLACE + 3] * y
    p.y = w.segment[at + PLACE + 2] * y - w.segment[at + PLACE + 3] * x
    return p


@kernel
def parts_of(w: cython.pointer(Step), k: cython.Py_ssize_t, leg: cython.pointer(Leg)) -> cython.int:
    """How many straight parts approximate a leg in the frame of segment k, in which it is curved if the segment turns.

    A path with the second derivative a deviates by a t^2 / 8 from a straight one over t; a is w^2 r + 2 w u for a point at r from
    the pivot that moves with u.
    """
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[SEGMENT * k + BODY_OF])
    time: cython.double = w.h * (leg.end - leg.begin)
    turn: cython.double = fabs(w.body[b + 5]) * time
    if turn == 0:
        return 1
    way: cython.double = fabs(leg.dx - w.body[b + 3] * time) + fabs(leg.dy - w.body[b + 4] * time)
    late: cython.double = w.h * (w.substep + 1) * (fabs(w.body[b + 3]) + fabs(w.body[b + 4]))
    bent: cython.double = turn * (fabs(leg.x - w.body[b]) + fabs(leg.y - w.body[b + 1]) + late) + (2 + turn) * way
    most: cython.double = STRAIGHT_ENOUGH * (leg.reach + w.segment[SEGMENT * k + ROUNDING])
    return cython.cast(cython.int, min(1 + sqrt(turn * bent / (8 * most)), MOST_PIECES))


@kernel
def passes(w: cython.pointer(Step), k: cython.Py_ssize_t, leg: cython.pointer(Leg)) -> cython.bint:
    """Whether a particle touches segment k on a leg of its path; each straight part is a circle cast."""
    reach: cython.double = w.segment[SEGMENT * k + ROUNDING] + leg.reach
    parts: cython.int = parts_of(w, k, leg)
    n: cython.int
    b: Point
    a: Point = seen(w, k, leg, 0)
    for n in range(1, parts + 1):
        b = seen(w, k, leg, cython.cast(cython.double, n) / parts)
        way: cython.double = sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y))
        dx: cython.double = (b.x - a.x) / way if way > 0 else 1.0
        dy: cython.double = (b.y - a.y) / way if way > 0 else 0.0
        if way_to_line(a.x, a.y, dx, dy, w.segment[SEGMENT * k + LENGTH], reach) <= way:
            return True
        a = b
    return False


@kernel
def crosses_segment(
    w: cython.pointer(Step), k: cython.Py_ssize_t, faces: cython.Py_ssize_t, leg: cython.pointer(Leg)
) -> cython.bint:
    """`passes` for segment k, or for the polygon of so many faces that begins with it, whose inside counts."""
    inside: cython.bint = faces > 0
    for n in range(k, k + max(faces, 1)):
        if passes(w, n, leg):
            return True
        inside &= seen(w, n, leg, 1).y > 0
    return inside


@inlined
def boxes_overlap(a: cython.pointer(Box), b: cython.pointer(Box)) -> cython.bint:
    """Whether two boxes intersect."""
    return a.x0 <= b.x1 and a.x1 >= b.x0 and a.y0 <= b.y1 and a.y1 >= b.y0


@kernel
def sense_one(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, faces: cython.Py_ssize_t, box: cython.pointer(Box)
) -> cython.void:
    """Record whether particle i touches the sensor of segment k, which has this box."""
    number: int64_t = cython.cast(int64_t, w.segment[SEGMENT * k + SENSOR]) - 1
    place: cython.Py_ssize_t = i * ((w.sensors + 31) // 32) + number // 32
    bit: uint32_t = cython.cast(uint32_t, cython.cast(uint32_t, 1) << (number % 32))
    first: cython.int
    for first in range(2 if w.since[i] > 0 else 1):
        leg: Leg = leg_of(w, i, first == 1)
        around: Box = nothing()
        widen(cython.address(around), leg.x, leg.y, leg.dx, leg.dy, leg.reach)
        if not (boxes_overlap(box, cython.address(around)) and crosses_segment(w, k, faces, cython.address(leg))):
            continue
        w.sensed[place] |= bit
        if first == 0 and w.substep + 1 == w.substeps:
            leg.x, leg.y, leg.dx, leg.dy, leg.begin = leg.x + leg.dx, leg.y + leg.dy, 0.0, 0.0, leg.end
            if crosses_segment(w, k, faces, cython.address(leg)):
                w.inside[place] |= bit


@kernel
def sense(w: cython.pointer(Step), block: cython.int) -> cython.void:
    """Record the sensors that particles of a block touch in this substep, and at its end in the last one of a call."""
    a: cython.Py_ssize_t = block * BLOCK
    b: cython.Py_ssize_t = min(a + BLOCK, w.count)
    words: cython.Py_ssize_t = (w.sensors + 31) // 32
    here: Box = nothing()
    leg: Leg
    early: cython.int
    if w.substep + 1 == w.substeps:
        for i in range(a * words, b * words):
            w.inside[i] = 0
    for i in range(a, b):
        for early in range(2 if w.since[i] > 0 else 1):
            leg = leg_of(w, i, early == 1)
            widen(cython.address(here), leg.x, leg.y, leg.dx, leg.dy, leg.reach)
    for k in range(w.segments):
        faces: cython.Py_ssize_t = cython.cast(int64_t, w.segment[SEGMENT * k + FACES])
        first: cython.Py_ssize_t = cython.cast(int64_t, w.segment[SEGMENT * k + FIRST_FACE])
        if w.segment[SEGMENT * k + SENSOR] == 0 or (faces > 0 and first != k):
            continue
        box: Box = box_of(w, k, faces)
        if boxes_overlap(cython.address(box), cython.address(here)):
            for i in range(a, b):
                if accepts_segment(w, i, k):
                    sense_one(w, i, k, faces, cython.address(box))
