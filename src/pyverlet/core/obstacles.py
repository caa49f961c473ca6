# mypy: ignore-errors
"""Obstacles in the core: every shape consists of rounded segments, listed in a grid of hashed cells."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import cos, fabs, sin, sqrt
from cython.cimports.libc.stdint import int64_t, uint32_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.segments import FARTHEST_LISTED, list_line
from pyverlet.core.step import Step

SEGMENT = cython.declare(cython.int, 40)
"""Columns of a segment, in metres. The first 23 are as in `laws.obstacles`, the others are computed here."""
BODY_OF = cython.declare(cython.int, 0)
FIRST_FACE = cython.declare(cython.int, 1)  # of the polygon with FACES faces; 0 faces if it is not part of one
FACES = cython.declare(cython.int, 2)
AROUND = cython.declare(cython.int, 3)  # its surface speed runs counter-clockwise around it, else along it
LOCAL = cython.declare(cython.int, 4)  # start and direction (4) as built
LENGTH = cython.declare(cython.int, 8)
ROUNDING = cython.declare(cython.int, 9)
INNER = cython.declare(cython.int, 10)  # distance that counts inside its polygon
BEFORE = cython.declare(cython.int, 11)  # (2) from its start to the end of its neighbour there, in its own frame; 0: no neighbour
AFTER = cython.declare(cython.int, 13)
RESTITUTION = cython.declare(cython.int, 15)
FRICTION = cython.declare(cython.int, 16)
BELT = cython.declare(cython.int, 17)
CATEGORY = cython.declare(cython.int, 18)  # 32 bits each
MASK = cython.declare(cython.int, 19)
WAY = cython.declare(cython.int, 20)  # (2) unit vector of the direction in which it is passable, in its own frame; 0: none
SENSOR = cython.declare(cython.int, 22)  # 1 + number among the sensors; 0: no sensor
PLACE = cython.declare(cython.int, 23)  # start and direction (4) at the start of the substep
LATE = cython.declare(cython.int, 27)  # start and direction (4) at its end
SPARE = cython.declare(cython.int, 31)  # how far it may move before it is listed again
LISTED = cython.declare(cython.int, 32)  # start and end (4) when it was listed
ROLLS = cython.declare(cython.int, 36)  # coefficient of rolling resistance
MATERIAL = cython.declare(cython.int, 37)  # which of `Step.materials`

SPARE_FRAMES = cython.declare(cython.double, 4.0)
"""Frames for which a moving segment is listed ahead."""


@inlined
def put_segment(w: cython.pointer(Step), k: cython.Py_ssize_t, time: cython.double, to: cython.int) -> cython.void:
    """Write the place of segment k `time` seconds into the frame to columns `to`: PLACE or LATE."""
    at: cython.Py_ssize_t = SEGMENT * k
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
    turned: cython.double = w.body[b + 2] + w.body[b + 5] * time
    c: cython.double = cos(turned)
    s: cython.double = sin(turned)
    lx: cython.double = w.segment[at + LOCAL]
    ly: cython.double = w.segment[at + LOCAL + 1]
    lc: cython.double = w.segment[at + LOCAL + 2]
    ls: cython.double = w.segment[at + LOCAL + 3]
    w.segment[at + to] = w.body[b] + w.body[b + 3] * time + c * lx - s * ly
    w.segment[at + to + 1] = w.body[b + 1] + w.body[b + 4] * time + s * lx + c * ly
    w.segment[at + to + 2] = c * lc - s * ls
    w.segment[at + to + 3] = s * lc + c * ls


@kernel
def place_moving(w: cython.pointer(Step)) -> cython.void:
    """Update moving segments for the start and the end of the substep."""
    now: cython.double = w.substep * cython.cast(cython.double, w.h)
    for n in range(w.moving_count):
        put_segment(w, w.moving[n], now, PLACE)
        put_segment(w, w.moving[n], now + w.h, LATE)


@kernel
def list_segment(w: cython.pointer(Step), k: cython.Py_ssize_t, dt: cython.double) -> cython.bint:
    """List segment k in the cells that it may reach in some frames of dt seconds. False: no room, or cells out of range."""
    at: cython.Py_ssize_t = SEGMENT * k
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
    lx: cython.double = w.segment[at + LOCAL]
    ly: cython.double = w.segment[at + LOCAL + 1]
    speed: cython.double = sqrt(w.body[b + 3] * w.body[b + 3] + w.body[b + 4] * w.body[b + 4])
    speed += fabs(w.body[b + 5]) * (sqrt(lx * lx + ly * ly) + w.segment[at + LENGTH])
    spare: cython.double = SPARE_FRAMES * dt * speed
    far: cython.double = w.segment[at + ROUNDING] + spare
    x: cython.double = w.segment[at + PLACE]
    y: cython.double = w.segment[at + PLACE + 1]
    dx: cython.double = w.segment[at + PLACE + 2] * w.segment[at + LENGTH]
    dy: cython.double = w.segment[at + PLACE + 3] * w.segment[at + LENGTH]
    if w.segment[at + FACES] > 0:
        far += w.segment[at + INNER]
    if not fabs(x) + fabs(y) + w.segment[at + LENGTH] + far < FARTHEST_LISTED * w.cell:
        return False
    used: cython.Py_ssize_t = list_line(k, x, y, dx, dy, far, w.cell, w.head, w.cell_heads, w.link, w.links_capacity, w.links)
    if used < 0:
        return False
    w.links = used
    w.segment[at + SPARE] = spare
    w.segment[at + LISTED], w.segment[at + LISTED + 1] = x, y
    w.segment[at + LISTED + 2], w.segment[at + LISTED + 3] = x + dx, y + dy
    return True


@kernel
def keeps_place(w: cython.pointer(Step), k: cython.Py_ssize_t, dt: cython.double) -> cython.bint:
    """Whether segment k stays within the range for which it is listed until the end of a frame of dt seconds from now."""
    at: cython.Py_ssize_t = SEGMENT * k
    late: cython.int
    far: cython.double = 0.0
    for late in range(2):
        if late == 1:
            put_segment(w, k, dt, LATE)
        to: cython.Py_ssize_t = at + (LATE if late == 1 else PLACE)
        x: cython.double = w.segment[to] - w.segment[at + LISTED]
        y: cython.double = w.segment[to + 1] - w.segment[at + LISTED + 1]
        far = max(far, x * x + y * y)
        x = w.segment[to] + w.segment[to + 2] * w.segment[at + LENGTH] - w.segment[at + LISTED + 2]
        y = w.segment[to + 1] + w.segment[to + 3] * w.segment[at + LENGTH] - w.segment[at + LISTED + 3]
        far = max(far, x * x + y * y)
    return far <= w.segment[at + SPARE] * w.segment[at + SPARE]


@inlined
def reach_about(w: cython.pointer(Step), k: cython.Py_ssize_t) -> cython.double:
    """Distance from its line within which segment k may be touched, m, while its listing is valid."""
    at: cython.Py_ssize_t = SEGMENT * k
    inner: cython.double = w.segment[at + INNER] if w.segment[at + FACES] > 0 else 0.0
    return w.segment[at + ROUNDING] + 2 * w.segment[at + SPARE] + inner


@inlined
def near_segment(
    w: cython.pointer(Step), k: cython.Py_ssize_t, x: cython.double, y: cython.double, reach: cython.double
) -> cython.bint:
    """Whether a point is within reach of segment k while its listing is valid."""
    at: cython.Py_ssize_t = SEGMENT * k
    ox: cython.double = x - w.segment[at + PLACE]
    oy: cython.double = y - w.segment[at + PLACE + 1]
    along: cython.double = w.segment[at + PLACE + 2] * ox + w.segment[at + PLACE + 3] * oy
    across: cython.double = w.segment[at + PLACE + 2] * oy - w.segment[at + PLACE + 3] * ox
    past: cython.double = along - min(max(along, 0.0), w.segment[at + LENGTH])
    far: cython.double = reach + reach_about(w, k)
    return past * past + across * across <= far * far


@inlined
def accepts(w: cython.pointer(Step), i: cython.Py_ssize_t, category: uint32_t, mask: uint32_t) -> cython.bint:
    """Whether particle i and a category and mask each have a bit of their category in the other's mask."""
    if w.lists.filtered:
        return (w.lists.category[i] & mask) != 0 and (w.lists.mask[i] & category) != 0
    return (mask & 1) != 0 and category != 0


@inlined
def accepts_segment(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t) -> cython.bint:
    """`accepts` for segment k, as an obstacle or as a sensor."""
    at: cython.Py_ssize_t = SEGMENT * k
    category: uint32_t = cython.cast(uint32_t, w.segment[at + CATEGORY])
    return accepts(w, i, category, cython.cast(uint32_t, w.segment[at + MASK]))
