"""Broad phase, second half: which pairs of circles might touch soon.

Rows of level 0 of the grids are cut into strips, and each strip lists its candidate pairs: circles nearer than the sum of their
radii plus a skin. Every pair belongs to the strip of the circle in the lower row of level 0, so a strip writes only to its own
particles and to the lowest row of the next strip: even strips may be solved in parallel, then odd ones.

Inside a strip those come last that are close enough to touch soon: the solver makes short work of the others where they stand
together, and those that touch already pass on the impact of one that arrives, in the same substep. Both kinds are ordered by
colour: no two pairs of a colour share a particle, so that the processor can overlap them. A circle with more pairs than there
are colours has them spread over all colours.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.bits import count_bits, lowest_bit, write_all, write_chosen
from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import LANES, load, spread, which_above
from pyverlet.ground.constants import CLOSE, COLOURS, COLUMNS, ROUNDING
from pyverlet.kernels.grid import before_row, cell_number
from pyverlet.kernels.seam import nearest

_ALL = (1 << COLOURS) - 1

_APART = 1 << 31
"""Set in the second place of a pair that is not close."""

_PLACE = np.uint32(_APART - 1)


@kernel
def _accept(category, mask, inverse_mass, a, b):
    """Whether one of a and b is free, and each takes the other's category."""
    free = (inverse_mass[a] > 0) | (inverse_mass[b] > 0)
    if category.shape[0] == 0:
        return free
    return free & (category[a] & mask[b] != 0) & (category[b] & mask[a] != 0)


@kernel
def _accepted(near, category, mask, inverse_mass, order, a, b):
    """Those of the lanes `near`, of the places from b on, that are accepted for place a."""
    for lane in range(LANES):
        bit = 1 << lane
        if near & bit != 0 and not _accept(category, mask, inverse_mass, order[a], order[b + lane]):
            near -= bit
    return near


@kernel
def _runs_of_smaller(spot, a, level, row0, row1, levels, start, skin, low, end, runs):
    """Add to the runs of places (low, end) those near place a of levels with smaller cells, in the rows row0 to row1 of level 0.

    From the larger to the smaller: what is near a large circle stands around it, and inside of it the rows are empty.
    """
    x, y = spot[0, a] - levels.x0, spot[1, a] - levels.y0
    zero, one = spot.dtype.type(0), spot.dtype.type(1)
    for other in range(level + 1, levels.base.shape[0]):
        wide, high, shift = levels.width[other], levels.height[other], levels.shift[other]
        reach = (spot[2, a] + levels.largest[other] + skin) * spot.dtype.type(ROUNDING)
        first = cell_number((y - reach) * levels.along[other], high)
        last = cell_number((y + reach) * levels.along[other], high)
        tall = one / levels.along[other]
        for row in range(max(first, row0 << shift), min(last + 1, row1 << shift)):
            # The chord of the circle of that reach where it is widest within the row; the rim rows have no outer edge.
            below = spot.dtype.type(row) * tall - y
            away = max(max(below if row > 0 else zero, -below - tall if row < high - 1 else zero), zero)
            half = np.sqrt(max(reach * reach - away * away, zero))
            left = cell_number((x - half) * levels.across[other], wide)
            right = cell_number((x + half) * levels.across[other], wide)
            k = levels.base[other] + row * wide
            low[runs], end[runs] = start[k + left], start[k + right + 1]
            runs += low[runs] < end[runs]
    return runs


@kernel
def _most_runs(levels):
    """Runs that a circle may have at most: two on its own level, and a row each on those below."""
    most = 2
    for level in range(1, levels.base.shape[0]):
        most += (4 << levels.shift[level]) + 2
    return most


@kernel
def _list_strip(spot, order, row0, row1, levels, start, skin, picky, category, mask, inverse_mass, raw_i, raw_j):
    """Candidate pairs of the rows row0 to row1, as places in the order of the cells; how many there are, also beyond the room."""
    found = 0
    close = spread(spot.dtype.type(CLOSE))
    last = levels.base.shape[0] - 1
    low, end = np.empty(_most_runs(levels), np.int64), np.empty(_most_runs(levels), np.int64)
    for level in range(last + 1):
        wide, high, shift, across = levels.width[level], levels.height[level], levels.shift[level], levels.across[level]
        # Pairs of a circle of the first row above and a smaller one below belong to this strip, too.
        above = min(row1 + (level < last), levels.height[0])
        for row in range(row0 << shift, above << shift):
            here = row < row1 << shift
            this = levels.base[level] + row * wide
            for a in range(start[this], start[this + wide]):
                runs = 0
                if here:
                    # The rest of this row, and the row above, from COLUMNS to the left to COLUMNS to the right.
                    column = cell_number((spot[0, a] - levels.x0) * across, wide)
                    left, right = max(column - COLUMNS, 0), min(column + COLUMNS, wide - 1) + 1
                    low[0], end[0] = a + 1, start[this + right]
                    runs = 1
                    if row + 1 < high:
                        low[1], end[1] = start[this + wide + left], start[this + wide + right]
                        runs = 2
                if level < last:
                    top = levels.height[0] if here else row1
                    runs = _runs_of_smaller(spot, a, level, row0, top, levels, start, skin, low, end, runs)
                x, y, radius, margin = spread(spot[0, a]), spread(spot[1, a]), spread(spot[2, a]), spread(skin)
                for run in range(runs):
                    for b in range(low[run], end[run], LANES):
                        dx, dy, reach = load(spot[0], b) - x, load(spot[1], b) - y, load(spot[2], b) + radius
                        square, listed, soon = dx * dx + dy * dy, reach + margin, reach * close
                        near = which_above(listed * listed, square) & ((1 << min(end[run] - b, LANES)) - 1)
                        if picky:
                            near = _accepted(near, category, mask, inverse_mass, order, a, b)
                        soon_bits = near & which_above(soon * soon, square)
                        for bits, mark in ((soon_bits, 0), (near - soon_bits, _APART)):
                            if found + LANES <= raw_i.shape[0]:
                                write_all(raw_i, found, a)
                                write_chosen(raw_j, found, bits, b + mark)
                            found += count_bits(bits)
    return found


@kernel
def _forget_colours(used, row0, row1, levels, start):
    """No colours are used in the rows row0 to row1 of level 0."""
    for level in range(levels.base.shape[0]):
        used[before_row(levels, start, level, row0) : before_row(levels, start, level, row1)] = 0


@kernel
def _colour_strip(used, raw_i, raw_j, found, colour, begin):
    """Give each pair the lowest colour that neither of its circles has; begin[c]: pairs of the colours before c.

    Those that are close have the colours from COLOURS on.
    """
    begin[:] = 0
    for p in range(found):
        i, j = raw_i[p], raw_j[p] & _PLACE
        free = ~np.int64(used[i] | used[j]) & _ALL
        lowest = free & -free
        used[i] |= lowest
        used[j] |= lowest
        c = (lowest_bit(free) if free != 0 else p % COLOURS) + (0 if raw_j[p] > _PLACE else COLOURS)
        colour[p] = c
        begin[c + 1] += np.uint32(1)
    for c in range(2 * COLOURS):
        begin[c + 1] += begin[c]


@kernel
def _fill_strip(
    order, levels, start, row0, row1, skin, picky, category, mask, inverse_mass, spot, used, pair_i, pair_j,
):  # fmt: skip
    """What `list_pairs` does, for a strip of the rows row0 to row1, into its own part of the arrays."""
    # Made anew for each strip: it stays in the cache, where scratch for all of the strips would be fetched from memory.
    room = pair_i.shape[0]
    raw_i, raw_j, colour = np.empty(room + LANES, np.uint32), np.empty(room + LANES, np.uint32), np.empty(room, np.uint8)
    found = _list_strip(spot, order, row0, row1, levels, start, skin, picky, category, mask, inverse_mass, raw_i, raw_j)
    if found <= room:
        _forget_colours(used, row0, row1 + 1, levels, start)
        begin = np.empty(2 * COLOURS + 1, np.uint32)
        _colour_strip(used, raw_i, raw_j, found, colour, begin)
        for p in range(found):
            to = begin[colour[p]]
            begin[colour[p]] += np.uint32(1)
            pair_i[to] = order[raw_i[p]]
            pair_j[to] = order[raw_j[p] & _PLACE]
    return found


@parallel_kernel
def list_pairs(
    position, radius, order, levels, start, strip_row, first, skin, picky, category, mask, inverse_mass,
    spot, used, pair_i, pair_j, count,
):  # fmt: skip
    """Fill the pair list of every strip: pair_i, pair_j[first[s] : first[s] + count[s]], slots.

    first has one entry more than there are strips. A strip that needs more room than up to the next reports its full count and
    lists nothing: the caller makes room and calls again, so that no pair is ever dropped. Not `picky`: everyone collides.
    spot (3, n + LANES), used: scratch.
    """
    for k in prange(order.shape[0]):
        i = order[k]
        spot[0, k] = position[i, 0]
        spot[1, k] = position[i, 1]
        spot[2, k] = radius[i]
    for parity in range(2):
        for half in prange((strip_row.shape[0] - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s + 1]
            count[s] = _fill_strip(
                order, levels, start, strip_row[s], strip_row[s + 1], skin, picky, category, mask, inverse_mass,
                spot, used, pair_i[a:b], pair_j[a:b],
            )  # fmt: skip


@kernel
def count_far(position, radius, first, count, pair_i, pair_j, gap, step):
    """(pairs looked at, every step-th; how many of these are farther from touching than `gap`)."""
    looked = far = 0
    for s in range(count.shape[0]):
        for k in range(first[s], first[s] + count[s], step):
            i, j = pair_i[k], pair_j[k]
            dx = position[j, 0] - position[i, 0]
            dy = position[j, 1] - position[i, 1]
            reach = radius[i] + radius[j] + gap
            looked += 1
            far += dx * dx + dy * dy > reach * reach
    return looked, far


@kernel
def list_all_pairs(position, radius, period_x, period_y, inverse_mass, category, mask, pair_i, pair_j):
    """The readable reference, O(n^2): every overlapping pair, in natural order. Returns how many, also beyond the room."""
    found = 0
    for i in range(position.shape[0]):
        for j in range(i + 1, position.shape[0]):
            dx = nearest(position[j, 0] - position[i, 0], period_x)
            dy = nearest(position[j, 1] - position[i, 1], period_y)
            reach = radius[i] + radius[j]
            if dx * dx + dy * dy < reach * reach and _accept(category, mask, inverse_mass, i, j):
                if found < pair_i.shape[0]:
                    pair_i[found] = i
                    pair_j[found] = j
                found += 1
    return found
