"""How far pairs overlap, and how small circles must be not to."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.kernels.seam import nearest


@kernel
def fit(position, radius, period_x, period_y, first, count, pair_i, pair_j, fresh, least, grown):
    """Shrink fresh particles, and those they overlap, until they just touch: grown = distance / (r_i + r_j), at least `least`."""
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            if fresh[i] | fresh[j]:
                dx = nearest(position[j, 0] - position[i, 0], period_x)
                dy = nearest(position[j, 1] - position[i, 1], period_y)
                part = max(np.sqrt(dx * dx + dy * dy) / (radius[i] + radius[j]), least)
                grown[i] = min(grown[i], part)
                grown[j] = min(grown[j], part)


@kernel
def overlaps(position, radius, period_x, period_y, first, count, pair_i, pair_j):
    """(number of touching pairs, sum and maximum of depth / (r_i + r_j))."""
    number, total, largest = 0, 0.0, 0.0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            dx = nearest(np.float64(position[j, 0]) - np.float64(position[i, 0]), period_x)
            dy = nearest(np.float64(position[j, 1]) - np.float64(position[i, 1]), period_y)
            reach = np.float64(radius[i]) + np.float64(radius[j])
            overlap = 1.0 - np.sqrt(dx * dx + dy * dy) / reach
            if overlap > 0.0:
                number += 1
                total += overlap
                largest = max(largest, overlap)
    return number, total, largest
