"""Broad phase, first half: particles sorted by square cells, and whether they have come nearer to each other since.

Circles of very different sizes share no good cell, so there are several grids over the same corner, the levels: level 0 has the
largest cells, each other one has cells smaller by a power of 2, and a circle stands in the smallest that its diameter and the
skin fit into. Cells are numbered through all levels, row by row; columns are COLUMNS times as narrow as rows are high, so that
the neighbours of a circle, which stand together in memory along a row, are cut out more closely.

"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.ground.constants import BLOCK_ROWS, COLUMNS


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
    """Cell of each particle; start[k + 1]: the number of particles in all cells before cell k, as `sort_by_cell` takes it."""
    start[:] = 0
    for i in range(position.shape[0]):
        column = cell_number((position[i, 0] - x0) * per_length, columns)
        row = cell_number((position[i, 1] - y0) * per_length, rows)
        k = row * columns + column
        cell[i] = k
        start[k + 2] += 1
    for k in range(columns * rows):
        start[k + 2] += start[k + 1]


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
        start[k + 2] += 1
    for k in range(1, start.shape[0] - 1):
        start[k + 1] += start[k]


@kernel
def sort_by_cell(cell, start, order):
    """Stable counting sort: order[k] is the particle that belongs into slot k. Returns how often order falls.

    start: (cells + 2,). start[k + 1] is where the next particle of cell k goes, in the end behind the last; so that in the end
    start[k] is the number of particles in all cells before cell k, and start[cells] of all.
    """
    for i in range(cell.shape[0]):
        following = cell[i] + 1
        order[start[following]] = i
        start[following] += 1
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


@kernel
def _cover(boxes, to, of, source):
    """Let box `to` of `boxes` cover box `source` of `of`, too."""
    boxes[to, 0] = min(boxes[to, 0], of[source, 0])
    boxes[to, 1] = min(boxes[to, 1], of[source, 1])
    boxes[to, 2] = max(boxes[to, 2], of[source, 2])
    boxes[to, 3] = max(boxes[to, 3], of[source, 3])


@kernel
def blocks(levels, level):
    """(columns, rows) of blocks of a level: squares of BLOCK_ROWS by BLOCK_ROWS rows."""
    wide = BLOCK_ROWS * COLUMNS
    return (levels.width[level] + wide - 1) // wide, (levels.height[level] + BLOCK_ROWS - 1) // BLOCK_ROWS


@kernel
def _bound_row(position, built, order, levels, start, level, row, first, own):
    """Boxes of a row of blocks whose first box is `first`: around position - built of the circles of the level itself."""
    columns, _ = blocks(levels, level)
    wide = levels.width[level]
    for line in range(row * BLOCK_ROWS, min((row + 1) * BLOCK_ROWS, levels.height[level])):
        k = levels.base[level] + line * wide
        for column in range(columns):
            low = start[k + column * BLOCK_ROWS * COLUMNS]
            end = start[k + min((column + 1) * BLOCK_ROWS * COLUMNS, wide)]
            if low == end:
                continue
            b = first + column
            x0, y0, x1, y1 = own[b, 0], own[b, 1], own[b, 2], own[b, 3]
            for place in range(low, end):
                i = order[place]
                dx = position[i, 0] - built[i, 0]
                dy = position[i, 1] - built[i, 1]
                x0, y0, x1, y1 = min(x0, dx), min(y0, dy), max(x1, dx), max(y1, dy)
            own[b, 0], own[b, 1], own[b, 2], own[b, 3] = x0, y0, x1, y1


@kernel
def _bound_rows(position, built, order, levels, start, first, own, smaller, top):
    """What `bound_displacements` does, for the row `top` of blocks of level 0 and what lies in it."""
    inf = own.dtype.type(np.inf)
    for back in range(levels.base.shape[0]):
        level = levels.base.shape[0] - 1 - back
        columns, rows = blocks(levels, level)
        shift = levels.shift[level]
        for row in range(top << shift, min((top + 1) << shift, rows)):
            here = first[level] + row * columns
            for b in range(here, here + columns):
                own[b, 0] = own[b, 1] = smaller[b, 0] = smaller[b, 1] = inf
                own[b, 2] = own[b, 3] = smaller[b, 2] = smaller[b, 3] = -inf
            _bound_row(position, built, order, levels, start, level, row, here, own)
            for b in range(here, here + columns):
                _cover(smaller, b, own, b)
        if back > 0:
            below, rows_below = blocks(levels, level + 1)
            step = levels.shift[level + 1] - shift
            for row in range(top << levels.shift[level + 1], min((top + 1) << levels.shift[level + 1], rows_below)):
                for column in range(below):
                    to = first[level] + (row >> step) * columns + (column >> step)
                    _cover(smaller, to, smaller, first[level + 1] + row * below + column)


@parallel_kernel
def bound_displacements(position, built, order, levels, start, first, own, smaller):
    """For each block of each level the box (x0, y0, x1, y1) of position - built of its circles, metres.

    first[level]: number of the level's first block. own (blocks, 4): of the circles that stand in the level; smaller: also of
    those in levels with smaller cells.
    """
    for top in prange((levels.height[0] + BLOCK_ROWS - 1) // BLOCK_ROWS):
        _bound_rows(position, built, order, levels, start, first, own, smaller, np.int64(top))


@kernel
def _around(boxes, first, columns, rows, row, column):
    """The box around the boxes of two by two blocks."""
    right, above = min(column + 1, columns - 1), min(row + 1, rows - 1)
    a, b = first + row * columns + column, first + row * columns + right
    c, d = first + above * columns + column, first + above * columns + right
    return (
        min(min(boxes[a, 0], boxes[b, 0]), min(boxes[c, 0], boxes[d, 0])),
        min(min(boxes[a, 1], boxes[b, 1]), min(boxes[c, 1], boxes[d, 1])),
        max(max(boxes[a, 2], boxes[b, 2]), max(boxes[c, 2], boxes[d, 2])),
        max(max(boxes[a, 3], boxes[b, 3]), max(boxes[c, 3], boxes[d, 3])),
    )


@kernel
def spreads(levels, first, own, smaller):
    """(most that two circles in the same or neighbouring blocks, most that any two have moved against each other), m.

    Blocks are those of the level of the larger circle; neighbours by a corner count. Any two blocks that are neighbours are among
    some two by two.
    """
    zero = own.dtype.type(0)
    near = zero
    x0 = y0 = own.dtype.type(np.inf)
    x1 = y1 = own.dtype.type(-np.inf)
    for level in range(levels.base.shape[0]):
        columns, rows = blocks(levels, level)
        for row in range(rows):
            for column in range(columns):
                a0, b0, a1, b1 = _around(own, first[level], columns, rows, row, column)
                if not a0 <= a1:
                    continue
                c0, d0, c1, d1 = _around(smaller, first[level], columns, rows, row, column)
                dx, dy = max(a1 - c0, c1 - a0), max(b1 - d0, d1 - b0)
                near = max(near, dx * dx + dy * dy)
                x0, y0, x1, y1 = min(x0, c0), min(y0, d0), max(x1, c1), max(y1, d1)
    dx, dy = max(x1 - x0, zero), max(y1 - y0, zero)
    return np.sqrt(near), np.sqrt(dx * dx + dy * dy)
