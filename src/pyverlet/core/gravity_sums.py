# mypy: ignore-errors
"""Gravitation by a tree: groups of particles interact with distant nodes as a whole and with near particles one by one.

A node of size s counts as a whole for a group whose rectangle is at d from its centre of mass if s < theta d: as its mass M
there and its second moments S. With d from a particle to it and R^2 = d^2 + softening^2, from 1/R expanded to second order:

    a = d (M / R^3 - 3/2 tr S / R^5 + 15/2 d S d / R^7) - 3 S d / R^5,    phi = -(M / R - 1/2 tr S / R^3 + 3/2 d S d / R^5)

With theta = 0 no node does: all pairs are summed. In a periodic room the nearest images are used, and theta must be 0.
"""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_reals, const_small_integers, doubles, reals, small_integers, words
from cython.cimports.lanes import LANES, above, choose, lanes, load, real, spread, square_root, store
from cython.cimports.libc.math import INFINITY, NAN, fabs, isfinite, sqrt
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import team_run, team_stage, thread_team

from pyverlet.core.gravity_tree import LEAF, NODE, Tree, leaf_begin, measure_node, sort_bodies
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.periodic import wrapped

GROUP = cython.declare(cython.Py_ssize_t, 8)
"""Leaves per group, the particles of which share a tree walk."""

TINY = cython.declare(cython.double, 1e-140)
"""m, smallest unit of length: its square must not underflow."""


@inlined
def nearest_lanes(d: lanes, period: real) -> lanes:
    """Nearest images of coordinate differences inside a periodic room."""
    whole: lanes = spread(period)
    half: lanes = spread(cython.cast(real, 0.5) * period if period > 0 else cython.cast(real, INFINITY))
    return choose(above(d, half), d - whole, choose(above(spread(0) - half, d), d + whole, d))


@inlined
def add_leaf(
    t: cython.pointer(Tree), leaf: cython.Py_ssize_t, s: cython.pointer(real), first: cython.Py_ssize_t, stop: cython.Py_ssize_t
) -> cython.void:
    """Add the effect of a leaf's particles on those of a group, eight at a time. s: (, 3, 8) accelerations and potentials."""
    zero: lanes = spread(0)
    soft: lanes = spread(t.softening2)
    least: lanes = spread(t.least)
    periodic: cython.bint = t.period_x > 0 or t.period_y > 0
    begin: cython.Py_ssize_t = leaf_begin(t, leaf)
    end: cython.Py_ssize_t = leaf_begin(t, leaf + 1)
    for i in range(first, stop, 8):
        k: cython.Py_ssize_t = 3 * (i - first)
        x: lanes = load(t.x, i)
        y: lanes = load(t.y, i)
        ax: lanes = load(s, k)
        ay: lanes = load(s, k + 8)
        phi: lanes = load(s, k + 16)
        for p in range(begin, end):
            dx: lanes = spread(t.x[p]) - x
            dy: lanes = spread(t.y[p]) - y
            if periodic:
                dx, dy = nearest_lanes(dx, t.period_x), nearest_lanes(dy, t.period_y)
            square: lanes = dx * dx + dy * dy + soft
            cube: lanes = square * square_root(square)
            pull: lanes = choose(above(cube, least), spread(t.m[p]) / cube, zero)
            ax = ax + pull * dx
            ay = ay + pull * dy
            if t.energies:
                phi = phi - pull * square
        store(s, k, ax)
        store(s, k + 8, ay)
        store(s, k + 16, phi)


@inlined
def add_node(
    t: cython.pointer(Tree), node: cython.Py_ssize_t, s: cython.pointer(real), first: cython.Py_ssize_t, stop: cython.Py_ssize_t
) -> cython.void:
    """Add the effect of a node on the particles of a group."""
    n: cython.pointer(real) = t.node
    at: cython.Py_ssize_t = NODE * node
    soft: lanes = spread(t.softening2)
    mass: lanes = spread(n[at + 2])
    for i in range(first, stop, 8):
        k: cython.Py_ssize_t = 3 * (i - first)
        dx: lanes = spread(n[at]) - load(t.x, i)
        dy: lanes = spread(n[at + 1]) - load(t.y, i)
        near: lanes = spread(1) / (dx * dx + dy * dy + soft)  # 1 / R^2
        once: lanes = square_root(near)
        cube: lanes = near * once
        fifth: lanes = cube * near
        sx: lanes = (spread(n[at + 4]) * dx + spread(n[at + 5]) * dy) * fifth  # 3 S d / R^5
        sy: lanes = (spread(n[at + 5]) * dx + spread(n[at + 6]) * dy) * fifth
        dsd: lanes = sx * dx + sy * dy
        trace: lanes = spread(n[at + 7]) * cube
        pull: lanes = mass * cube + (spread(2.5) * dsd - trace) * near
        store(s, k, load(s, k) + (pull * dx - sx))
        store(s, k + 8, load(s, k + 8) + (pull * dy - sy))
        if t.energies:
            store(s, k + 16, load(s, k + 16) - (mass * once + spread(0.5) * dsd - trace * spread(1.0 / 3.0)))


@kernel
def pull_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Walk through the tree for one group."""
    t: cython.pointer(Tree) = cython.cast(cython.pointer(Tree), what)
    s: real[192]  # 3 GROUP LEAF
    stack: cython.Py_ssize_t[64]
    size: cython.Py_ssize_t = t.leaves // t.groups
    first: cython.Py_ssize_t = leaf_begin(t, size * item)
    stop: cython.Py_ssize_t = leaf_begin(t, size * (item + 1))
    n: cython.pointer(real) = t.node
    own: cython.Py_ssize_t = NODE * (t.groups + item)
    zero: real = 0
    p: cython.Py_ssize_t
    depth: cython.Py_ssize_t = 1
    stack[0] = 1
    for p in range(192):
        s[p] = 0
    while depth > 0:
        depth -= 1
        k: cython.Py_ssize_t = stack[depth]
        at: cython.Py_ssize_t = NODE * k
        dx: real = max(max(n[own + 8] - n[at], n[at] - n[own + 10]), zero)
        dy: real = max(max(n[own + 9] - n[at + 1], n[at + 1] - n[own + 11]), zero)
        if t.theta2 * (dx * dx + dy * dy) > n[at + 3]:
            add_node(t, k, s, first, stop)
        elif k < t.leaves:
            stack[depth], stack[depth + 1] = 2 * k + 1, 2 * k
            depth += 2
        else:
            add_leaf(t, k - t.leaves, s, first, stop)
    for p in range(stop - first):
        for k in range(3):
            t.pull[3 * (first + p) + k] = s[24 * (p // 8) + 8 * k + p % 8]


@kernel
def balance(t: cython.pointer(Tree)) -> cython.void:
    """Remove the sum of all forces, which should be zero, from each in proportion to its size: F_i -= |F_i| sum F / sum |F|."""
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


@kernel
def pull_all(what: cython.p_void, item: cython.int) -> cython.void:
    """Build the tree and sum for all groups, with all threads of the team."""
    t: cython.pointer(Tree) = cython.cast(cython.pointer(Tree), what)
    k: cython.Py_ssize_t
    sort_bodies(t)
    for k in range(t.count):
        i: cython.Py_ssize_t = t.order[k]
        t.x[k] = cython.cast(real, wrapped(t.at[2 * i], t.low_x, t.period_x / t.per) * t.per)
        t.y[k] = cython.cast(real, wrapped(t.at[2 * i + 1], t.low_y, t.period_y / t.per) * t.per)
        t.m[k] = cython.cast(real, t.mass[i] * t.share)
    t.depth, t.leaves = 0, 1
    while LEAF * t.leaves < t.count:
        t.depth, t.leaves = t.depth + 1, 2 * t.leaves
    t.groups = max(t.leaves // GROUP, 1)
    for k in range(2 * t.leaves - 1, 0, -1):
        measure_node(t, k)
    team_stage(t.threads, pull_stage, what, cython.cast(cython.int, t.groups))
    balance(t)


def gravitate(
    force, position, mass, sorted_index, strength: cython.double, softening: cython.double, theta: cython.double, periodic,
    threads: cython.size_t, parts: cython.int, work=None, energies: cython.bint = True,
) -> float:  # fmt: skip
    """Attraction between all pairs of the particles in these rows: F = strength m_i m_j d / (|d|^2 + softening^2)^(3/2).

    Returns the potential energy, J, or 0 unless `energies`. The forces sum to 0, rounded. sorted_index: (k,) int32. periodic:
    lowest x and y and periods of the room, m. threads, parts: address of a thread team and the number of threads to use; 0 for
    none. work: a list that keeps arrays between calls, as allocating takes longer than using them. Particles at NaN get NaN;
    pinned ones get no force.
    """
    f: cython.pointer(real) = reals(force)
    which: cython.pointer[cython.const[int32_t]] = const_small_integers(sorted_index)
    all_: cython.Py_ssize_t = len(sorted_index)
    tree: Tree
    t: cython.pointer(Tree) = cython.address(tree)
    a = [] if work is None else work
    if not a or a[0].dtype != position.dtype or len(a[6]) < 2 * all_:
        leaves = 1
        while LEAF * leaves < all_:
            leaves *= 2
        a[:] = [np.empty(n, position.dtype) for n in (all_ + LANES, all_ + LANES, all_ + LANES, 2 * leaves * NODE)]
        a += [np.empty(3 * all_), np.empty(2 * all_, np.uint64), np.empty(2 * all_, np.int32)]
    t.x, t.y, t.m, t.node, t.pull = reals(a[0]), reals(a[1]), reals(a[2]), reals(a[3]), doubles(a[4])
    t.code, t.order, t.at, t.mass = words(a[5]), small_integers(a[6]), const_reals(position), const_reals(mass)
    at: cython.pointer[cython.const[real]] = t.at
    m: cython.pointer[cython.const[real]] = t.mass
    t.threads = cython.cast(cython.pointer(thread_team), threads)
    t.count, t.energies = 0, energies
    corner = np.array(periodic, float)
    span: cython.pointer[cython.const[cython.double]] = const_doubles(corner)
    total: cython.double = 0
    largest: cython.double = 0
    unit: cython.double = 1  # m, a power of two
    energy: cython.double = 0
    i: cython.Py_ssize_t
    with cython.nogil:
        for k in range(all_):
            i = which[k]
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
            t.per, t.share = 1 / unit, 1 / total
            t.low_x, t.low_y = span[0], span[1]
            t.period_x, t.period_y = cython.cast(real, span[2] * t.per), cython.cast(real, span[3] * t.per)
            t.theta2, t.softening2 = cython.cast(real, theta * theta), cython.cast(real, softening / unit * softening / unit)
            t.least = cython.cast(real, 1e-290 if cython.sizeof(real) == 8 else 1e-37)
            t.closest = cython.cast(real, 1e-110 if cython.sizeof(real) == 8 else 1e-14)
            team_run(t.threads, pull_all, t, parts)
            soft: cython.double = sqrt(t.softening2)
            itself: cython.double = 1 / soft if soft * soft * soft > t.least else 0  # self-potential of each particle
            scale: cython.double = strength * (total * t.per * t.per)
            for k in range(t.count):
                i = t.order[k]
                pull_of: cython.double = scale * m[i]
                f[2 * i] = cython.cast(real, f[2 * i] + pull_of * t.pull[3 * k])
                f[2 * i + 1] = cython.cast(real, f[2 * i + 1] + pull_of * t.pull[3 * k + 1])
                energy += pull_of * (t.pull[3 * k + 2] + itself * t.m[k])
    return 0.5 * unit * energy if energies else 0.0
