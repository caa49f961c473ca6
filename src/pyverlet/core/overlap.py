# mypy: ignore-errors
"""Which pairs of particles overlap, and how far. A period is that of a room, m; 0 for none."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_indices, const_integers, const_octets, const_reals, integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, ceil, floor, isfinite, ldexp, log2, sqrt
from cython.cimports.libc.stdint import int64_t, uint8_t, uint32_t, uint64_t

from pyverlet.core.kernels import inlined
from pyverlet.core.periodic import nearest_in_double

FINEST_CELL = cython.declare(int64_t, -100)
CELL_LEVELS = cython.declare(int64_t, 200)
"""Exponents of the smallest cells of `touching`, whose width is a power of two, m, and how many there are."""


def overlaps(position, radius, period_x: cython.double, period_y: cython.double, pairs):
    """(number, sum and maximum of depth / (r_i + r_j)) of the pairs (k, 2) that touch, in float64."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    pair: cython.pointer[cython.const[int64_t]] = const_integers(pairs)
    count: int64_t = len(pairs)
    number: int64_t = 0
    total: cython.double = 0.0
    largest: cython.double = 0.0
    for k in range(count):
        i: int64_t = pair[2 * k]
        j: int64_t = pair[2 * k + 1]
        dx: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * j]) - x[2 * i], period_x)
        dy: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * j + 1]) - x[2 * i + 1], period_y)
        depth: cython.double = 1.0 - sqrt(dx * dx + dy * dy) / (cython.cast(cython.double, r[i]) + r[j])
        if depth > 0.0:
            number += 1
            total += depth
            largest = max(largest, depth)
    return number, total, largest


@inlined
def place_of(column: int64_t, row: int64_t, level: int64_t, size: int64_t) -> int64_t:
    """Where the list of a cell begins in a table of `size`, a power of two."""
    mixed: uint64_t = cython.cast(uint64_t, column) * 73856093
    mixed ^= cython.cast(uint64_t, row) * 19349663
    mixed ^= cython.cast(uint64_t, level) * 83492791
    return cython.cast(int64_t, (mixed ^ (mixed >> 15)) & cython.cast(uint64_t, size - 1))


@inlined
def cell_along(x: cython.double, level: int64_t) -> int64_t:
    """The cell along one axis, of those of a level."""
    return cython.cast(int64_t, floor(ldexp(x, cython.cast(cython.int, -(level + FINEST_CELL)))))


def touching(position, radius, fixed, category, mask, shift, level, heads, following, pairs):
    """Write the pairs whose rims overlap, i < j, but no two that are fixed, or that filters keep apart; returns their number.

    Each circle stands in one cell of the level whose cells are wider than it is. It is compared with those in the nine cells
    around it of each coarser level, and in five of its own: each pair once. shift (s, 2): to the images of a periodic room,
    (0, 0) the first; pairs across it are i before the shift, and j. level (n,), heads (2^k >= 2 n,), following (n,): room to work
    in. More pairs than `pairs` (k, 2) has room for are counted.
    """
    p: cython.pointer[cython.const[real]] = const_reals(position)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    is_fixed: cython.pointer[cython.const[uint8_t]] = const_octets(fixed)
    kind: cython.pointer[cython.const[uint32_t]] = const_indices(category)
    sees: cython.pointer[cython.const[uint32_t]] = const_indices(mask)
    image: cython.pointer[cython.const[cython.double]] = const_doubles(shift)
    own: cython.pointer[int64_t] = integers(level)
    head: cython.pointer[int64_t] = integers(heads)
    next_in: cython.pointer[int64_t] = integers(following)
    out: cython.pointer[int64_t] = integers(pairs)
    count: int64_t = len(radius)
    size: int64_t = len(heads)
    images: int64_t = len(shift)
    room: int64_t = len(pairs)
    used: cython.bint[200]  # CELL_LEVELS
    found: int64_t = 0
    highest: int64_t = -1
    widest: cython.double = 0.0
    x0: cython.double = INFINITY
    y0: cython.double = INFINITY
    x1: cython.double = -INFINITY
    y1: cython.double = -INFINITY
    i: int64_t
    around: int64_t
    with cython.nogil:
        for i in range(CELL_LEVELS):
            used[i] = False
        for i in range(size):
            head[i] = -1
        for i in range(count):
            x: cython.double = p[2 * i]
            y: cython.double = p[2 * i + 1]
            if not isfinite(x + y):
                own[i] = -1
                continue
            own[i] = cython.cast(int64_t, ceil(log2(2.0 * cython.cast(cython.double, r[i])))) - FINEST_CELL
            own[i] = min(max(own[i], 0), CELL_LEVELS - 1)
            used[own[i]] = True
            highest = max(highest, own[i])
            x0 = min(x0, x)
            y0 = min(y0, y)
            x1 = max(x1, x)
            y1 = max(y1, y)
            widest = max(widest, cython.cast(cython.double, r[i]))
            slot: int64_t = place_of(cell_along(x, own[i]), cell_along(y, own[i]), own[i], size)
            next_in[i] = head[slot]
            head[slot] = i
        for s in range(images):
            for i in range(count):
                if own[i] < 0:
                    continue
                x = p[2 * i] + image[2 * s]
                y = p[2 * i + 1] + image[2 * s + 1]
                far: cython.double = r[i] + widest
                if x < x0 - far or x > x1 + far or y < y0 - far or y > y1 + far:
                    continue
                for at_level in range(own[i], highest + 1):
                    if not used[at_level]:
                        continue
                    half: cython.bint = s == 0 and at_level == own[i]
                    for around in range(4 if half else 0, 9):
                        c: int64_t = cell_along(x, at_level) + around % 3 - 1
                        row: int64_t = cell_along(y, at_level) + around // 3 - 1
                        j: int64_t = head[place_of(c, row, at_level, size)]
                        while j >= 0:
                            there: int64_t = j
                            j = next_in[j]
                            if own[there] != at_level or (there <= i and at_level == own[i] and (around == 4 or not half)):
                                continue
                            dx: cython.double = x - p[2 * there]
                            dy: cython.double = y - p[2 * there + 1]
                            reach: cython.double = cython.cast(cython.double, r[i]) + r[there]
                            if not dx * dx + dy * dy < reach * reach:
                                continue
                            if cell_along(p[2 * there], at_level) != c or cell_along(p[2 * there + 1], at_level) != row:
                                continue  # of another cell with the same place in the table
                            if (is_fixed[i] and is_fixed[there]) or not (kind[i] & sees[there] and kind[there] & sees[i]):
                                continue
                            if found < room:
                                out[2 * found] = min(i, there)
                                out[2 * found + 1] = max(i, there)
                            found += 1
    return found
