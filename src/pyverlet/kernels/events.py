"""Which candidate pairs touch, and how fast they meet."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import ALL, LANES, load, spread, store, which_above, which_set


@kernel
def _key(i, j, particle):
    a, b = np.int64(particle[i]), np.int64(particle[j])
    return (min(a, b) << 32) + max(a, b) + 1


@kernel
def heard(first, count, pair_i, pair_j, closing, bounced, touched, particle, keys, speeds, bounces):
    """Key (smaller index << 32, larger index + 1), speed and bounces of pairs that have touched; closing becomes -1, bounced 0.

    Returns how many.

    touched: (room,) bool, becomes whether each has.
    """
    found = 0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            touched[k] = closing[k] >= 0
            if touched[k]:
                keys[found] = _key(pair_i[k], pair_j[k], particle)
                speeds[found] = closing[k]
                bounces[found] = bounced[k]
                closing[k] = -1
                bounced[k] = 0
                found += 1
    return found


@kernel
def recall(first, count, pair_i, pair_j, touched, particle, keys):
    """Pairs of these keys, which ascend, have touched, too."""
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            if not touched[k]:
                key = _key(pair_i[k], pair_j[k], particle)
                at = np.searchsorted(keys, key)
                touched[k] = at < keys.shape[0] and keys[at] == key


@kernel
def changed(first, count, pair_i, pair_j, closing, bounced, touched, particle, new, speeds, bounces, gone):
    """Keys, speeds and bounces of pairs that have touched and had not, or have bounced, and keys of those that had and have not.

    closing becomes -1, bounced 0. The pairs come in packs of eight. touched: (room,) bool, whether each had, becomes whether it
    has. Returns how many of each there are.
    """
    packs = bounced.view(np.uint64)
    begun = ended = 0
    zero, silent = spread(closing.dtype.type(0)), spread(closing.dtype.type(-1))
    for s in range(first.shape[0]):
        for pack in range(first[s], first[s] + count[s], LANES):
            differs = (ALL - which_above(zero, load(closing, pack))) ^ which_set(touched, pack, 1)
            if differs != 0 or packs[pack // LANES] != 0:  # in a heap at rest, for hardly any pack
                for k in range(pack, pack + LANES):
                    now = closing[k] >= 0
                    if now == touched[k] and bounced[k] == 0:
                        continue
                    key = _key(pair_i[k], pair_j[k], particle)
                    if now:
                        new[begun], speeds[begun], bounces[begun] = key, closing[k], bounced[k]
                        begun += 1
                    else:
                        gone[ended] = key
                        ended += 1
                    touched[k] = now
                packs[pack // LANES] = 0
            store(closing, pack, silent)
    return begun, ended


@kernel
def replaced(keys, gone, new):
    """The keys without those that are gone, and with the new ones; all ascend. gone: some of them, new: none."""
    out = np.empty(keys.shape[0] - gone.shape[0] + new.shape[0], np.int64)
    k = to = at = left = 0
    while left < gone.shape[0] or at < new.shape[0]:
        leaves = at == new.shape[0] or (left < gone.shape[0] and gone[left] < new[at])
        stop = k + np.searchsorted(keys[k:], gone[left] if leaves else new[at])
        out[to : to + stop - k] = keys[k:stop]
        to += stop - k
        if leaves:
            k, left = stop + 1, left + 1
        else:
            out[to] = new[at]
            k, to, at = stop, to + 1, at + 1
    out[to:] = keys[k:]
    return out


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
