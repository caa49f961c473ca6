"""Broad phase: which pairs of circles might touch soon.

Particles are sorted by square cells, rows of cells are cut into strips, and each strip lists its candidate pairs: circles in the
same or in neighbouring cells nearer than the sum of their radii plus a skin. Every pair belongs to the strip of its lower
cell, so a strip writes only to its own particles and to the lowest row of the next strip: even strips may be solved in parallel,
then odd ones.

Inside a strip, pairs are ordered by colour: (pair number within its cell, column mod 3, row mod 2). Cells of one colour share no
neighbour, so consecutive pairs share no particle and the processor can overlap them.
"""

from __future__ import annotations

import numpy as np

from pyverlet._jit import kernel, parallel_kernel, prange


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
def _cell_number(value, cells):
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
        column = _cell_number((position[i, 0] - x0) * per_length, columns)
        row = _cell_number((position[i, 1] - y0) * per_length, rows)
        k = row * columns + column
        cell[i] = k
        start[k + 1] += 1
    for k in range(columns * rows):
        start[k + 1] += start[k]


@kernel
def sort_by_cell(cell, start, order):
    """Stable counting sort: order[k] is the particle that belongs into slot k."""
    following = start[:-1].copy()
    for i in range(cell.shape[0]):
        k = cell[i]
        order[following[k]] = i
        following[k] += 1


@kernel
def cut_strips(start, columns, rows, least, strip_row):
    """First row of each strip of at least `least` particles; returns the number of strips."""
    strips = 0
    strip_row[0] = 0
    for row in range(1, rows):
        if start[row * columns] - start[strip_row[strips] * columns] >= least and strips + 2 < strip_row.shape[0]:
            strips += 1
            strip_row[strips] = row
    strip_row[strips + 1] = rows
    return strips + 1


@kernel
def _accept(category, mask, a, b):
    """Whether each of a and b takes the other's category."""
    return (category[a] & mask[b] != 0) & (category[b] & mask[a] != 0)


@kernel
def _list_strip(
    position, radius, inverse_mass, category, mask, start, columns, rows, row0, row1, skin, raw_i, raw_j, colour, room, slots
):  # fmt: skip
    """Candidate pairs of the rows row0 to row1, unsorted, with their colours; returns how many there are, also beyond `room`."""
    zero = skin - skin
    filtered = category.shape[0] > 0
    found = 0
    for row in range(row0, row1):
        for column in range(columns):
            c = row * columns + column
            first, end = start[c], start[c + 1]
            if first == end:
                continue
            # The rest of this cell and the next one stand together, as do the three cells above.
            right = min(column + 1, columns - 1)
            left = max(column - 1, 0)
            row_end = start[row * columns + right + 1]
            above = above_end = 0
            if row + 1 < rows:
                above = start[(row + 1) * columns + left]
                above_end = start[(row + 1) * columns + right + 1]
            cell_colour = (column % 3) * 2 + row % 2
            number = 0
            for a in range(first, end):
                x, y, w = position[a, 0], position[a, 1], inverse_mass[a]
                reach_a = radius[a] + skin
                for part in range(2):
                    low = a + 1 if part == 0 else above
                    high = row_end if part == 0 else above_end
                    for b in range(low, high):
                        dx = position[b, 0] - x
                        dy = position[b, 1] - y
                        reach = reach_a + radius[b]
                        # Written whether or not it counts: an unpredictable branch costs more than the store.
                        if found < room:
                            raw_i[found] = a
                            raw_j[found] = b
                            colour[found] = min(number, slots - 1) * 6 + cell_colour
                        near = (dx * dx + dy * dy < reach * reach) & (w + inverse_mass[b] > zero)
                        if filtered:
                            near &= _accept(category, mask, a, b)
                        found += near
                        number += near
    return found


@kernel
def _sort_by_colour(raw_i, raw_j, colour, found, colours, pair_i, pair_j):
    begin = np.zeros(colours + 1, np.int64)
    for p in range(found):
        begin[colour[p] + 1] += 1
    for k in range(colours):
        begin[k + 1] += begin[k]
    for p in range(found):
        k = colour[p]
        pair_i[begin[k]] = raw_i[p]
        pair_j[begin[k]] = raw_j[p]
        begin[k] += 1


@parallel_kernel
def list_pairs(
    position, radius, inverse_mass, category, mask, start, columns, rows, strip_row, skin, room, slots,
    raw_i, raw_j, colour, pair_i, pair_j, first, count,
):  # fmt: skip
    """Fill the pair list of every strip: pair_i, pair_j[first[s] : first[s] + count[s]].

    `room` pairs are kept free for each particle. A strip that needs more reports its full count and lists nothing:
    the caller makes room and calls again, so that no pair is ever dropped. Empty `category` and `mask`: everyone collides.
    """
    for s in prange(strip_row.shape[0] - 1):
        low = start[strip_row[s] * columns]
        high = start[strip_row[s + 1] * columns]
        a, b = low * room, high * room
        found = _list_strip(
            position, radius, inverse_mass, category, mask, start, columns, rows, strip_row[s], strip_row[s + 1], skin,
            raw_i[a:b], raw_j[a:b], colour[a:b], b - a, slots,
        )  # fmt: skip
        first[s] = a
        count[s] = found
        if found <= b - a:
            _sort_by_colour(raw_i[a:b], raw_j[a:b], colour[a:b], found, 6 * slots, pair_i[a:b], pair_j[a:b])


@kernel
def list_all_pairs(position, radius, inverse_mass, category, mask, pair_i, pair_j):
    """The readable reference, O(n^2): every overlapping pair, in natural order. Returns how many, also beyond the room."""
    found = 0
    for i in range(position.shape[0]):
        for j in range(i + 1, position.shape[0]):
            dx = position[j, 0] - position[i, 0]
            dy = position[j, 1] - position[i, 1]
            reach = radius[i] + radius[j]
            wanted = category.shape[0] == 0 or _accept(category, mask, i, j)
            if wanted and dx * dx + dy * dy < reach * reach and inverse_mass[i] + inverse_mass[j] > 0:
                if found < pair_i.shape[0]:
                    pair_i[found] = i
                    pair_j[found] = j
                found += 1
    return found
