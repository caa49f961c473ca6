# mypy: ignore-errors
"""Keeps contact state while the pair list is made anew.

It stays in the previous lanes, which are linked in chains of their lower particles, and new lanes search these chains. Because
new lanes occupy the memory of old ones, all values are read before any is written.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, int64_t, uint32_t
from cython.cimports.team import team_stage

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pair_lists import INDEX_WORDS, Lists
from pyverlet.core.step import TOUCHED, Step

GONE = cython.declare(uint32_t, 0xFFFFFFFF)
"""Replaces rows of removed particles."""

NORMALS = cython.declare(cython.int, 0)
TANGENTS = cython.declare(cython.int, 1)
"""Values transferred together: normal impulses and loads, or, with friction, tangential impulses."""


@inlined
def repeats(w: cython.pointer(Step), s: cython.Py_ssize_t, k: int64_t) -> cython.bint:
    """Whether lane k of group s repeats the pair before it."""
    return k > w.begin[s] and w.i[k] == w.i[k - 1] and w.j[k] == w.j[k - 1]


@inlined
def chain_of(ls: cython.pointer(Lists), low: uint32_t, high: uint32_t) -> cython.Py_ssize_t:
    """The chain for the contact of two particles."""
    return low * ls.fan + (high & (ls.fan - 1))


@kernel
def clear_chains(w: cython.pointer(Step), ls: cython.pointer(Lists)) -> cython.void:
    """Clear all chains."""
    i: cython.Py_ssize_t
    for i in range(w.count * ls.fan):
        ls.head[i] = -1


@inlined
def chain_pair(ls: cython.pointer(Lists), low: uint32_t, high: uint32_t, k: int64_t) -> cython.void:
    """Add lane k, a contact of these two particles, to their chain."""
    chain: cython.Py_ssize_t = chain_of(ls, low, high)
    ls.kept_other[INDEX_WORDS * k] = high
    ls.kept_next[INDEX_WORDS * k] = ls.head[chain]
    ls.head[chain] = cython.cast(int32_t, k)


@kernel
def keep_impulses(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """Add the contact state of group s to the chains of the lower particles.

    It stays in the lanes; the load at the start of the substep becomes negative for pairs that did not touch.
    """
    k: int64_t
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
        touched: cython.bint = w.impulse[k] > 0 or w.depth[k] > 0
        if (touched or w.load[k] != 0) and w.i[k] != GONE and w.j[k] != GONE and not repeats(w, s, k):
            load: real = w.load[k] if w.load[k] > 0 else -w.load[k]
            if touched and load == 0 and not w.impulse[k] > 0:
                load = TOUCHED
            w.load[k] = load if touched else -load
            if w.tangents and not w.rough:
                w.tangent_impulse[k] = 0
            if w.rollings and not w.rolls:
                w.roll_impulse[k] = 0
            chain_pair(ls, min(w.i[k], w.j[k]), max(w.i[k], w.j[k]), k)


@kernel
def find_sources(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """Find the previous lane of the same contact for each lane of group s."""
    k: int64_t
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
        high: uint32_t = max(w.i[k], w.j[k])
        n: int32_t = ls.head[chain_of(ls, min(w.i[k], w.j[k]), high)]
        while n >= 0 and ls.kept_other[INDEX_WORDS * n] != high:
            n = ls.kept_next[INDEX_WORDS * n]
        ls.source[INDEX_WORDS * k] = n


@kernel
def pick_values(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """Read the values for the lanes of group s into unused arrays, two at a time, as others may still read the old ones."""
    k: int64_t
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
        n: int64_t = ls.source[INDEX_WORDS * k]
        w.normal_x[k] = w.normal_y[k] = 0
        if n >= 0 and ls.carried == TANGENTS:
            w.normal_x[k] = w.tangent_impulse[n] if w.tangents else 0
            w.normal_y[k] = w.roll_impulse[n] if w.rollings else 0
        elif n >= 0:
            w.normal_x[k], w.normal_y[k] = w.impulse[n], w.load[n]


@kernel
def put_values(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """Write the values that were read to the lanes of group s; depths say whether they touch."""
    k: int64_t
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
        if ls.carried == TANGENTS:
            if w.tangents:
                w.tangent_impulse[k] = w.normal_x[k]
            if w.rollings:
                w.roll_impulse[k] = w.normal_y[k]
        else:
            w.impulse[k], w.load[k] = w.normal_x[k], w.normal_y[k]
            w.depth[k] = 1 if w.impulse[k] > 0 or w.load[k] > 0 else -1


@kernel
def pick_values_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Read the values for the lanes of a group."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    if w.lists.dirty[item]:
        pick_values(w, w.lists, item)


@kernel
def put_values_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Write the values to the lanes of a group."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    if w.lists.dirty[item]:
        put_values(w, w.lists, item)


@kernel
def take_over(w: cython.pointer(Step)) -> cython.void:
    """Transfer contact state from previous to new lanes."""
    carried: cython.int
    for carried in range(TANGENTS if w.tangents or w.rollings else NORMALS, NORMALS - 1, -1):
        w.lists.carried = carried
        team_stage(w.team, pick_values_stage, w, cython.cast(cython.int, w.groups))
        team_stage(w.team, put_values_stage, w, cython.cast(cython.int, w.groups))
