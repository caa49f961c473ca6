# mypy: ignore-errors
"""Gravitation by a tree: what groups of near particles feel of squares that are far for all of them, and of what is near, one by one.

A square of size s counts as a whole for a group whose rectangle is at d from its centre of mass if s < theta d: as its mass M there
and its second moments S. With d from a particle to it and R^2 = d^2 + softening^2, from 1/R expanded to second order:

    a = d (M / R^3 - 3/2 tr S / R^5 + 15/2 d S d / R^7) - 3 S d / R^5,    phi = -(M / R - 1/2 tr S / R^3 + 3/2 d S d / R^5)
"""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_reals, const_small_integers, doubles, indices, reals, small_integers, words
from cython.cimports.lanes import (
    LANES,
    above,
    bits_of,
    choose,
    lanes,
    lanes4,
    larger,
    load,
    real,
    spread,
    square_root,
    store,
    take4,
)
from cython.cimports.libc.math import INFINITY, NAN, fabs, isfinite, sqrt
from cython.cimports.libc.stdint import int32_t, uint32_t, uint64_t
from cython.cimports.team import team_free, team_new, team_run, team_stage, thread_team

from pyverlet.core.gravity_tree import DIGITS, LEVELS, TARGETS, Tree, divide, measure_nodes, sort_codes, spread_bits

LIST = cython.declare(cython.Py_ssize_t, 256)
"""Particles, and squares, that are gathered before they are summed: what fits into the nearest cache."""

ROWS = cython.declare(cython.Py_ssize_t, 9)  # of LIST: x, y and mass of particles; these and second moments of squares
ROOM = cython.declare(cython.Py_ssize_t, 3072)  # ROWS LIST + 3 LANES TARGETS
STACK = cython.declare(cython.Py_ssize_t, 640)
"""Squares to be looked at: eight are taken at a time, and of each level 24 may be left."""

ITEMS = cython.declare(cython.int, 64)
"""Parts that threads share out."""

TINY = cython.declare(cython.double, 1e-290)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def add_particles(
    t: cython.pointer(Tree), room: cython.Py_ssize_t, n: cython.Py_ssize_t, first: cython.int, stop: cython.int
) -> cython.void:
    """What those gathered do to the particles of a group."""
    zero: lanes = spread(0)
    soft: lanes = spread(t.softening2)
    least: lanes = spread(t.least)
    b: cython.pointer(real) = t.room
    k: cython.Py_ssize_t
    i: cython.int
    for k in range(n, (n + 7) // 8 * 8):
        b[room + k], b[room + LIST + k], b[room + 2 * LIST + k] = 0, 0, 0
    for i in range(first, stop):
        x: lanes = spread(t.x[i])
        y: lanes = spread(t.y[i])
        sums: cython.Py_ssize_t = room + ROWS * LIST + 3 * LANES * (i - first)
        ax: lanes = load(b, sums)
        ay: lanes = load(b, sums + LANES)
        phi: lanes = load(b, sums + 2 * LANES)
        for k in range(0, n, 8):
            dx: lanes = load(b, room + k) - x
            dy: lanes = load(b, room + LIST + k) - y
            square: lanes = dx * dx + dy * dy + soft
            cube: lanes = square * square_root(square)
            pull: lanes = choose(above(cube, least), load(b, room + 2 * LIST + k) / cube, zero)
            ax = ax + pull * dx
            ay = ay + pull * dy
            phi = phi - pull * square
        store(b, sums, ax)
        store(b, sums + LANES, ay)
        store(b, sums + 2 * LANES, phi)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def add_squares(
    t: cython.pointer(Tree), room: cython.Py_ssize_t, n: cython.Py_ssize_t, first: cython.int, stop: cython.int
) -> cython.void:
    """What squares gathered do to the particles of a group."""
    one: lanes = spread(1)
    half: lanes = spread(0.5)
    soft: lanes = spread(t.softening2)
    b: cython.pointer(real) = t.room
    at: cython.Py_ssize_t = room + 3 * LIST
    k: cython.Py_ssize_t
    i: cython.int
    for i in range(first, stop):
        x: lanes = spread(t.x[i])
        y: lanes = spread(t.y[i])
        sums: cython.Py_ssize_t = room + ROWS * LIST + 3 * LANES * (i - first)
        ax: lanes = load(b, sums)
        ay: lanes = load(b, sums + LANES)
        phi: lanes = load(b, sums + 2 * LANES)
        for k in range(0, n, 8):
            dx: lanes = load(b, at + k) - x
            dy: lanes = load(b, at + LIST + k) - y
            near: lanes = one / (dx * dx + dy * dy + soft)  # 1 / R^2
            once: lanes = square_root(near)
            cube: lanes = near * once
            xx: lanes = load(b, at + 3 * LIST + k)
            xy: lanes = load(b, at + 4 * LIST + k)
            yy: lanes = load(b, at + 5 * LIST + k)
            sx: lanes = (xx * dx + xy * dy) * (cube * near)  # S d / R^5
            sy: lanes = (xy * dx + yy * dy) * (cube * near)
            dsd: lanes = sx * dx + sy * dy
            monopole: lanes = load(b, at + 2 * LIST + k) * cube
            spread_out: lanes = half * (xx + yy) * cube
            pull: lanes = monopole + spread(3) * (spread(2.5) * dsd - spread_out) * near
            ax = ax + (pull * dx - spread(3) * sx)
            ay = ay + (pull * dy - spread(3) * sy)
            phi = phi - (load(b, at + 2 * LIST + k) * once - spread_out + spread(1.5) * dsd)
        store(b, sums, ax)
        store(b, sums + LANES, ay)
        store(b, sums + 2 * LANES, phi)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def sum_found(
    t: cython.pointer(Tree),
    room: cython.Py_ssize_t,
    stack: cython.Py_ssize_t,
    alone: cython.Py_ssize_t,
    whole: cython.Py_ssize_t,
    first: cython.int,
    stop: cython.int,
) -> cython.void:
    """Gather particles of squares whose particles count, and the squares that count as a whole, and sum."""
    b: cython.pointer(real) = t.room
    found: cython.pointer(uint32_t) = t.found
    k: cython.Py_ssize_t
    p: cython.int
    n: cython.Py_ssize_t = 0
    for k in range(stack + STACK, stack + STACK + alone):
        end: cython.int = t.end[found[k]]
        for p in range(t.begin[found[k]], end, 8):
            store(b, room + n, load(t.x, p))
            store(b, room + LIST + n, load(t.y, p))
            store(b, room + 2 * LIST + n, load(t.m, p))
            n += min(8, end - p)
            if n > LIST - 8:
                add_particles(t, room, n, first, stop)
                n = 0
    add_particles(t, room, n, first, stop)
    at: cython.Py_ssize_t = stack + STACK + LIST
    for k in range(whole, (whole + 7) // 8 * 8):
        found[at + k] = t.nodes
    for k in range(0, whole, 8):
        node: lanes4 = take4(t.node, found, at + k)
        second: lanes4 = take4(t.second, found, at + k)
        store(b, room + 3 * LIST + k, node.x)
        store(b, room + 4 * LIST + k, node.y)
        store(b, room + 5 * LIST + k, node.z)
        store(b, room + 6 * LIST + k, second.x)
        store(b, room + 7 * LIST + k, second.y)
        store(b, room + 8 * LIST + k, second.z)
    add_squares(t, room, whole, first, stop)


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
    team_stage(t.team, pull_stage, what, t.items)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def balance(t: cython.pointer(Tree)) -> cython.void:
    """Take what all forces add up to, which should be nothing, from each in proportion to its size: F_i -= |F_i| sum F / sum |F|."""
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


def gravitate_by_tree(
    force,
    position,
    mass,
    slot,
    strength: cython.double,
    softening: cython.double,
    theta: cython.double,
    team: cython.size_t,
    parts: cython.int,
) -> float:
    """As `gravitate`, by a tree; returns the potential energy, J. All forces together are 0 to rounding.

    slot: (k,) int32. team: address of one, of which so many threads take part; 0 is none. Who is nowhere, at NaN, feels NaN.
    """  # fmt: skip
    f: cython.pointer(real) = reals(force)
    at: cython.pointer[cython.const[real]] = const_reals(position)
    m: cython.pointer[cython.const[real]] = const_reals(mass)
    who: cython.pointer[cython.const[int32_t]] = const_small_integers(slot)
    all_: cython.Py_ssize_t = len(slot)
    most: cython.Py_ssize_t = 2 * all_ + 2  # nodes
    tree: Tree
    t: cython.pointer(Tree) = cython.address(tree)
    here = position.dtype
    x, y, masses, node, second, room = (np.empty(n, here) for n in (*(3 * [all_ + LANES]), 4 * most, 4 * most, ITEMS * ROOM))
    corner, pull, code, order = np.empty(4 * most), np.empty(3 * all_), np.empty(most, np.uint64), np.empty(most, np.int32)
    begin, end, parts_of, group = (np.empty(most, np.int32) for _ in range(4))
    part, found = np.empty(4 * most, np.uint32), np.empty(ITEMS * (STACK + 2 * LIST), np.uint32)
    spare = np.empty(DIGITS + 1, np.int32)
    t.x, t.y, t.m, t.room = reals(x), reals(y), reals(masses), reals(room)
    t.node, t.second, t.corner, t.pull = reals(node), reals(second), doubles(corner), doubles(pull)
    t.code, t.order, t.part, t.found = words(code), small_integers(order), indices(part), indices(found)
    t.begin, t.end, t.parts, t.group = small_integers(begin), small_integers(end), small_integers(parts_of), small_integers(group)
    tally: cython.pointer(int32_t) = small_integers(spare)
    t.team = cython.cast(cython.pointer(thread_team), team) if team else team_new(1)
    if t.team == cython.NULL:
        raise MemoryError
    t.count, t.nodes, t.groups, t.items = 0, 0, 0, ITEMS
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
            place: cython.double = cython.cast(cython.double, 1 << (LEVELS - 1))
            for k in range(t.count):
                i = t.order[k]
                t.code[k] = spread_bits(code_of(at[2 * i] / unit, place)) | (
                    spread_bits(code_of(at[2 * i + 1] / unit, place)) << 1
                )
            sort_codes(t, tally)
            for k in range(t.count):
                i = t.order[k]
                t.x[k], t.y[k] = cython.cast(real, at[2 * i] / unit), cython.cast(real, at[2 * i + 1] / unit)
                t.m[k] = cython.cast(real, m[i] / total)
            divide(t, tally)
            measure_nodes(t)
            t.theta2, t.softening2 = cython.cast(real, theta * theta), cython.cast(real, softening / unit * softening / unit)
            t.least = cython.cast(real, 1e-290 if cython.sizeof(real) == 8 else 1e-37)
            team_run(t.team, pull_all, t, parts)
            balance(t)
            soft: cython.double = sqrt(t.softening2)
            for k in range(t.count):
                i = t.order[k]
                pull_of: cython.double = strength * m[i] * (total / unit / unit)
                f[2 * i] = cython.cast(real, f[2 * i] + pull_of * t.pull[3 * k])
                f[2 * i + 1] = cython.cast(real, f[2 * i + 1] + pull_of * t.pull[3 * k + 1])
                own: cython.double = t.m[k] / soft if soft * soft * soft > t.least else 0  # of itself
                energy += 0.5 * pull_of * unit * (t.pull[3 * k + 2] + own)
        if not team:
            team_free(t.team)
    return energy
