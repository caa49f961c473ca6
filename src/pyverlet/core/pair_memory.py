# mypy: ignore-errors
"""What contacts remember while the list of pairs is made anew.

It stays in the lanes of before, which hang on chains of their lower particles, and new lanes look along these. As places of new
lanes are those of old ones, what is taken over is picked by all before any puts it where it belongs.
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
"""In place of an index whose particle is no more."""

NORMALS = cython.declare(cython.int, 0)
TANGENTS = cython.declare(cython.int, 1)
"""What is taken over together: impulses along normals and loads, or, in worlds with friction, what is along tangents."""


@inlined
def repeats(w: cython.pointer(Step), s: cython.Py_ssize_t, k: int64_t) -> cython.bint:
    """Whether lane k of group s is the pair before it once more."""
    return k > w.begin[s] and w.i[k] == w.i[k - 1] and w.j[k] == w.j[k - 1]


@inlined
def chain_of(ls: cython.pointer(Lists), low: uint32_t, high: uint32_t) -> cython.Py_ssize_t:
    """The chain that remembers the contact of two particles."""
    return low * ls.fan + (high & (ls.fan - 1))


@kernel
def clear_chains(w: cython.pointer(Step), ls: cython.pointer(Lists)) -> cython.void:
    """Nothing is remembered."""
    i: cython.Py_ssize_t
    for i in range(w.count * ls.fan):
        ls.head[i] = -1


@inlined
def chain_pair(ls: cython.pointer(Lists), low: uint32_t, high: uint32_t, k: int64_t) -> cython.void:
    """Put lane k, in which two particles met, on their chain."""
    chain: cython.Py_ssize_t = chain_of(ls, low, high)
    ls.kept_other[INDEX_WORDS * k] = high
    ls.kept_next[INDEX_WORDS * k] = ls.head[chain]
    ls.head[chain] = cython.cast(int32_t, k)


@kernel
def keep_impulses(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """Hang what the contacts of group s remember on the chains of their lower particles.

    It stays in their lanes; the load that the substep began with becomes negative where they did not touch.
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
    """Of each lane of group s, which lane of before remembers its contact."""
    k: int64_t
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
        high: uint32_t = max(w.i[k], w.j[k])
        n: int32_t = ls.head[chain_of(ls, min(w.i[k], w.j[k]), high)]
        while n >= 0 and ls.kept_other[INDEX_WORDS * n] != high:
            n = ls.kept_next[INDEX_WORDS * n]
        ls.source[INDEX_WORDS * k] = n


@kernel
def pick_values(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """Pick what the lanes of group s take over, beside what is there, as others may still take that: two values at a time."""
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
    """What was picked becomes what the lanes of group s remember; depths say whether they touch."""
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
    """Pick what the lanes of a group take over."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    if w.lists.dirty[item]:
        pick_values(w, w.lists, item)


@kernel
def put_values_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """They take it over."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    if w.lists.dirty[item]:
        put_values(w, w.lists, item)


@kernel
def take_over(w: cython.pointer(Step)) -> cython.void:
    """New lanes remember what those of before did."""
    carried: cython.int
    for carried in range(TANGENTS if w.tangents or w.rollings else NORMALS, NORMALS - 1, -1):
        w.lists.carried = carried
        team_stage(w.team, pick_values_stage, w, cython.cast(cython.int, w.groups))
        team_stage(w.team, put_values_stage, w, cython.cast(cython.int, w.groups))
