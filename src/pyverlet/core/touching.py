# mypy: ignore-errors
"""Which pairs of circles overlap, found without a list."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_indices, const_octets, const_reals, indices, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, ceil, floor, isfinite, log2, pow  # noqa: A004
from cython.cimports.libc.stdint import int32_t, int64_t, uint8_t, uint32_t

FINEST = cython.declare(cython.int, -100)
LEVELS = cython.declare(cython.int, 200)
"""Exponents of the smallest cells, whose width is a power of two, m, and how many there are."""

Circles = cython.struct(
    x=cython.pointer[cython.const[real]],
    r=cython.pointer[cython.const[real]],
    fixed=cython.pointer[cython.const[uint8_t]],
    category=cython.pointer[cython.const[uint32_t]],
    mask=cython.pointer[cython.const[uint32_t]],
    head=cython.pointer(int32_t),
    heads=int64_t,
    following=cython.pointer(int32_t),
    level=cython.pointer(int32_t),
    first=cython.pointer(uint32_t),
    second=cython.pointer(uint32_t),
    room=int64_t,
)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def hashed(column: int64_t, row: int64_t, level: int64_t, heads: int64_t) -> int64_t:
    """The head of a cell of a level, in a table of 2^k."""
    mixed: int64_t = (column * 73856093) ^ (row * 19349663) ^ (level * 83492791)
    return (mixed ^ (mixed >> 15)) & (heads - 1)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def cell_of(x: cython.double, per: cython.double) -> int64_t:
    """The column or row of cells that x is in, m; per: cells a metre."""
    return cython.cast(int64_t, floor(x * per))


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def touch_in_cell(
    c: cython.pointer(Circles),
    i: int32_t,
    x: cython.double,
    y: cython.double,
    column: int64_t,
    row: int64_t,
    level: cython.int,
    per: cython.double,
    only_after: cython.bint,
    found: int64_t,
) -> int64_t:
    """Note whom of a cell circle i touches, being at (x, y); only_after: of those of larger index. Returns how many are noted."""
    j: int32_t = c.head[hashed(column, row, level, c.heads)]
    while j >= 0:
        k: int32_t = j
        j = c.following[j]
        if c.level[k] != level or (only_after and k <= i):
            continue
        there_x: cython.double = c.x[2 * k]
        there_y: cython.double = c.x[2 * k + 1]
        dx: cython.double = x - there_x
        dy: cython.double = y - there_y
        reach: cython.double = cython.cast(cython.double, c.r[i]) + cython.cast(cython.double, c.r[k])
        if not dx * dx + dy * dy < reach * reach:
            continue
        if cell_of(there_x, per) != column or cell_of(there_y, per) != row:
            continue  # of another cell with the same hash
        if (c.fixed[i] and c.fixed[k]) or not ((c.category[i] & c.mask[k]) and (c.category[k] & c.mask[i])):
            continue
        if found < c.room:
            c.first[found], c.second[found] = min(i, k), max(i, k)
        found += 1
    return found


def touching(position, radius, fixed, category, mask, shift, work, first, second) -> int:
    """List the pairs whose rims overlap, i < j, but no two that are fixed, or that filters keep apart; returns their number.

    Each circle stands in one cell of the level whose cells are wider than it is. It is compared with those in the nine cells
    around it of each coarser level, and in five of its own: each pair once. shift (s, 2): to the images of a periodic room,
    (0, 0) the first; pairs across it are i before the shift, and j. work: int32 of 2^k >= 2 n numbers, n, and n. More pairs than
    `first` has room for are counted.
    """
    c: Circles
    c.x, c.r, c.fixed = const_reals(position), const_reals(radius), const_octets(fixed)
    c.category, c.mask = const_indices(category), const_indices(mask)
    c.head, c.following, c.level = small_integers(work[0]), small_integers(work[1]), small_integers(work[2])
    c.heads, c.first, c.second, c.room = len(work[0]), indices(first), indices(second), len(first)
    move: cython.pointer[cython.const[cython.double]] = const_doubles(shift)
    images: cython.Py_ssize_t = len(shift)
    count: cython.Py_ssize_t = len(radius)
    with cython.nogil:
        found: int64_t = touching_pairs(cython.address(c), move, images, count)
    return cython.cast(cython.Py_ssize_t, found)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def touching_pairs(
    c: cython.pointer(Circles),
    move: cython.pointer[cython.const[cython.double]],
    images: cython.Py_ssize_t,
    count: cython.Py_ssize_t,
) -> int64_t:
    """The same, of a struct."""
    used: uint8_t[200]
    per: cython.double[200]  # cells a metre of each level
    high: cython.int = -1
    x0: cython.double = INFINITY
    y0: cython.double = INFINITY
    x1: cython.double = -INFINITY
    y1: cython.double = -INFINITY
    widest: cython.double = 0.0
    found: int64_t = 0
    i: int32_t
    level: cython.int
    s: cython.Py_ssize_t
    slot: int64_t
    around: cython.int
    for level in range(LEVELS):
        used[level] = 0
        per[level] = pow(2.0, -(level + FINEST))
    for slot in range(c.heads):
        c.head[slot] = -1
    for i in range(count):
        x: cython.double = c.x[2 * i]
        y: cython.double = c.x[2 * i + 1]
        wide: cython.double = c.r[i]
        level = cython.cast(cython.int, ceil(log2(2.0 * wide))) - FINEST
        level = min(max(level, 0), LEVELS - 1)
        c.level[i] = level
        if not isfinite(x + y):
            c.level[i] = -1
            continue
        used[level] = 1
        high = max(high, level)
        x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
        widest = max(widest, wide)
        slot = hashed(cell_of(x, per[level]), cell_of(y, per[level]), level, c.heads)
        c.following[i] = c.head[slot]
        c.head[slot] = i
    for s in range(images):
        for i in range(count):
            if c.level[i] < 0:
                continue
            x = c.x[2 * i] + move[2 * s]
            y = c.x[2 * i + 1] + move[2 * s + 1]
            far: cython.double = c.r[i] + widest
            if x < x0 - far or x > x1 + far or y < y0 - far or y > y1 + far:
                continue
            for level in range(c.level[i], high + 1):
                if not used[level]:
                    continue
                column: int64_t = cell_of(x, per[level])
                row: int64_t = cell_of(y, per[level])
                own: cython.bint = level == c.level[i]
                half: cython.bint = s == 0 and own
                for around in range(4 if half else 0, 9):
                    only_after: cython.bint = own and (around == 4 or not half)
                    at_x: int64_t = column + around % 3 - 1
                    at_y: int64_t = row + around // 3 - 1
                    found = touch_in_cell(c, i, x, y, at_x, at_y, level, per[level], only_after, found)
    return found
