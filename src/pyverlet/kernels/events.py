"""Which candidate pairs touch, and how fast they meet."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel


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
