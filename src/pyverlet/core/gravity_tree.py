# mypy: ignore-errors
"""A tree over particles, with mass, centre of mass and second moments of each node (Barnes and Hut 1986).

Particles are sorted along a Hilbert curve, and the leaves are equal parts of that order. Node k has the children 2 k and 2 k + 1;
the root is 1. The size of a node is measured. Lengths are in units of a power of two, which is exact, and masses in units of
their sum, so that float32 neither overflows nor underflows.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY
from cython.cimports.libc.stdint import int32_t, uint64_t
from cython.cimports.team import team_stage, thread_team

from pyverlet.core.kernels import inlined, kernel

COARSE = cython.declare(cython.int, 16)
FINE = cython.declare(cython.int, 32)
"""Bits of a coordinate for sorting: 16, or 32 if more than CROWD particles share a code because some are far away."""

CROWD = cython.declare(cython.Py_ssize_t, 64)

LEAF = cython.declare(cython.Py_ssize_t, 8)
"""Most particles in a leaf."""

BLOCK_OF_TREE = cython.declare(cython.Py_ssize_t, 512)  # particles per work item of a thread

DIGITS = cython.declare(cython.int, 256)  # values of an 8-bit digit, for radix sorting

WIDTH = cython.declare(cython.double, 1.25)
LEAVES = cython.declare(cython.double, 1.9)
THINNEST = cython.declare(cython.double, 7.5)
"""Factor of the square of a node's size, over that of the distance from its centre of mass to its farthest corner. Leaves get
more, as direct sums barely cost more; and so do nodes of particles on a line, where pulls from both sides cancel but errors do
not."""

NODE = cython.declare(cython.Py_ssize_t, 12)
"""Columns of a node: centre of mass, x and y; mass; square of the size; 3 sum of m (x - X)^2, m (x - X) (y - Y), m (y - Y)^2, and
half their trace; bounds, lowest x and y, highest x and y."""

Tree = cython.struct(
    count=cython.Py_ssize_t,
    at=cython.pointer[cython.const[real]],  # (n, 2) m
    mass=cython.pointer[cython.const[real]],  # (n,) kg
    per=cython.double,  # units per metre, and per kilogram
    share=cython.double,
    low_x=cython.double,  # corner of a periodic room, m, and its periods, in units; 0: none
    low_y=cython.double,
    period_x=real,
    period_y=real,
    levels=cython.int,  # COARSE or FINE
    code=cython.pointer(uint64_t),  # (2, count) positions along the curve, and room for sorting
    order=cython.pointer(int32_t),  # (2, count) particle at each place, and room for sorting
    x=cython.pointer(real),  # (count,) in curve order
    y=cython.pointer(real),
    m=cython.pointer(real),
    depth=cython.int,  # of the leaves
    leaves=cython.Py_ssize_t,  # 2^depth
    groups=cython.Py_ssize_t,  # number, and first node, of the groups that share a tree walk
    node=cython.pointer(real),  # (2 leaves, NODE)
    theta2=real,
    softening2=real,
    energies=cython.bint,  # whether the potential is wanted
    least=real,  # smaller cubes of distances count as 0
    closest=real,  # smallest squared size whose fifth inverse power of the distance is finite in this precision
    pull=cython.pointer(cython.double),  # (count, 3) acceleration and potential, in curve order
    threads=cython.pointer(thread_team),
)


@inlined
def step_of(x: cython.double, levels: cython.int) -> uint64_t:
    """Grid index of a coordinate between -1 and 1."""
    one: uint64_t = 1
    half: cython.double = cython.cast(cython.double, one << (levels - 1))
    return cython.cast(uint64_t, min((x + 1) * half, 2 * half - 1))


@kernel
def code_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Compute the positions along the curve of a block of particles."""
    t: cython.pointer(Tree) = cython.cast(cython.pointer(Tree), what)
    none: uint64_t = 0
    level: cython.int
    for k in range(BLOCK_OF_TREE * item, min(BLOCK_OF_TREE * (item + 1), t.count)):
        x: uint64_t = step_of(t.at[2 * t.order[k]] * t.per, t.levels)
        y: uint64_t = step_of(t.at[2 * t.order[k] + 1] * t.per, t.levels)
        code: uint64_t = 0
        for level in range(t.levels - 1, -1, -1):
            right: uint64_t = (x >> level) & 1
            over: uint64_t = (y >> level) & 1
            code = (code << 2) | ((3 * right) ^ over)
            turned: uint64_t = none - (right & ~over)
            swapped: uint64_t = (x ^ y) & (over - 1)
            x, y = x ^ swapped ^ turned, y ^ swapped ^ turned
        t.code[k] = code


@kernel
def sort_codes(t: cython.pointer(Tree)) -> cython.bint:
    """Stable radix sort of codes and order, by digits of 8 bits; returns whether many are equal."""
    n: cython.Py_ssize_t = t.count
    tally: int32_t[257]
    turn: cython.int
    d: cython.int
    for turn in range(t.levels // 4):
        here: cython.Py_ssize_t = n * (turn % 2)
        there: cython.Py_ssize_t = n - here
        shift: cython.int = 8 * turn
        for d in range(DIGITS + 1):
            tally[d] = 0
        for k in range(n):
            d = cython.cast(cython.int, (t.code[here + k] >> shift) & 255)
            tally[d + 1] += 1
        for d in range(DIGITS):
            tally[d + 1] += tally[d]
        for k in range(n):
            d = cython.cast(cython.int, (t.code[here + k] >> shift) & 255)
            t.code[there + tally[d]] = t.code[here + k]
            t.order[there + tally[d]] = t.order[here + k]
            tally[d] += 1
    crowded: cython.bint = False
    for k in range(CROWD, n):
        crowded |= t.code[k] == t.code[k - CROWD]
    return crowded


@kernel
def sort_bodies(t: cython.pointer(Tree)) -> cython.void:
    """Sort particles along the curve, to fine squares if many share a coarse one."""
    blocks: cython.int = cython.cast(cython.int, (t.count + BLOCK_OF_TREE - 1) // BLOCK_OF_TREE)
    t.levels = COARSE
    team_stage(t.threads, code_stage, t, blocks)
    if sort_codes(t):
        t.levels = FINE
        team_stage(t.threads, code_stage, t, blocks)
        sort_codes(t)


@inlined
def leaf_begin(t: cython.pointer(Tree), leaf: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """First particle of a leaf."""
    return (leaf * t.count) >> t.depth


@kernel
def measure_node(t: cython.pointer(Tree), k: cython.Py_ssize_t) -> cython.void:
    """Compute mass, centre, second moments, size and bounds of a node from its children.

    With children of mass m at d from some point, and moments s about their own centres, S = sum of s + m d d about the point,
    and S - 2 D sum of m d + M D D about another point at D from it (Huygens and Steiner).
    """
    is_leaf: cython.bint = k >= t.leaves
    begin: cython.Py_ssize_t = leaf_begin(t, k - t.leaves) if is_leaf else 2 * k
    end: cython.Py_ssize_t = leaf_begin(t, k - t.leaves + 1) if is_leaf else 2 * k + 2
    n: cython.pointer(real) = t.node
    to: cython.Py_ssize_t = NODE * k
    near_x: cython.double = t.x[begin] if is_leaf else n[NODE * begin]
    near_y: cython.double = t.y[begin] if is_leaf else n[NODE * begin + 1]
    low_x: cython.double = INFINITY
    low_y: cython.double = INFINITY
    high_x: cython.double = -INFINITY
    high_y: cython.double = -INFINITY
    mass: cython.double = 0
    x: cython.double = 0
    y: cython.double = 0
    xx: cython.double = 0
    xy: cython.double = 0
    yy: cython.double = 0
    p: cython.Py_ssize_t
    for p in range(begin, end):
        of: cython.Py_ssize_t = NODE * p
        if is_leaf:
            m: cython.double = t.m[p]
            dx: cython.double = t.x[p] - near_x
            dy: cython.double = t.y[p] - near_y
            low_x, low_y, high_x, high_y = min(low_x, t.x[p]), min(low_y, t.y[p]), max(high_x, t.x[p]), max(high_y, t.y[p])
        else:
            m, dx, dy = n[of + 2], n[of] - near_x, n[of + 1] - near_y
            xx, xy, yy = xx + n[of + 4] / 3, xy + n[of + 5] / 3, yy + n[of + 6] / 3
            low_x, low_y = min(low_x, n[of + 8]), min(low_y, n[of + 9])
            high_x, high_y = max(high_x, n[of + 10]), max(high_y, n[of + 11])
        mass, x, y = mass + m, x + m * dx, y + m * dy
        xx, xy, yy = xx + m * dx * dx, xy + m * dx * dy, yy + m * dy * dy
    n[to], n[to + 1] = cython.cast(real, near_x + x / mass), cython.cast(real, near_y + y / mass)
    dx, dy = n[to] - near_x, n[to + 1] - near_y
    xx, yy = 3 * (xx - 2 * dx * x + mass * dx * dx), 3 * (yy - 2 * dy * y + mass * dy * dy)
    xy = 3 * (xy - dx * y - dy * x + mass * dx * dy)
    wide: cython.double = max(high_x - n[to], n[to] - low_x)
    high: cython.double = max(high_y - n[to + 1], n[to + 1] - low_y)
    # The anisotropy of the moments to the 32nd power: 1 for a line, and 1e-3 if three times as long as wide.
    thin: cython.double = ((xx - yy) * (xx - yy) + 4 * xy * xy) / ((xx + yy) * (xx + yy)) if xx + yy > 0 else 0
    thin = thin * thin * thin * thin
    thin = thin * thin * thin * thin
    size: cython.double = WIDTH + THINNEST * thin + (LEAVES if is_leaf else 0)
    n[to + 2], n[to + 3] = cython.cast(real, mass), cython.cast(real, max(size * (wide * wide + high * high), t.closest))
    n[to + 4], n[to + 5], n[to + 6] = cython.cast(real, xx), cython.cast(real, xy), cython.cast(real, yy)
    n[to + 7] = cython.cast(real, 0.5 * (xx + yy))
    n[to + 8], n[to + 9] = cython.cast(real, low_x), cython.cast(real, low_y)
    n[to + 10], n[to + 11] = cython.cast(real, high_x), cython.cast(real, high_y)
