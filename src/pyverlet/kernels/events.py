"""Which candidate pairs touch, and how fast they meet."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange


@parallel_kernel
def listen(position, velocity, acceleration, size, lag, first, count, pair_i, pair_j, closing):
    """closing[k], for overlapping pairs: the largest of itself and the speed they approach with, m/s, at least 0."""
    zero = lag - lag
    for s in prange(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = pair_i[k], pair_j[k]
            dx = position[j, 0] - position[i, 0]
            dy = position[j, 1] - position[i, 1]
            reach = size[i] + size[j]
            square = dx * dx + dy * dy
            if square < reach * reach:
                vx = velocity[j, 0] - velocity[i, 0] + lag * (acceleration[j, 0] - acceleration[i, 0])
                vy = velocity[j, 1] - velocity[i, 1] + lag * (acceleration[j, 1] - acceleration[i, 1])
                speed = -(vx * dx + vy * dy) / np.sqrt(square) if square > zero else zero
                closing[k] = max(closing[k], speed, zero)


@kernel
def heard(first, count, pair_i, pair_j, closing, particle, keys, speeds):
    """Key (smaller index << 32, larger index + 1) and speed of pairs that have touched; closing becomes -1. Returns how many."""
    found = 0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            if closing[k] >= 0:
                a, b = np.int64(particle[pair_i[k]]), np.int64(particle[pair_j[k]])
                keys[found] = (min(a, b) << 32) + max(a, b) + 1
                speeds[found] = closing[k]
                closing[k] = -1
                found += 1
    return found
