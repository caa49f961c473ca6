# mypy: ignore-errors
"""Fits the grids to the particles: their extent and the number of levels."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, floor, isfinite, sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.cells import BLOCK, COLUMNS, LEVELS, Cells, level_of, reach_of
from pyverlet.core.kernels import kernel

CELLS_PER_PARTICLE = cython.declare(cython.int, 4)
ROUNDED_UP = cython.declare(cython.double, 1.001)
"""Cells are larger than the longest distance of a listed pair by this factor, so that rounding cannot skip a row."""

SPREAD = cython.declare(cython.double, 4.0)
"""Half width of the grid about the mean, in standard deviations, if few particles would stretch it; they use rim cells."""

LONGER = cython.declare(cython.double, 4.0)
"""Rows follow each other along x if the world is so many times as long as it is high."""

Extent = cython.struct(x0=cython.double, y0=cython.double, x1=cython.double, y1=cython.double)
Range = cython.struct(low=cython.double, high=cython.double)


@kernel
def measure_extent(c: cython.pointer(Cells), block: cython.Py_ssize_t) -> cython.void:
    """Bounds x0, y0, x1, y1 of the finite positions in a block."""
    i: cython.Py_ssize_t
    x0: real = INFINITY
    y0: real = INFINITY
    x1: real = -INFINITY
    y1: real = -INFINITY
    for i in range(block * BLOCK, min((block + 1) * BLOCK, c.count)):
        x: real = c.position[2 * i]
        y: real = c.position[2 * i + 1]
        if isfinite(x) and isfinite(y):
            x0 = x if x < x0 else x0
            x1 = x if x > x1 else x1
            y0 = y if y < y0 else y0
            y1 = y if y > y1 else y1
    c.extent[4 * block], c.extent[4 * block + 1] = x0, y0
    c.extent[4 * block + 2], c.extent[4 * block + 3] = x1, y1


@kernel
def near_the_mean(c: cython.pointer(Cells), axis: cython.int, low: cython.double, high: cython.double) -> Range:
    """The range from `low` to `high`, limited to SPREAD standard deviations about the mean."""
    found: Range
    total: cython.double = 0
    squares: cython.double = 0
    number: cython.double = 0
    i: cython.Py_ssize_t
    middle: cython.double = 0.5 * (low + high)
    for i in range(c.count):
        x: cython.double = c.position[2 * i + axis]
        if isfinite(x):
            total += x - middle
            squares += (x - middle) * (x - middle)
            number += 1
    mean: cython.double = total / number
    spread: cython.double = SPREAD * sqrt(max(squares / number - mean * mean, 0.0))
    found.low = max(low, middle + mean - spread) if isfinite(spread) else low
    found.high = min(high, middle + mean + spread) if isfinite(spread) else high
    return found


@kernel
def lay_rows(c: cython.pointer(Cells), long_u: cython.double, long_v: cython.double, cell: cython.double) -> cython.double:
    """Lay out the first grid over these lengths, m; returns its number of cells, counting rows of one cell twice.

    This bounds the number of patches (see `list_age`) by the number of particles plus a constant.
    """
    columns: cython.double
    rows: cython.double
    if c.wraps_u:
        columns = max(floor(long_u / cell * COLUMNS), 1.0)
        c.across[0] = cython.cast(real, columns / long_u)
    else:
        columns = (floor(long_u / cell) + 1) * COLUMNS
        c.across[0] = cython.cast(real, COLUMNS / cell)
    if c.wraps_v:
        rows = max(floor(long_v / cell), 1.0)
        c.along[0] = cython.cast(real, rows / long_v)
    else:
        rows = floor(long_v / cell) + 1
        c.along[0] = cython.cast(real, 1.0 / cell)
    if columns * rows < 1e15:
        c.width[0], c.height[0] = cython.cast(int64_t, columns), cython.cast(int64_t, rows)
    return max(columns, 2) * rows


@kernel
def add_levels(c: cython.pointer(Cells), cell: cython.double, most: cython.double) -> cython.void:
    """Add finer grids where they help: one that would hold fewer circles than the one above is left out."""
    level: cython.int
    kept: cython.int = 1
    tried: cython.int = 1
    total: cython.double = cython.cast(cython.double, c.width[0]) * c.height[0]
    c.shift[0], c.base[0], c.largest[0] = 0, 0, c.widest
    c.total = c.width[0] * c.height[0]
    while tried < LEVELS:
        fits: cython.double = (cell / (1 << tried) / ROUNDED_UP - c.skin) / 2
        total += cython.cast(cython.double, c.total) * (1 << (2 * tried))
        if not c.smallest <= fits or total > most:
            break
        c.largest[tried] = cython.cast(real, fits)
        tried += 1
    c.levels = tried
    if tried > 1:
        for level in range(tried):
            c.held[level] = 0
        i: cython.Py_ssize_t
        for i in range(c.count):
            reach: real = reach_of(c, i)
            if c.radius[i] <= c.bulk and reach <= c.widest:
                c.held[level_of(c, reach)] += 1
        for level in range(1, tried):
            adjacent: cython.bint = c.shift[kept - 1] == level - 1
            if c.held[level] > 0 and not (adjacent and c.held[level] < c.held[level - 1]):
                c.shift[kept], c.largest[kept] = level, c.largest[level]
                kept += 1
    c.levels = kept
    for level in range(1, kept):
        s: int64_t = c.shift[level]
        c.base[level] = c.total
        c.width[level], c.height[level] = c.width[0] << s, c.height[0] << s
        c.across[level] = c.across[0] * (1 << s)
        c.along[level] = c.along[0] * (1 << s)
        c.total += c.width[level] * c.height[level]


@kernel
def whole_extent(c: cython.pointer(Cells), blocks: cython.Py_ssize_t) -> Extent:
    """Bounds of all blocks; zeros if there is no finite position."""
    e: Extent
    e.x0, e.y0, e.x1, e.y1 = INFINITY, INFINITY, -INFINITY, -INFINITY
    b: cython.Py_ssize_t
    for b in range(blocks):
        e.x0, e.y0 = min(e.x0, c.extent[4 * b]), min(e.y0, c.extent[4 * b + 1])
        e.x1, e.y1 = max(e.x1, c.extent[4 * b + 2]), max(e.y1, c.extent[4 * b + 3])
    if not e.x0 <= e.x1:
        e.x0 = e.y0 = e.x1 = e.y1 = 0
    return e


@kernel
def level_steps(c: cython.pointer(Cells)) -> int64_t:
    """Bit set of the finer grids in use."""
    level: cython.int
    steps: int64_t = 0
    for level in range(c.levels):
        steps |= cython.cast(int64_t, 1) << c.shift[level]
    return steps


@kernel
def fit_cells(c: cython.pointer(Cells), blocks: cython.Py_ssize_t) -> cython.bint:
    """Fit grids to all particles; to the bulk of them if a few are so far away that there would be too many cells.

    Returns whether the grids are unchanged except for the number of rows.
    """
    swapped: cython.int = c.swapped
    u0: real = c.u0
    v0: real = c.v0
    across: real = c.across[0]
    along: real = c.along[0]
    width: int64_t = c.width[0]
    largest: real = c.largest[0]
    steps: int64_t = level_steps(c)
    e: Extent = whole_extent(c, blocks)
    x0: cython.double = e.x0
    y0: cython.double = e.y0
    x1: cython.double = e.x1
    y1: cython.double = e.y1
    most: cython.double = CELLS_PER_PARTICLE * cython.cast(cython.double, c.count) + 64
    cell: cython.double = (2.0 * c.widest + c.skin) * ROUNDED_UP
    if (floor((x1 - x0) / cell) + 1) * (floor((y1 - y0) / cell) + 1) * COLUMNS > most:
        x: Range = near_the_mean(c, 0, x0, x1)
        y: Range = near_the_mean(c, 1, y0, y1)
        x0, x1, y0, y1 = x.low, x.high, y.low, y.high
    if c.period_x > 0:
        x0, x1 = c.low_x, c.low_x + c.period_x
    if c.period_y > 0:
        y0, y1 = c.low_y, c.low_y + c.period_y
    c.swapped = 1 if x1 - x0 > LONGER * (y1 - y0) else 0
    if c.swapped:
        x0, y0, x1, y1 = y0, x0, y1, x1
    c.u0, c.v0 = cython.cast(real, x0), cython.cast(real, y0)
    c.period_u = cython.cast(real, c.period_y if c.swapped else c.period_x)
    c.period_v = cython.cast(real, c.period_x if c.swapped else c.period_y)
    c.wraps_u, c.wraps_v = c.period_u > 0, c.period_v > 0
    while lay_rows(c, x1 - x0, y1 - y0, cell) > most:
        cell *= 1.5
    add_levels(c, cell, most)
    same: cython.bint = c.swapped == swapped and c.u0 == u0 and c.v0 == v0 and c.width[0] == width
    return same and level_steps(c) == steps and c.largest[0] == largest and c.across[0] == across and c.along[0] == along
