# mypy: ignore-errors
"""Segments: the hashed square cells in which they are listed, and the distance of rays to them."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, fabs, floor, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined, kernel

FARTHEST_LISTED = cython.declare(cython.double, 1125899906842624.0)
"""Cells from the origin, 2^50, within which segments can be listed, and points looked up."""

ROUNDED_OFF = cython.declare(cython.double, 1e-12)
"""Relative tolerance for rounding, so that a ray aimed at a joint of two segments hits one of them."""


@inlined
def head_at(column: int64_t, row: int64_t, heads: int64_t) -> int64_t:
    """The head of a cell in a table of 2^k heads: hashed, so that the table need not cover the plane."""
    mixed: int64_t = (column * 73856093) ^ (row * 19349663)
    return (mixed ^ (mixed >> 15)) & (heads - 1)


@kernel
def list_line(
    k: cython.Py_ssize_t, x: cython.double, y: cython.double, dx: cython.double, dy: cython.double, far: cython.double,
    cell: cython.double, head: cython.pointer(int32_t), heads: int64_t, link: cython.pointer(int32_t),
    capacity: cython.Py_ssize_t, used: cython.Py_ssize_t,
) -> cython.Py_ssize_t:  # fmt: skip
    """List segment k, from (x, y) by (dx, dy), in all cells within `far` m; returns the number of links in use, -1: too few."""
    first: int64_t = cython.cast(int64_t, floor((min(y, y + dy) - far) / cell))
    last: int64_t = cython.cast(int64_t, floor((max(y, y + dy) + far) / cell))
    for row in range(first, last + 1):
        s0: cython.double = 0.0  # the part of the segment near the row
        s1: cython.double = 1.0
        if dy != 0.0:
            p: cython.double = (row * cell - far - y) / dy
            q: cython.double = ((row + 1) * cell + far - y) / dy
            s0, s1 = max(min(p, q), 0.0), min(max(p, q), 1.0)
        left: int64_t = cython.cast(int64_t, floor((min(x + s0 * dx, x + s1 * dx) - far) / cell))
        right: int64_t = cython.cast(int64_t, floor((max(x + s0 * dx, x + s1 * dx) + far) / cell))
        for column in range(left, right + 1):
            if used == capacity:
                return -1
            to: int64_t = head_at(column, row, heads)
            link[2 * used], link[2 * used + 1] = cython.cast(int32_t, k), head[to]
            head[to] = cython.cast(int32_t, used)
            used += 1
    return used


@inlined
def way_to_disc(x: cython.double, y: cython.double, dx: cython.double, dy: cython.double, radius: cython.double) -> cython.double:
    """Distance along a ray from (x, y), with a unit vector, to a disc about the origin, m; 0 from inside, infinity for a miss."""
    along: cython.double = -x * dx - y * dy
    across: cython.double = y * dx - x * dy
    left: cython.double = radius * radius - across * across
    if left < 0.0:
        return INFINITY
    if x * x + y * y <= radius * radius:
        return 0.0
    return along - sqrt(left) if along >= 0.0 else INFINITY


@kernel
def way_to_line(
    x: cython.double, y: cython.double, dx: cython.double, dy: cython.double, length: cython.double, radius: cython.double
) -> cython.double:
    """As `way_to_disc`, to all within a radius of the line from the origin to (length, 0)."""
    past: cython.double = x - min(max(x, 0.0), length)
    if past * past + y * y <= radius * radius:
        return 0.0
    end: cython.double = 0.0 if x < 0.0 else length
    if fabs(y) > radius:
        closing: cython.double = -dy if y > 0.0 else dy
        if closing <= 0.0:
            return INFINITY
        way: cython.double = (fabs(y) - radius) / closing
        there: cython.double = x + way * dx
        spare: cython.double = ROUNDED_OFF * (length + fabs(x) + way)
        if -spare <= there and there <= length + spare:
            return way
        end = 0.0 if there < 0.0 else length
    return way_to_disc(x - end, y, dx, dy, radius)
