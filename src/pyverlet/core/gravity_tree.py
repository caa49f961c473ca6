# mypy: ignore-errors
"""A tree of squares over particles, with the mass, its centre and the second moments of each (Barnes and Hut 1986).

Particles are sorted by the Morton code of their place, so that a square is a range of them. One with a single part is left
out: so there are fewer squares than twice the particles, however close to each other these are. Lengths are in units of a power
of two, which rounds nothing, and masses in units of their sum: float32 neither overflows nor underflows by the choice of units.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, uint32_t, uint64_t
from cython.cimports.team import thread_team

from pyverlet.core.kernels import inlined, kernel

LEVELS = cython.declare(cython.int, 21)
"""Squares of 2^-21 of the whole are not divided, whatever is in them."""

LEAF = cython.declare(cython.int, 16)
"""Squares with at most so many particles are not divided."""

TARGETS = cython.declare(cython.int, 64)
"""Most particles that are summed for together."""

TASKS = cython.declare(cython.int, 64)
"""Squares with at most this part of all particles are what threads share out."""

DIGITS = cython.declare(cython.int, 2048)  # of 11 bits, by which codes are sorted: four times

WIDTH = cython.declare(cython.double, 1.17)
"""Times the distance from its centre of mass to its farthest corner, that is how large a square counts as."""

LEAF_WIDTH = cython.declare(cython.double, 1.15)
"""The same for squares of few particles, times WIDTH: to sum these one by one takes barely longer."""

Tree = cython.struct(
    count=cython.Py_ssize_t,
    code=cython.pointer(uint64_t),  # (2, count) Morton codes, and room to sort them
    order=cython.pointer(int32_t),  # (2, count) which particle stands at a place, and room to sort
    x=cython.pointer(real),  # (count,) in the order of the codes
    y=cython.pointer(real),
    m=cython.pointer(real),
    nodes=cython.int,  # in the order of the codes, each before its parts
    begin=cython.pointer(int32_t),  # (nodes,) its first particle, and the one after its last
    end=cython.pointer(int32_t),
    parts=cython.pointer(int32_t),  # how many parts it has, 0 to 4, and which
    part=cython.pointer(uint32_t),  # (nodes, 4)
    node=cython.pointer(real),  # (nodes + 1, 4) centre of mass, x and y, mass, and square of its size; the last one is empty
    second=cython.pointer(real),  # (nodes + 1, 4) 3 sum of m (x - X)^2, m (x - X) (y - Y), m (y - Y)^2; half their trace
    corner=cython.pointer(cython.double),  # (nodes, 4) the rectangle: lowest x and y, highest x and y
    tasks=cython.int,
    task=cython.pointer(int32_t),  # (tasks,) nodes
    theta2=real,
    softening2=real,
    energies=cython.bint,  # whether the potential is asked for, which the accelerations do not need
    least=real,  # cubes of distances below count as none
    items=cython.int,
    room=cython.pointer(real),  # (items, ROOM) and (items, PLACES), see `core.gravity_sums`
    found=cython.pointer(uint32_t),
    pull=cython.pointer(cython.double),  # (count, 3) acceleration and potential, at the place in the order
    threads=cython.pointer(thread_team),
)


@inlined
def spread_bits(n: uint64_t) -> uint64_t:
    """Bits 0 to 20 at the even places."""
    words_: uint64_t = 0x0000FFFF0000FFFF
    octets_: uint64_t = 0x00FF00FF00FF00FF
    fours: uint64_t = 0x0F0F0F0F0F0F0F0F
    pairs: uint64_t = 0x3333333333333333
    singles_: uint64_t = 0x5555555555555555
    n = (n | (n << 16)) & words_
    n = (n | (n << 8)) & octets_
    n = (n | (n << 4)) & fours
    n = (n | (n << 2)) & pairs
    return (n | (n << 1)) & singles_


@kernel
def sort_codes(t: cython.pointer(Tree), tally: cython.pointer(int32_t)) -> cython.void:
    """Sort codes and order by digits of 11 bits, the lowest first; equal codes stay in the order of the particles."""
    n: cython.Py_ssize_t = t.count
    turn: cython.int
    d: cython.int
    for turn in range(4):
        here: cython.Py_ssize_t = n * (turn % 2)
        there: cython.Py_ssize_t = n - here
        shift: cython.int = 11 * turn
        for d in range(DIGITS + 1):
            tally[d] = 0
        for k in range(n):
            d = cython.cast(cython.int, (t.code[here + k] >> shift) & 2047)
            tally[d + 1] += 1
        for d in range(DIGITS):
            tally[d + 1] += tally[d]
        for k in range(n):
            d = cython.cast(cython.int, (t.code[here + k] >> shift) & 2047)
            t.code[there + tally[d]] = t.code[here + k]
            t.order[there + tally[d]] = t.order[here + k]
            tally[d] += 1


@inlined
def first_with(t: cython.pointer(Tree), begin: cython.int, end: cython.int, bit: cython.int) -> cython.int:
    """The first of these places whose code has this bit; all have the same bits above it."""
    while begin < end:
        middle: cython.int = (begin + end) // 2
        if (t.code[middle] >> bit) & 1:
            end = middle
        else:
            begin = middle + 1
    return begin


@kernel
def divide(t: cython.pointer(Tree), stack: cython.pointer(int32_t)) -> cython.void:
    """Make the nodes, each before its parts, and the tasks. stack: (3 LEVELS + 1, 4)."""
    depth: cython.int = 1
    quarter: cython.int
    k: cython.int
    cut: cython.int[5]
    # First place, the one after the last, whether in a task, and the node it is part of.
    stack[0], stack[1], stack[2], stack[3] = 0, cython.cast(int32_t, t.count), 0, -1
    while depth > 0:
        depth -= 1
        begin: cython.int = stack[4 * depth]
        end: cython.int = stack[4 * depth + 1]
        tasked: cython.int = stack[4 * depth + 2]
        whole: cython.int = stack[4 * depth + 3]
        node: cython.int = t.nodes
        t.nodes = node + 1
        t.begin[node], t.end[node], t.parts[node] = begin, end, 0
        for k in range(4):
            t.part[4 * node + k] = 0
        if whole >= 0:
            t.part[4 * whole + t.parts[whole]] = node
            t.parts[whole] += 1
        differing: uint64_t = t.code[begin] ^ t.code[end - 1]
        leaf: cython.bint = end - begin <= LEAF or differing == 0
        if not tasked and (leaf or (end - begin) * TASKS <= t.count):
            tasked = 1
            t.task[t.tasks] = node
            t.tasks += 1
        if leaf:
            continue
        bit: cython.int = 0  # the higher bit of the highest pair in which they differ
        while differing >> (bit + 2) > 0:
            bit += 2
        bit += 1
        cut[0], cut[4] = begin, end
        cut[2] = first_with(t, begin, end, bit)
        cut[1] = first_with(t, begin, cut[2], bit - 1)
        cut[3] = first_with(t, cut[2], end, bit - 1)
        for quarter in range(3, -1, -1):
            if cut[quarter] < cut[quarter + 1]:
                stack[4 * depth], stack[4 * depth + 1] = cut[quarter], cut[quarter + 1]
                stack[4 * depth + 2], stack[4 * depth + 3] = tasked, node
                depth += 1


@kernel
def measure_nodes(t: cython.pointer(Tree)) -> cython.void:
    """Mass, its centre, second moments and size of all nodes, parts before wholes.

    Of parts with mass m at d from some point and moments s about their own centres it is S = sum of s + m d d about the point,
    and S - 2 D sum of m d + M D D about another one at D from it (Huygens and Steiner).
    """
    k: cython.int
    p: cython.int
    for k in range(t.nodes - 1, -1, -1):
        leaf: cython.bint = t.parts[k] == 0
        count: cython.int = t.end[k] - t.begin[k] if leaf else t.parts[k]
        near_x: cython.double = t.x[t.begin[k]]
        near_y: cython.double = t.y[t.begin[k]]
        low_x: cython.double = near_x
        low_y: cython.double = near_y
        high_x: cython.double = near_x
        high_y: cython.double = near_y
        mass: cython.double = 0
        x: cython.double = 0
        y: cython.double = 0
        xx: cython.double = 0
        xy: cython.double = 0
        yy: cython.double = 0
        if leaf:
            for p in range(t.begin[k], t.end[k]):
                m: cython.double = t.m[p]
                dx: cython.double = t.x[p] - near_x
                dy: cython.double = t.y[p] - near_y
                low_x, high_x = min(low_x, t.x[p]), max(high_x, t.x[p])
                low_y, high_y = min(low_y, t.y[p]), max(high_y, t.y[p])
                mass, x, y = mass + m, x + m * dx, y + m * dy
                xx, xy, yy = xx + m * dx * dx, xy + m * dx * dy, yy + m * dy * dy
        else:
            for p in range(count):
                part: cython.Py_ssize_t = 4 * t.part[4 * k + p]
                m = t.node[part + 2]
                dx = t.node[part] - near_x
                dy = t.node[part + 1] - near_y
                low_x, high_x = min(low_x, t.corner[part]), max(high_x, t.corner[part + 2])
                low_y, high_y = min(low_y, t.corner[part + 1]), max(high_y, t.corner[part + 3])
                mass, x, y = mass + m, x + m * dx, y + m * dy
                xx, xy = xx + t.second[part] / 3 + m * dx * dx, xy + t.second[part + 1] / 3 + m * dx * dy
                yy += t.second[part + 2] / 3 + m * dy * dy
        center_x: real = cython.cast(real, near_x + x / mass)
        center_y: real = cython.cast(real, near_y + y / mass)
        dx = center_x - near_x
        dy = center_y - near_y
        t.corner[4 * k], t.corner[4 * k + 1], t.corner[4 * k + 2], t.corner[4 * k + 3] = low_x, low_y, high_x, high_y
        wide: cython.double = WIDTH * max(high_x - center_x, center_x - low_x)
        high: cython.double = WIDTH * max(high_y - center_y, center_y - low_y)
        size: cython.double = LEAF_WIDTH * LEAF_WIDTH if leaf and count <= LEAF else 1.0
        t.node[4 * k], t.node[4 * k + 1], t.node[4 * k + 2] = center_x, center_y, cython.cast(real, mass)
        t.node[4 * k + 3] = cython.cast(real, size * (wide * wide + high * high))
        t.second[4 * k] = cython.cast(real, 3 * (xx - 2 * dx * x + mass * dx * dx))
        t.second[4 * k + 1] = cython.cast(real, 3 * (xy - dx * y - dy * x + mass * dx * dy))
        t.second[4 * k + 2] = cython.cast(real, 3 * (yy - 2 * dy * y + mass * dy * dy))
        t.second[4 * k + 3] = cython.cast(real, 0.5 * (t.second[4 * k] + t.second[4 * k + 2]))
    for p in range(4):
        t.node[4 * t.nodes + p], t.second[4 * t.nodes + p] = 0, 0
    t.node[4 * t.nodes] = 4
