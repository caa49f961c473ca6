"""Which pairs overlap, found without a list."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel

FINEST, LEVELS = -100, 200
"""Exponents of the smallest cells of `touching`, whose width is a power of two, m, and how many there are."""


@kernel
def _slot(column, row, level, size):
    mixed = (column * 73856093) ^ (row * 19349663) ^ (level * 83492791)
    return (mixed ^ (mixed >> 15)) & (size - 1)


@kernel
def touching(position, radius, fixed, category, mask, shift, heads, following, first, second):
    """List the pairs whose rims overlap, i < j, but no two that are fixed, or that filters keep apart; returns their number.

    Each circle stands in one cell of the level whose cells are wider than it is. It is compared with those in the nine cells
    around it of each coarser level, and in five of its own: each pair once. shift (s, 2): to the images of a periodic room,
    (0, 0) the first; pairs across it are i before the shift, and j. heads, following: room for 2^k >= 2 n, and for n circles.
    More pairs than `first` has room for are counted.
    """
    used, high = np.zeros(LEVELS, np.bool_), -1
    x0 = y0 = np.inf
    x1 = y1 = -np.inf
    widest = 0.0
    level = np.empty(position.shape[0], np.int64)
    found = 0
    heads[:] = -1
    for i in range(position.shape[0]):
        x, y = np.float64(position[i, 0]), np.float64(position[i, 1])
        level[i] = min(max(int(np.ceil(np.log2(2.0 * np.float64(radius[i])))) - FINEST, 0), LEVELS - 1)
        if not np.isfinite(x + y):
            level[i] = -1
            continue
        used[level[i]] = True
        high = max(high, level[i])
        x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
        widest = max(widest, np.float64(radius[i]))
        per = 2.0 ** -(level[i] + FINEST)
        slot = _slot(int(np.floor(x * per)), int(np.floor(y * per)), level[i], heads.shape[0])
        following[i] = heads[slot]
        heads[slot] = i
    for s in range(shift.shape[0]):
        for i in range(position.shape[0]):
            if level[i] < 0:
                continue
            x, y = np.float64(position[i, 0]) + shift[s, 0], np.float64(position[i, 1]) + shift[s, 1]
            far = np.float64(radius[i]) + widest
            if x < x0 - far or x > x1 + far or y < y0 - far or y > y1 + far:
                continue
            for coarse in range(level[i], high + 1):
                if not used[coarse]:
                    continue
                per = 2.0 ** -(coarse + FINEST)
                column, row = int(np.floor(x * per)), int(np.floor(y * per))
                half = s == 0 and coarse == level[i]
                for around in range(4 if half else 0, 9):
                    c, r = column + around % 3 - 1, row + around // 3 - 1
                    j = heads[_slot(c, r, coarse, heads.shape[0])]
                    while j >= 0:
                        there, j = j, following[j]
                        if level[there] != coarse or (there <= i and coarse == level[i] and (around == 4 or not half)):
                            continue
                        other_x, other_y = np.float64(position[there, 0]), np.float64(position[there, 1])
                        dx, dy = x - other_x, y - other_y
                        reach = np.float64(radius[i]) + np.float64(radius[there])
                        if not dx * dx + dy * dy < reach * reach:
                            continue
                        if int(np.floor(other_x * per)) != c or int(np.floor(other_y * per)) != r:
                            continue  # of another cell with the same hash
                        if (fixed[i] and fixed[there]) or not (category[i] & mask[there] and category[there] & mask[i]):
                            continue
                        if found < first.shape[0]:
                            first[found], second[found] = min(i, there), max(i, there)
                        found += 1
    return found
