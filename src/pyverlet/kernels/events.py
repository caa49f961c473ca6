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


@kernel
def absent(keys, others):
    """Which of the keys are not among the others; both ascend."""
    out, at = np.ones(keys.shape[0], np.bool_), 0
    for k in range(keys.shape[0]):
        while at < others.shape[0] and others[at] < keys[k]:
            at += 1
        out[k] = at == others.shape[0] or others[at] != keys[k]
    return out


@kernel
def largest(keys, told, speeds):
    """The largest of the speeds that were told of each of the keys, which ascend; -1 if there is none."""
    out = np.full(keys.shape[0], -1.0)
    if keys.shape[0] == 0:
        return out
    for k in range(told.shape[0]):
        at = np.searchsorted(keys, told[k])
        if at < keys.shape[0] and keys[at] == told[k]:
            out[at] = max(out[at], speeds[k])
    return out
