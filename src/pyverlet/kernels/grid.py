"""Broad phase, first half: particles sorted by square cells, and whether they have come nearer to each other since.

Circles of very different sizes share no good cell, so there are several grids over the same corner, the levels: level 0 has the
largest cells, each other one has cells smaller by a power of 2, and a circle stands in the smallest that its diameter and the
skin fit into. Cells are numbered through all levels, row by row; columns are COLUMNS times as narrow as rows are high, so that the
neighbours of a circle, which stand together in memory along a row, are cut out more closely.

"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet._jit import kernel, parallel_kernel, prange
from pyverlet.constants import BLOCK_ROWS, COLUMNS


class Levels(NamedTuple):
    """The grids, as kernels take them; arrays (levels,).

    Attributes:
        x0, y0: their corner, m.
        largest: largest radius that stands in each, m.
        base: number of its first cell.
        width, height: its columns and rows.
        shift: log2 of how many of its rows make a row of level 0.
        across, along: columns and rows a metre.
    """

    x0: Any
    y0: Any
    largest: Any
    base: Any
    width: Any
    height: Any
    shift: Any
    across: Any
    along: Any


@kernel
def extent(position):
    """(min x, min y, max x, max y) of the particles with finite positions; zeros if there are none."""
    found = False
    x0 = x1 = y0 = y1 = position.dtype.type(0)
    for i in range(position.shape[0]):
        x = position[i, 0]
        y = position[i, 1]
        if np.isfinite(x) and np.isfinite(y):
            x0 = min(x0, x) if found else x
            x1 = max(x1, x) if found else x
            y0 = min(y0, y) if found else y
            y1 = max(y1, y) if found else y
            found = True
    return x0, y0, x1, y1


@kernel
def cell_number(value, cells):
    """floor(value), not below 0 and below `cells`."""
    # Outliers share the rim cells: clamping keeps neighbours neighbours. NaN fails both comparisons and lands in cell 0.
    last = cells - 1
    if value >= last:
        return last
    if value > 0:
        return np.int64(value)
    return np.int64(0)


@kernel
def count_cells(position, x0, y0, per_length, columns, rows, cell, start):
    """Cell of each particle, and for each cell the number of particles in all cells before it (start has one more entry)."""
    start[:] = 0
    for i in range(position.shape[0]):
        column = cell_number((position[i, 0] - x0) * per_length, columns)
        row = cell_number((position[i, 1] - y0) * per_length, rows)
        k = row * columns + column
        cell[i] = k
        start[k + 1] += 1
    for k in range(columns * rows):
        start[k + 1] += start[k]


@kernel
def _level_of(radius, largest):
    level = 0
    while level + 1 < largest.shape[0] and radius <= largest[level + 1]:
        level += 1
    return level


@kernel
def count_levels(radius, largest, held):
    """held[level]: how many circles stand in each, given the `largest` radius that fits each level."""
    held[:] = 0
    for i in range(radius.shape[0]):
        held[_level_of(radius[i], largest)] += 1


@kernel
def count_level_cells(position, radius, levels, cell, start):
    """What `count_cells` does, over all levels."""
    start[:] = 0
    for i in range(position.shape[0]):
        level = _level_of(radius[i], levels.largest)
        column = cell_number((position[i, 0] - levels.x0) * levels.across[level], levels.width[level])
        row = cell_number((position[i, 1] - levels.y0) * levels.along[level], levels.height[level])
        k = levels.base[level] + row * levels.width[level] + column
        cell[i] = k
        start[k + 1] += 1
    for k in range(start.shape[0] - 1):
        start[k + 1] += start[k]


@kernel
def sort_by_cell(cell, start, order):
    """Stable counting sort: order[k] is the particle that belongs into slot k. Returns how often order falls."""
    following = start[:-1].copy()
    for i in range(cell.shape[0]):
        k = cell[i]
        order[following[k]] = i
        following[k] += 1
    falls = 0
    for k in range(1, order.shape[0]):
        falls += order[k] < order[k - 1]
    return falls


@kernel
def before_row(levels, start, level, row):
    """Places, in the order of the cells, of the circles of a level that stand before this row of level 0."""
    return start[levels.base[level] + min(row << levels.shift[level], levels.height[level]) * levels.width[level]]


@kernel
def cut_strips(levels, start, least, strip_row, held):
    """Cut the rows of level 0 into strips of at least `least` particles; returns the number of strips.

    strip_row: first row of each, and behind the last; held: particles in all strips before each, and all of them.
    """
    strips = 0
    strip_row[0] = held[0] = 0
    rows = levels.height[0]
    for row in range(1, rows + 1):
        before = 0
        for level in range(levels.base.shape[0]):
            before += before_row(levels, start, level, row) - start[levels.base[level]]
        if row == rows or (before - held[strips] >= least and strips + 2 < strip_row.shape[0]):
            strips += 1
            strip_row[strips] = row
            held[strips] = before
    return strips


@parallel_kernel
def displacement_boxes(position, built, order, levels, start, low, high):
    """low, high (rows, columns, 2) of blocks of BLOCK_ROWS rows of level 0: the bounds of position - built in each."""
    for row in prange(low.shape[0]):
        low[row] = np.inf
        high[row] = -np.inf
        across = levels.along[0] / position.dtype.type(BLOCK_ROWS)
        for level in range(levels.base.shape[0]):
            first = before_row(levels, start, level, row * BLOCK_ROWS)
            for k in range(first, before_row(levels, start, level, (row + 1) * BLOCK_ROWS)):
                i = order[k]
                column = cell_number((built[i, 0] - levels.x0) * across, low.shape[1])
                dx = position[i, 0] - built[i, 0]
                dy = position[i, 1] - built[i, 1]
                low[row, column, 0] = min(low[row, column, 0], dx)
                low[row, column, 1] = min(low[row, column, 1], dy)
                high[row, column, 0] = max(high[row, column, 0], dx)
                high[row, column, 1] = max(high[row, column, 1], dy)


@kernel
def spreads(low, high):
    """(most that two particles in the same or neighbouring blocks, most that any two have moved against each other), m.

    low, high: of `displacement_boxes`. Neighbours by a corner count; two by two blocks hold any two that are neighbours.
    """
    rows, columns = low.shape[0], low.shape[1]
    zero = low.dtype.type(0)
    near = zero
    x0 = y0 = low.dtype.type(np.inf)
    x1 = y1 = low.dtype.type(-np.inf)
    for row in range(max(rows - 1, 1)):
        above = min(row + 1, rows - 1)
        for column in range(max(columns - 1, 1)):
            right = min(column + 1, columns - 1)
            left_x = min(min(low[row, column, 0], low[row, right, 0]), min(low[above, column, 0], low[above, right, 0]))
            left_y = min(min(low[row, column, 1], low[row, right, 1]), min(low[above, column, 1], low[above, right, 1]))
            right_x = max(max(high[row, column, 0], high[row, right, 0]), max(high[above, column, 0], high[above, right, 0]))
            right_y = max(max(high[row, column, 1], high[row, right, 1]), max(high[above, column, 1], high[above, right, 1]))
            if left_x <= right_x:
                dx, dy = right_x - left_x, right_y - left_y
                near = max(near, dx * dx + dy * dy)
            x0, y0 = min(x0, left_x), min(y0, left_y)
            x1, y1 = max(x1, right_x), max(y1, right_y)
    dx, dy = max(x1 - x0, zero), max(y1 - y0, zero)
    return np.sqrt(near), np.sqrt(dx * dx + dy * dy)
