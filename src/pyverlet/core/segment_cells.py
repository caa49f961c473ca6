# mypy: ignore-errors
"""Segments listed in square cells, which are hashed: in all that they come near to."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import floor
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined, kernel


@inlined
def head_at(column: int64_t, row: int64_t, heads: int64_t) -> int64_t:
    """The head of a cell in a table of 2^k of them: a hash, so that the table need not cover the plane."""
    mixed: int64_t = (column * 73856093) ^ (row * 19349663)
    return (mixed ^ (mixed >> 15)) & (heads - 1)


@kernel
def list_line(
    k: cython.Py_ssize_t, x: cython.double, y: cython.double, dx: cython.double, dy: cython.double, far: cython.double,
    cell: cython.double, head: cython.pointer(int32_t), heads: int64_t, link: cython.pointer(int32_t), room: cython.Py_ssize_t,
    used: cython.Py_ssize_t,
) -> cython.Py_ssize_t:  # fmt: skip
    """List segment k, from (x, y) on by (dx, dy), in all cells within `far` m; how many links are used now, -1: too few."""
    first: int64_t = cython.cast(int64_t, floor((min(y, y + dy) - far) / cell))
    last: int64_t = cython.cast(int64_t, floor((max(y, y + dy) + far) / cell))
    for row in range(first, last + 1):
        s0: cython.double = 0.0  # the part of the segment that is near the row
        s1: cython.double = 1.0
        if dy != 0.0:
            p: cython.double = (row * cell - far - y) / dy
            q: cython.double = ((row + 1) * cell + far - y) / dy
            s0, s1 = max(min(p, q), 0.0), min(max(p, q), 1.0)
        left: int64_t = cython.cast(int64_t, floor((min(x + s0 * dx, x + s1 * dx) - far) / cell))
        right: int64_t = cython.cast(int64_t, floor((max(x + s0 * dx, x + s1 * dx) + far) / cell))
        for column in range(left, right + 1):
            if used == room:
                return -1
            to: int64_t = head_at(column, row, heads)
            link[2 * used], link[2 * used + 1] = cython.cast(int32_t, k), head[to]
            head[to] = cython.cast(int32_t, used)
            used += 1
    return used
