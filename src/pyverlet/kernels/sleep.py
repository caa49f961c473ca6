"""Who is touched while asleep, under the law of projection. One thread: it is rare."""

from __future__ import annotations

from pyverlet.compile.jit import kernel
from pyverlet.kernels.seam import nearest


@kernel
def touch(position, size, period_x, period_y, island, first, count, pair_i, pair_j, touched):
    """Set touched[i] = 1 for sleepers that overlap somebody awake; returns how many such pairs there are."""
    found = 0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            if (island[i] < 0) != (island[j] < 0):
                dx = nearest(position[j, 0] - position[i, 0], period_x)
                dy = nearest(position[j, 1] - position[i, 1], period_y)
                reach = size[i] + size[j]
                if dx * dx + dy * dy < reach * reach:
                    touched[j if island[i] < 0 else i] = 1
                    found += 1
    return found
