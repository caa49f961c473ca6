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

from pyverlet.core.gravity_lists import ROOM, sum_found
from pyverlet.core.gravity_tree import DIGITS, LEVELS, TARGETS, Tree, divide, measure_nodes, sort_codes, spread_bits
from pyverlet.core.kernels import inlined, kernel

ITEMS = cython.declare(cython.int, 32)
"""Parts that threads share out."""

WHOLES = cython.declare(cython.Py_ssize_t, 1024)
"""Squares that count as a whole for a square, and so for its parts, before they are summed; each level may find 8 more."""

KEPT = cython.declare(cython.Py_ssize_t, 256)
"""Squares that are kept for the parts of a square."""

STACK = cython.declare(cython.Py_ssize_t, 824)
"""Squares to be looked at: eight are taken at a time, and to those kept come 24 of each level that may be left."""

LISTS = cython.declare(cython.Py_ssize_t, 1224)  # WHOLES, and what is found beyond on all levels
PLACES = cython.declare(cython.Py_ssize_t, 27144)  # LISTS + (LEVELS + 3) (KEPT + STACK), what is kept and the stack of each level

TINY = cython.declare(cython.double, 1e-290)


@kernel
def pull_square(
    t: cython.pointer(Tree),
    item: cython.Py_ssize_t,
    level: cython.Py_ssize_t,
    node: uint32_t,
    count: cython.Py_ssize_t,
    begun: cython.Py_ssize_t,
    found: cython.Py_ssize_t,
) -> cython.void:
    """Sum for all particles of a square what is left of the tree: the squares that the level above has kept.

    What counts as a whole for all of it is found once, but summed for groups: with what has been found for what it is part of,
    from `begun` to `found`. What is too near for all of it is divided, and the rest kept for its parts.
    """
    nodes: cython.pointer(uint32_t) = t.found
    whole: cython.Py_ssize_t = PLACES * item
    kept: cython.Py_ssize_t = whole + LISTS + (KEPT + STACK) * level
    stack: cython.Py_ssize_t = kept + KEPT + 8
    depth: cython.Py_ssize_t = stack + count
    first_found: cython.Py_ssize_t = found
    near: cython.Py_ssize_t = 0
    p: cython.int
    lane: cython.int
    taken: uint32_t[8]
    group: cython.bint = t.parts[node] == 0 or t.end[node] - t.begin[node] <= TARGETS
    left: lanes = spread(cython.cast(real, t.corner[4 * node]))
    under: lanes = spread(cython.cast(real, t.corner[4 * node + 1]))
    right: lanes = spread(cython.cast(real, t.corner[4 * node + 2]))
    over: lanes = spread(cython.cast(real, t.corner[4 * node + 3]))
    theta2: lanes = spread(t.theta2)
    zero: lanes = spread(0)
    for k in range(8):
        nodes[stack - 8 + k] = t.nodes
    for k in range(count):
        nodes[stack + k] = nodes[kept - (KEPT + STACK) + k]
    while True:
        if depth <= stack or near > KEPT - 8 or found > max(first_found, WHOLES - 8):
            if group:
                for k in range(8):
                    nodes[whole + found + k] = t.nodes
                for p in range(t.begin[node], t.end[node], 64):  # TARGETS; only what is not divided has more
                    sum_found(t, ROOM * item, whole + begun, found - begun, kept, near, p, min(p + TARGETS, t.end[node]))
            elif near or found > begun:
                for p in range(t.parts[node]):
                    pull_square(t, item, level + 1, t.part[4 * node + p], near, begun, found)
            begun = found = first_found
            near = 0
            if depth <= stack:
                break
        at: lanes4 = take4(t.node, nodes, depth - 8)
        dx: lanes = larger(larger(left - at.x, at.x - right), zero)
        dy: lanes = larger(larger(under - at.y, at.y - over), zero)
        far: cython.int = bits_of(above(theta2 * (dx * dx + dy * dy), at.w))
        away_x: lanes = larger(at.x - left, right - at.x)  # how far the farthest corner is: too near for all parts
        away_y: lanes = larger(at.y - under, over - at.y)
        split: cython.int = 255 if group else bits_of(above(at.w, theta2 * (away_x * away_x + away_y * away_y)))
        for lane in range(8):
            taken[lane] = nodes[depth - 8 + lane]
        first: cython.int = cython.cast(cython.int, max(stack + 8 - depth, 0))
        depth = max(depth - 8, stack)
        for lane in range(first, 8):  # without a branch: processors would guess it wrongly
            other: uint32_t = taken[lane]
            parts: cython.int = t.parts[other] if (split & ~far) >> lane & 1 else 0
            nodes[whole + found], nodes[kept + near] = other, other
            found += (far >> lane) & 1
            near += 0 if (far >> lane) & 1 or parts else 1
            for p in range(4):
                nodes[depth + p] = t.part[4 * other + p]
            depth += parts


@kernel
def pull_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Some tasks one after the other."""
    t: cython.pointer(Tree) = cython.cast(cython.pointer(Tree), what)
    g: cython.int
    k: cython.Py_ssize_t
    for g in range(t.tasks * item // t.items, t.tasks * (item + 1) // t.items):
        for k in range(3 * t.begin[t.task[g]], 3 * t.end[t.task[g]]):
            t.pull[k] = 0
        t.found[PLACES * item + LISTS] = 0  # all of the tree
        pull_square(t, item, 1, t.task[g], 1, 0, 0)


@kernel
def pull_all(what: cython.p_void, item: cython.int) -> cython.void:
    """All tasks, by whoever is there."""
    t: cython.pointer(Tree) = cython.cast(cython.pointer(Tree), what)
    team_stage(t.threads, pull_stage, what, t.items)


@kernel
def balance(t: cython.pointer(Tree)) -> cython.void:
    """Take what all forces add up to, which should be nothing, from all by their size: F_i -= |F_i| sum F / sum |F|."""
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


@inlined
def code_of(x: cython.double, place: cython.double) -> uint64_t:
    """Of a coordinate between -1 and 1."""
    return cython.cast(uint64_t, min((x + 1) * place, 2 * place - 1))


def tree_work(count: cython.Py_ssize_t, here):
    """Arrays for a tree over so many particles of this dtype: the system takes longer to give them than the tree to use them."""
    most = 2 * count + 2  # nodes
    floats = (np.empty(n, here) for n in (count + LANES, count + LANES, count + LANES, ITEMS * ROOM, 4 * most, 4 * most))
    sorts = np.empty(4 * most), np.empty(3 * count), np.empty(most, np.uint64), np.empty(most, np.int32)
    found = np.empty(4 * most, np.uint32), np.empty(ITEMS * PLACES, np.uint32)
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
    """As `gravitate`, by a tree; returns the potential energy, J, or 0 if that is not asked for (`energies`).

    All forces together are 0 to rounding. slot: (k,) int32. threads: address of a team of threads, of which so many take part; 0
    is none. work: what `tree_work` has made for so many slots, or None. Who is nowhere, at NaN, feels NaN.
    """
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
    t.begin, t.end, t.parts, t.task = small_integers(a[12]), small_integers(a[13]), small_integers(a[14]), small_integers(a[15])
    tally: cython.pointer(int32_t) = small_integers(a[16])
    t.threads = cython.cast(cython.pointer(thread_team), threads) if threads else team_new(1)
    if t.threads == cython.NULL:
        raise MemoryError
    t.count, t.nodes, t.tasks, t.items, t.energies = 0, 0, 0, ITEMS, energies
    total: cython.double = 0
    largest: cython.double = 0
    unit: cython.double = 1  # m, a power of two
    energy: cython.double = 0
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
