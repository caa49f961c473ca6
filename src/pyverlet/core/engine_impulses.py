# mypy: ignore-errors
"""Contact state as arrays, for files, and for worlds whose particles have been added or removed."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import integers, reals, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, int64_t, uint32_t

from pyverlet.core.kernels import inlined
from pyverlet.core.pair_lists import INDEX_WORDS, Lists
from pyverlet.core.pair_memory import GONE, chain_pair, clear_chains, repeats
from pyverlet.core.step import TOUCHED, Step


@inlined
def remembers(w: cython.pointer(Step), s: cython.Py_ssize_t, k: int64_t) -> cython.bint:
    """Whether lane k of group s has state to keep, and is not a repeated pair."""
    known: cython.bint = w.i[k] != GONE and w.j[k] != GONE
    return known and (w.impulse[k] > 0 or w.depth[k] > 0 or w.load[k] != 0) and not repeats(w, s, k)


@cython.cfunc
def read_impulses(w: cython.pointer(Step), which: cython.pointer(int32_t), particle, dtype):
    """(pairs, values) as of `Engine.take_impulses`, from the list; who: the user's index of each row."""
    if w.lists.impulses_stored:
        return read_chains(w, which, dtype)
    first = np.zeros(int(particle.max(initial=-1)) + 2, np.int64)
    begin: cython.pointer(int64_t) = integers(first)
    s: cython.Py_ssize_t
    k: int64_t
    groups: cython.Py_ssize_t = w.groups if w.lists.listed else 0
    for s in range(groups):
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            if remembers(w, s, k):
                begin[min(which[w.i[k]], which[w.j[k]]) + 1] += 1
    np.cumsum(first, out=first)
    pairs, values = np.empty((first[-1], 2), np.int32), np.empty((first[-1], 4), dtype)
    pair: cython.pointer(int32_t) = small_integers(pairs)
    value: cython.pointer(real) = reals(values)
    for s in range(groups):
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            if remembers(w, s, k):
                p: int32_t = which[w.i[k]]
                q: int32_t = which[w.j[k]]
                n: int64_t = begin[min(p, q)]
                begin[min(p, q)] = n + 1
                pair[2 * n], pair[2 * n + 1] = min(p, q), max(p, q)
                touched: cython.bint = w.impulse[k] > 0 or w.depth[k] > 0
                load: real = w.load[k] if w.load[k] > 0 else -w.load[k]
                if touched and load == 0 and not w.impulse[k] > 0:
                    load = TOUCHED
                value[4 * n] = w.impulse[k]
                value[4 * n + 1] = w.tangent_impulse[k] if w.rough else 0
                value[4 * n + 2] = load if touched else -load
                value[4 * n + 3] = w.roll_impulse[k] if w.rolls else 0
    return pairs, values


@cython.cfunc
def read_chains(w: cython.pointer(Step), which: cython.pointer(int32_t), dtype):
    """(pairs, values) as of `Engine.take_impulses`, from the chains."""
    ls: cython.pointer(Lists) = w.lists
    hung: cython.Py_ssize_t = 0
    c: cython.Py_ssize_t
    n: int32_t
    for c in range(w.count * ls.fan):
        n = ls.head[c]
        while n >= 0:
            hung, n = hung + 1, ls.kept_next[INDEX_WORDS * n]
    pairs, values = np.empty((hung, 2), np.int32), np.empty((hung, 4), dtype)
    pair: cython.pointer(int32_t) = small_integers(pairs)
    value: cython.pointer(real) = reals(values)
    hung = 0
    for c in range(w.count * ls.fan):
        n = ls.head[c]
        while n >= 0:
            p: int32_t = which[c // ls.fan]
            q: int32_t = which[ls.kept_other[INDEX_WORDS * n]]
            pair[2 * hung], pair[2 * hung + 1] = min(p, q), max(p, q)
            value[4 * hung], value[4 * hung + 2] = w.impulse[n], w.load[n]
            value[4 * hung + 1] = w.tangent_impulse[n] if w.tangents else 0
            value[4 * hung + 3] = w.roll_impulse[n] if w.rollings else 0
            hung, n = hung + 1, ls.kept_next[INDEX_WORDS * n]
    order = np.lexsort(pairs.T[::-1])
    return pairs[order], values[order]


@cython.cfunc
def fill_kept(w: cython.pointer(Step), pairs, values):
    """Add entries to the chains of their lower rows."""
    ls: cython.pointer(Lists) = w.lists
    pair: cython.pointer(int32_t) = small_integers(pairs)
    value: cython.pointer(real) = reals(values)
    k: int64_t
    clear_chains(w, ls)
    for k in range(len(pairs)):
        low: int32_t = min(pair[2 * k], pair[2 * k + 1])
        w.impulse[k], w.load[k] = value[4 * k], value[4 * k + 2]
        if w.tangents:
            w.tangent_impulse[k] = value[4 * k + 1]
        if w.rollings:
            w.roll_impulse[k] = value[4 * k + 3]
        chain_pair(ls, cython.cast(uint32_t, low), cython.cast(uint32_t, max(pair[2 * k], pair[2 * k + 1])), k)
