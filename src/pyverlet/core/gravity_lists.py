# mypy: ignore-errors
"""Gravitation by a tree: what particles near each other feel of squares far from all of them, and of what is near, one by one.

A square of size s counts as a whole for a group whose rectangle is at d from its centre of mass if s < theta d: as its mass M
there and its second moments S. With d from a particle to it and R^2 = d^2 + softening^2, from 1/R expanded to second order:

    a = d (M / R^3 - 3/2 tr S / R^5 + 15/2 d S d / R^7) - 3 S d / R^5,    phi = -(M / R - 1/2 tr S / R^3 + 3/2 d S d / R^5)
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import LANES, above, choose, lanes, lanes4, load, real, spread, square_root, store, take4
from cython.cimports.libc.stdint import uint32_t

from pyverlet.core.gravity_tree import Tree
from pyverlet.core.kernels import kernel

LIST = cython.declare(cython.Py_ssize_t, 256)
"""Particles, and squares, that are gathered before they are summed: what fits into the nearest cache."""

ROWS = cython.declare(cython.Py_ssize_t, 10)  # of LIST: x, y and mass of particles; these and four moments of squares
ROOM = cython.declare(cython.Py_ssize_t, 4096)  # ROWS LIST + 3 LANES TARGETS


@kernel
def add_particles(
    t: cython.pointer(Tree), room: cython.Py_ssize_t, n: cython.Py_ssize_t, first: cython.int, stop: cython.int
) -> cython.void:
    """What those gathered do to the particles of a group."""
    zero: lanes = spread(0)
    soft: lanes = spread(t.softening2)
    least: lanes = spread(t.least)
    b: cython.pointer(real) = t.room
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
            if t.energies:
                phi = phi - pull * square
        store(b, sums, ax)
        store(b, sums + LANES, ay)
        store(b, sums + 2 * LANES, phi)


@kernel
def add_squares(
    t: cython.pointer(Tree), room: cython.Py_ssize_t, n: cython.Py_ssize_t, first: cython.int, stop: cython.int
) -> cython.void:
    """What squares gathered do to the particles of a group."""
    one: lanes = spread(1)
    soft: lanes = spread(t.softening2)
    b: cython.pointer(real) = t.room
    at: cython.Py_ssize_t = room + 3 * LIST
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
            fifth: lanes = cube * near
            xy: lanes = load(b, at + 4 * LIST + k)
            sx: lanes = (load(b, at + 3 * LIST + k) * dx + xy * dy) * fifth  # 3 S d / R^5
            sy: lanes = (xy * dx + load(b, at + 5 * LIST + k) * dy) * fifth
            dsd: lanes = sx * dx + sy * dy
            mass: lanes = load(b, at + 2 * LIST + k)
            trace: lanes = load(b, at + 6 * LIST + k) * cube
            pull: lanes = mass * cube + (spread(2.5) * dsd - trace) * near
            ax = ax + (pull * dx - sx)
            ay = ay + (pull * dy - sy)
            if t.energies:
                phi = phi - (mass * once + spread(0.5) * dsd - trace * spread(1.0 / 3.0))
        store(b, sums, ax)
        store(b, sums + LANES, ay)
        store(b, sums + 2 * LANES, phi)


@kernel
def sum_found(
    t: cython.pointer(Tree),
    room: cython.Py_ssize_t,
    whole: cython.Py_ssize_t,
    wholes: cython.Py_ssize_t,
    alone: cython.Py_ssize_t,
    singles: cython.Py_ssize_t,
    first: cython.int,
    stop: cython.int,
) -> cython.void:
    """Sum what squares that count as a whole do to the particles of a group, and the particles of others, from where both are."""
    b: cython.pointer(real) = t.room
    found: cython.pointer(uint32_t) = t.found
    sums: cython.Py_ssize_t = room + ROWS * LIST
    k: cython.Py_ssize_t
    p: cython.int
    n: cython.Py_ssize_t = 0
    for k in range(sums, sums + 3 * LANES * (stop - first)):
        b[k] = 0
    for k in range(alone, alone + singles):
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
    for part in range(whole, whole + wholes, 256):  # LIST
        n = min(LIST, whole + wholes - part)
        for k in range(0, n, 8):
            node: lanes4 = take4(t.node, found, part + k)
            second: lanes4 = take4(t.second, found, part + k)
            store(b, room + 3 * LIST + k, node.x)
            store(b, room + 4 * LIST + k, node.y)
            store(b, room + 5 * LIST + k, node.z)
            store(b, room + 6 * LIST + k, second.x)
            store(b, room + 7 * LIST + k, second.y)
            store(b, room + 8 * LIST + k, second.z)
            store(b, room + 9 * LIST + k, second.w)
        add_squares(t, room, n, first, stop)
    for i in range(first, stop):
        for p in range(3):
            k = sums + LANES * (3 * (i - first) + p)
            t.pull[3 * i + p] += ((b[k] + b[k + 4]) + (b[k + 1] + b[k + 5])) + ((b[k + 2] + b[k + 6]) + (b[k + 3] + b[k + 7]))
