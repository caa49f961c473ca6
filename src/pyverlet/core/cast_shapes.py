# mypy: ignore-errors
"""How far a circle, or as one of radius 0 a ray, gets until it touches a disc, a rounded segment or a wall, and the normal there.

A circle of radius R touches a thing when its centre is on the thing grown by R: all distances are those of a ray to grown things.
"""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, fabs, sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.obstacle_queries import COSINE, LENGTH, PLACED, ROUNDING, SINE, X, Y, face_within
from pyverlet.core.segments import ROUNDED_OFF, way_to_line

CAGE = cython.declare(cython.int, 4)
"""Number of the side after those of a box, as the walls are tried; a cage has this one alone."""

Ray = cython.struct(
    x=cython.double, y=cython.double, dx=cython.double, dy=cython.double,  # origin and unit direction of the centre
    per_x=cython.double, per_y=cython.double,  # 1 / dx and 1 / dy, infinite for 0
    size=cython.double,  # radius R of the circle
    best=cython.double,  # how far it gets at most, as far as is known
    kind=cython.int, index=int64_t, segment=cython.Py_ssize_t,  # what stops it there
)  # fmt: skip
Normal = cython.struct(x=cython.double, y=cython.double)


@kernel
def to_segment(s: cython.pointer[cython.const[cython.double]], k: cython.Py_ssize_t, r: cython.pointer(Ray)) -> cython.double:
    """Distance along a ray to segment k, m; 0 from inside of it or of its polygon, infinity for a miss."""
    at: cython.Py_ssize_t = PLACED * k
    c: cython.double = s[at + COSINE]
    d: cython.double = s[at + SINE]
    x: cython.double = c * (r.x - s[at + X]) + d * (r.y - s[at + Y])  # along the segment, from its start
    y: cython.double = c * (r.y - s[at + Y]) - d * (r.x - s[at + X])  # to its left
    if y > 0.0 and face_within(s, k, r.x, r.y) >= 0:
        return 0.0
    return way_to_line(x, y, c * r.dx + d * r.dy, c * r.dy - d * r.dx, s[at + LENGTH], s[at + ROUNDING] + r.size)


@inlined
def normal_to(x: cython.double, y: cython.double, r: cython.pointer(Ray)) -> Normal:
    """The unit normal along (x, y); where that is 0, as in the centre of a disc, every way out is as good: against the ray."""
    n: Normal
    far: cython.double = sqrt(x * x + y * y)
    n.x = x / far if far > 0.0 else -r.dx
    n.y = y / far if far > 0.0 else -r.dy
    return n


@kernel
def normal_of_segment(s: cython.pointer[cython.const[cython.double]], k: cython.Py_ssize_t, r: cython.pointer(Ray)) -> Normal:
    """Out of segment k where the ray touches it, after `r.best` m; out of the nearest face from inside of its polygon."""
    x: cython.double = r.x + r.best * r.dx
    y: cython.double = r.y + r.best * r.dy
    face: cython.Py_ssize_t = face_within(s, k, x, y) if r.best == 0.0 else -1
    at: cython.Py_ssize_t = PLACED * (face if face >= 0 else k)
    c: cython.double = s[at + COSINE]
    d: cython.double = s[at + SINE]
    u: cython.double = c * (x - s[at + X]) + d * (y - s[at + Y])
    # Of a thin line only the origin says on which side the ray comes; from on it, it is the side it leaves behind.
    v: cython.double = c * (r.y - s[at + Y]) - d * (r.x - s[at + X])
    spare: cython.double = ROUNDED_OFF * (s[at + LENGTH] + fabs(u) + r.best)
    if face >= 0 or (s[at + LENGTH] > 0.0 and -spare <= u and u <= s[at + LENGTH] + spare and v != 0.0):
        side: cython.double = -1.0 if face >= 0 or v < 0.0 else 1.0
        return normal_to(-side * d, side * c, r)
    end: cython.double = min(max(u, 0.0), s[at + LENGTH])
    return normal_to(x - s[at + X] - end * c, y - s[at + Y] - end * d, r)


@kernel
def to_wall(w: cython.pointer[cython.const[cython.double]], k: cython.int, r: cython.pointer(Ray)) -> cython.double:
    """Distance along a ray to a side of the room, m; 0 from beyond it. w: corners of a box, or centre and radius of a cage.

    Sides of a box are the left, the right, the floor and the ceiling; those that are not there are infinitely far away.
    """
    if k < CAGE:
        into: cython.double = 1.0 if k % 2 == 0 else -1.0
        gap: cython.double = into * ((r.x if k < 2 else r.y) - w[2 * (k % 2) + k // 2]) - r.size
        closing: cython.double = -into * (r.dx if k < 2 else r.dy)
        if gap <= 0.0:
            return 0.0
        return gap / closing if closing > 0.0 and gap < INFINITY else INFINITY
    ox: cython.double = r.x - w[0]
    oy: cython.double = r.y - w[1]
    room: cython.double = w[2] - r.size
    left: cython.double = room * room - ox * ox - oy * oy
    if room <= 0.0 or left <= 0.0:
        return 0.0
    away: cython.double = ox * r.dx + oy * r.dy
    root: cython.double = sqrt(away * away + left)
    return left / (away + root) if away > 0.0 else root - away  # without a difference of two that are almost equal


@kernel
def normal_of_wall(w: cython.pointer[cython.const[cython.double]], k: cython.int, r: cython.pointer(Ray)) -> Normal:
    """Into the room, from a side that `to_wall` numbers."""
    if k == CAGE:
        return normal_to(w[0] - r.x - r.best * r.dx, w[1] - r.y - r.best * r.dy, r)
    side: cython.double = 1.0 if k % 2 == 0 else -1.0
    return normal_to(side if k < 2 else 0.0, 0.0 if k < 2 else side, r)


@inlined
def to_edge(p: cython.double, d: cython.double, low: cython.double, period: cython.double) -> cython.double:
    """How far a ray goes from p before it leaves a periodic room along one axis, m; infinity if it does not."""
    if period == 0.0 or d == 0.0:
        return INFINITY
    return max(((low + period if d > 0.0 else low) - p) / d, 0.0)


@inlined
def comes_in(p: cython.double, d: cython.double, low: cython.double, period: cython.double) -> cython.double:
    """A coordinate, or the same at the side where d leads into a periodic room if it is at the rim where d leads out of it."""
    if period > 0.0 and d > 0.0 and fabs(p - (low + period)) <= ROUNDED_OFF * period:
        return low
    return low + period if period > 0.0 and d < 0.0 and fabs(p - low) <= ROUNDED_OFF * period else p
