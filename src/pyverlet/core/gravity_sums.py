# mypy: ignore-errors
"""Gravitation by a tree: walks through it for particles that stand together, and what they feel."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_reals, const_small_integers, doubles, indices, reals, small_integers, words
from cython.cimports.lanes import LANES, above, bits_of, lanes, lanes4, larger, real, spread, take4
from cython.cimports.libc.math import INFINITY, NAN, fabs, isfinite, sqrt
from cython.cimports.libc.stdint import int32_t, uint32_t, uint64_t
from cython.cimports.team import team_free, team_new, team_run, team_stage, thread_team

from pyverlet.core.gravity_lists import LIST, ROOM, ROWS, STACK, sum_found
from pyverlet.core.gravity_tree import DIGITS, LEVELS, Tree, divide, measure_nodes, sort_codes, spread_bits

ITEMS = cython.declare(cython.int, 32)
"""Parts that threads share out."""

TINY = cython.declare(cython.double, 1e-290)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def pull_group(
    t: cython.pointer(Tree), room: cython.Py_ssize_t, stack: cython.Py_ssize_t, first: cython.int, stop: cython.int
) -> cython.void:
    """Walk through the tree for particles that stand together, and sum."""
    b: cython.pointer(real) = t.room
    sums: cython.Py_ssize_t = room + ROWS * LIST
    low_x: real = t.x[first]
    low_y: real = t.y[first]
    high_x: real = low_x
    high_y: real = low_y
    i: cython.int
    k: cython.Py_ssize_t
    p: cython.int
    axis: cython.int
    lane: cython.int
    taken: uint32_t[8]
    for i in range(first, stop):
        low_x, high_x = min(low_x, t.x[i]), max(high_x, t.x[i])
        low_y, high_y = min(low_y, t.y[i]), max(high_y, t.y[i])
    for k in range(3 * LANES * (stop - first)):
        b[sums + k] = 0
    left: lanes = spread(low_x)
    right: lanes = spread(high_x)
    under: lanes = spread(low_y)
    over: lanes = spread(high_y)
    theta2: lanes = spread(t.theta2)
    zero: lanes = spread(0)
    nodes: cython.pointer(uint32_t) = t.found
    singles: cython.Py_ssize_t = stack + STACK
    squares: cython.Py_ssize_t = singles + LIST
    alone: cython.Py_ssize_t = 0
    whole: cython.Py_ssize_t = 0
    depth: cython.Py_ssize_t = stack + 9
    for lane in range(8):
        nodes[stack + lane] = t.nodes
    nodes[stack + 8] = 0
    while depth > stack + 8:
        if alone > LIST - 8 or whole > LIST - 8:
            sum_found(t, room, stack, alone, whole, first, stop)
            alone = whole = 0
        at: lanes4 = take4(t.node, nodes, depth - 8)
        dx: lanes = larger(larger(left - at.x, at.x - right), zero)
        dy: lanes = larger(larger(under - at.y, at.y - over), zero)
        bits: cython.int = bits_of(above(theta2 * (dx * dx + dy * dy), at.w))
        for lane in range(8):
            taken[lane] = nodes[depth - 8 + lane]
        depth = max(depth - 8, stack + 8)
        for lane in range(8):  # without a branch: processors would guess it wrongly
            node: uint32_t = taken[lane]
            far: cython.int = (bits >> lane) & 1
            parts: cython.int = t.parts[node]
            nodes[squares + whole], nodes[singles + alone] = node, node
            whole += far
            alone += 1 - far if parts == 0 else 0
            for p in range(4):
                nodes[depth + p] = t.part[4 * node + p]
            depth += 0 if far else parts
    sum_found(t, room, stack, alone, whole, first, stop)
    for i in range(first, stop):
        for axis in range(3):
            k = sums + LANES * (3 * (i - first) + axis)
            t.pull[3 * i + axis] = ((b[k] + b[k + 4]) + (b[k + 1] + b[k + 5])) + ((b[k + 2] + b[k + 6]) + (b[k + 3] + b[k + 7]))


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def pull_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Some groups one after the other."""
    t: cython.pointer(Tree) = cython.cast(cython.pointer(Tree), what)
    g: cython.int
    for g in range(t.groups * item // t.items, t.groups * (item + 1) // t.items):
        pull_group(t, ROOM * item, (STACK + 2 * LIST) * item, t.group[2 * g], t.group[2 * g + 1])


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def pull_all(what: cython.p_void, item: cython.int) -> cython.void:
    """All groups, by whoever is there."""
    t: cython.pointer(Tree) = cython.cast(cython.pointer(Tree), what)
    team_stage(t.threads, pull_stage, what, t.items)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def balance(t: cython.pointer(Tree)) -> cython.void:
    """Take what all forces add up to, which should be nothing, from all by their size: F_i -= |F_i| sum F / sum |F|."""
    k: cython.Py_ssize_t
    fx: cython.double = 0
    fy: cython.double = 0
    sizes: cython.double = 0
    for k in range(t.count):
        m: cython.double = t.m[k]
        fx += m * t.pull[3 * k]
        fy += m * t.pull[3 * k + 1]
        sizes += m * sqrt(t.pull[3 * k] * t.pull[3 * k] + t.pull[3 * k + 1] * t.pull[3 * k + 1])
    if sizes > 0:
        fx, fy = fx / sizes, fy / sizes
    for k in range(t.count):
        size: cython.double = sqrt(t.pull[3 * k] * t.pull[3 * k] + t.pull[3 * k + 1] * t.pull[3 * k + 1])
        t.pull[3 * k] -= size * fx
        t.pull[3 * k + 1] -= size * fy


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def code_of(x: cython.double, place: cython.double) -> uint64_t:
    """Of a coordinate between -1 and 1."""
    return cython.cast(uint64_t, min((x + 1) * place, 2 * place - 1))


def tree_work(count: cython.Py_ssize_t, here):
    """Arrays for a tree over so many particles of this dtype: the system takes longer to give them than the tree to use them."""
    most = 2 * count + 2  # nodes
    floats = (np.empty(n, here) for n in (count + LANES, count + LANES, count + LANES, ITEMS * ROOM, 4 * most, 4 * most))
    sorts = np.empty(4 * most), np.empty(3 * count), np.empty(most, np.uint64), np.empty(most, np.int32)
    found = np.empty(4 * most, np.uint32), np.empty(ITEMS * (STACK + 2 * LIST), np.uint32)
    return *floats, *sorts, *found, *(np.empty(most, np.int32) for _ in range(4)), np.empty(DIGITS + 1, np.int32)


def gravitate_by_tree(
    force,
    position,
    mass,
    slot,
    strength: cython.double,
    softening: cython.double,
    theta: cython.double,
    threads: cython.size_t,
    parts: cython.int,
    work=None,
    energies: cython.bint = True,
) -> float:
    """As `gravitate`, by a tree; returns the potential energy, J, or 0 if that is not asked for. All forces together are 0 to rounding.

    slot: (k,) int32. threads: address of a team of threads, of which so many take part; 0 is none.
    work: what `tree_work` has made for so many slots, or None. Who is nowhere, at NaN, feels NaN.
    """  # fmt: skip
    f: cython.pointer(real) = reals(force)
    at: cython.pointer[cython.const[real]] = const_reals(position)
    m: cython.pointer[cython.const[real]] = const_reals(mass)
    who: cython.pointer[cython.const[int32_t]] = const_small_integers(slot)
    all_: cython.Py_ssize_t = len(slot)
    tree: Tree
    t: cython.pointer(Tree) = cython.address(tree)
    a = tree_work(all_, position.dtype) if work is None else work
    t.x, t.y, t.m, t.room = reals(a[0]), reals(a[1]), reals(a[2]), reals(a[3])
    t.node, t.second, t.corner, t.pull = reals(a[4]), reals(a[5]), doubles(a[6]), doubles(a[7])
    t.code, t.order, t.part, t.found = words(a[8]), small_integers(a[9]), indices(a[10]), indices(a[11])
    t.begin, t.end, t.parts, t.group = small_integers(a[12]), small_integers(a[13]), small_integers(a[14]), small_integers(a[15])
    tally: cython.pointer(int32_t) = small_integers(a[16])
    t.threads = cython.cast(cython.pointer(thread_team), threads) if threads else team_new(1)
    if t.threads == cython.NULL:
        raise MemoryError
    t.count, t.nodes, t.groups, t.items, t.energies = 0, 0, 0, ITEMS, energies
    total: cython.double = 0
    largest: cython.double = 0
    unit: cython.double = 1  # m, a power of two
    energy: cython.double = 0
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    with cython.nogil:
        for k in range(all_):
            i = who[k]
            if not (isfinite(at[2 * i]) and isfinite(at[2 * i + 1])):
                f[2 * i], f[2 * i + 1] = cython.cast(real, NAN), cython.cast(real, NAN)
            elif m[i] < INFINITY:
                t.order[t.count] = cython.cast(int32_t, i)
                t.count += 1
                total += m[i]
                largest = max(largest, max(fabs(at[2 * i]), fabs(at[2 * i + 1])))
        if t.count > 0:
            while unit < largest:
                unit *= 2
            while unit > TINY and unit >= 2 * largest:
                unit *= 0.5
            per: cython.double = 1 / unit
            share: cython.double = 1 / total
            place: cython.double = cython.cast(cython.double, 1 << (LEVELS - 1))
            for k in range(t.count):
                i = t.order[k]
                t.code[k] = spread_bits(code_of(at[2 * i] * per, place)) | (spread_bits(code_of(at[2 * i + 1] * per, place)) << 1)
            sort_codes(t, tally)
            for k in range(t.count):
                i = t.order[k]
                t.x[k], t.y[k] = cython.cast(real, at[2 * i] * per), cython.cast(real, at[2 * i + 1] * per)
                t.m[k] = cython.cast(real, m[i] * share)
            divide(t, tally)
            measure_nodes(t)
            t.theta2, t.softening2 = cython.cast(real, theta * theta), cython.cast(real, softening / unit * softening / unit)
            t.least = cython.cast(real, 1e-290 if cython.sizeof(real) == 8 else 1e-37)
            team_run(t.threads, pull_all, t, parts)
            balance(t)
            soft: cython.double = sqrt(t.softening2)
            itself: cython.double = 1 / soft if soft * soft * soft > t.least else 0  # of the potential that each has by itself
            scale: cython.double = strength * (total * per * per)
            for k in range(t.count):
                i = t.order[k]
                pull_of: cython.double = scale * m[i]
                f[2 * i] = cython.cast(real, f[2 * i] + pull_of * t.pull[3 * k])
                f[2 * i + 1] = cython.cast(real, f[2 * i + 1] + pull_of * t.pull[3 * k + 1])
                energy += pull_of * (t.pull[3 * k + 2] + itself * t.m[k])
        if not threads:
            team_free(t.threads)
    return 0.5 * unit * energy if energies else 0.0
