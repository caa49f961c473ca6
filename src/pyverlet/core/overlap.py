# mypy: ignore-errors
"""Which pairs of particles overlap, and how far. A period is that of a room, m; 0 for none."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_indices, const_integers, const_octets, const_reals, doubles, integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, ceil, floor, isfinite, ldexp, log2, sqrt
from cython.cimports.libc.stdint import int64_t, uint8_t, uint32_t, uint64_t
from cython.cimports.team import team_free, team_new, team_run, team_stage, thread_team

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.periodic import nearest_in_double

FINEST_CELL = cython.declare(int64_t, -100)
CELL_LEVELS = cython.declare(int64_t, 200)
"""Exponents of the smallest cells of `touching`, whose width is a power of two, m, and how many there are."""


def overlaps(position, radius, period_x: cython.double, period_y: cython.double, pairs):
    """(number, sum and maximum of depth / (r_i + r_j)) of the pairs (k,), see `touching`, that touch, in float64."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    pair: cython.pointer[cython.const[int64_t]] = const_integers(pairs)
    count: int64_t = len(radius)
    number: int64_t = 0
    total: cython.double = 0.0
    largest: cython.double = 0.0
    for k in range(len(pairs)):
        i: int64_t = pair[k] // count
        j: int64_t = pair[k] - i * count
        dx: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * j]) - x[2 * i], period_x)
        dy: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * j + 1]) - x[2 * i + 1], period_y)
        depth: cython.double = 1.0 - sqrt(dx * dx + dy * dy) / (cython.cast(cython.double, r[i]) + r[j])
        if depth > 0.0:
            number += 1
            total += depth
            largest = max(largest, depth)
    return number, total, largest


@inlined
def place_of(column: int64_t, row: int64_t, level: int64_t, size: int64_t) -> int64_t:
    """Where the list of a cell begins in a table of `size`, a power of two."""
    mixed: uint64_t = cython.cast(uint64_t, column) * 73856093
    mixed ^= cython.cast(uint64_t, row) * 19349663
    mixed ^= cython.cast(uint64_t, level) * 83492791
    return cython.cast(int64_t, (mixed ^ (mixed >> 15)) & cython.cast(uint64_t, size - 1))


@inlined
def cell_along(x: cython.double, scale: cython.double) -> int64_t:
    """The cell along one axis; scale: 1 over the width of cells, a power of two, so that the product is exact."""
    return cython.cast(int64_t, floor(x * scale))


Search = cython.struct(
    count=int64_t,
    position=cython.pointer[cython.const[real]],
    radius=cython.pointer[cython.const[real]],
    fixed=cython.pointer[cython.const[uint8_t]],
    category=cython.pointer[cython.const[uint32_t]],
    mask=cython.pointer[cython.const[uint32_t]],
    images=int64_t,
    image=cython.pointer[cython.const[cython.double]],
    level=cython.pointer(int64_t),  # (count,) whose cells each circle stands in, -1: in none
    scale=cython.pointer(cython.double),  # (CELL_LEVELS,) 1 over the width of the cells of each level, 1/m; 0 of unused ones
    highest=int64_t,
    size=int64_t,  # of the table of cells
    head=cython.pointer(int64_t),
    following=cython.pointer(int64_t),
    widest=cython.double,
    x0=cython.double,  # of all centres, m
    y0=cython.double,
    x1=cython.double,
    y1=cython.double,
    items=cython.int,  # parts of the circles, of so many each
    together=int64_t,
    room=int64_t,  # for the pairs of each
    pairs=cython.pointer(int64_t),
    found=cython.pointer(int64_t),
    threads=cython.pointer(thread_team),
)


@kernel
def put_in_cells(f: cython.pointer(Search)) -> cython.void:
    """Each circle stands in one cell of the level whose cells are wider than it is."""
    f.highest, f.widest = -1, 0.0
    f.x0, f.y0, f.x1, f.y1 = INFINITY, INFINITY, -INFINITY, -INFINITY
    for i in range(f.size):
        f.head[i] = -1
    for i in range(f.count):
        x: cython.double = f.position[2 * i]
        y: cython.double = f.position[2 * i + 1]
        f.level[i] = -1
        if not isfinite(x + y):
            continue
        own: int64_t = cython.cast(int64_t, ceil(log2(2.0 * cython.cast(cython.double, f.radius[i])))) - FINEST_CELL
        own = min(max(own, 0), CELL_LEVELS - 1)
        f.level[i], f.highest = own, max(f.highest, own)
        f.scale[own] = ldexp(1.0, cython.cast(cython.int, -(own + FINEST_CELL)))
        f.widest = max(f.widest, cython.cast(cython.double, f.radius[i]))
        f.x0, f.y0, f.x1, f.y1 = min(f.x0, x), min(f.y0, y), max(f.x1, x), max(f.y1, y)
        slot: int64_t = place_of(cell_along(x, f.scale[own]), cell_along(y, f.scale[own]), own, f.size)
        f.following[i], f.head[slot] = f.head[slot], i


@inlined
def look_around(f: cython.pointer(Search), i: int64_t, s: int64_t, level: int64_t, item: int64_t) -> cython.void:
    """Circle i, at an image of it, against those in the cells around it of a level that is no finer than its own.

    In its own level a half of them, so that each pair is found once.
    """
    x: cython.double = f.position[2 * i] + f.image[2 * s]
    y: cython.double = f.position[2 * i + 1] + f.image[2 * s + 1]
    half: cython.bint = s == 0 and level == f.level[i]
    left: int64_t = cell_along(x, f.scale[level]) - 1
    below: int64_t = cell_along(y, f.scale[level]) - 1
    around: int64_t
    for around in range(4 if half else 0, 9):
        column: int64_t = left + around % 3
        row: int64_t = below + around // 3
        following: int64_t = f.head[place_of(column, row, level, f.size)]
        while following >= 0:
            j: int64_t = following
            following = f.following[j]
            if f.level[j] != level or (j <= i and level == f.level[i] and (around == 4 or not half)):
                continue
            dx: cython.double = x - f.position[2 * j]
            dy: cython.double = y - f.position[2 * j + 1]
            reach: cython.double = cython.cast(cython.double, f.radius[i]) + f.radius[j]
            if not dx * dx + dy * dy < reach * reach:
                continue
            cell: int64_t = cell_along(f.position[2 * j], f.scale[level])
            if cell != column or cell_along(f.position[2 * j + 1], f.scale[level]) != row:
                continue  # of another cell with the same place in the table
            if (f.fixed[i] and f.fixed[j]) or not (f.category[i] & f.mask[j] and f.category[j] & f.mask[i]):
                continue
            if f.found[item] < f.room:
                f.pairs[item * f.room + f.found[item]] = min(i, j) * f.count + max(i, j)
            f.found[item] += 1


@kernel
def look_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """The pairs of some circles."""
    f: cython.pointer(Search) = cython.cast(cython.pointer(Search), what)
    f.found[item] = 0
    for i in range(item * f.together, min((item + 1) * f.together, f.count)):
        if f.level[i] < 0:
            continue
        far: cython.double = f.radius[i] + f.widest
        for s in range(f.images):
            x: cython.double = f.position[2 * i] + f.image[2 * s]
            y: cython.double = f.position[2 * i + 1] + f.image[2 * s + 1]
            if x < f.x0 - far or x > f.x1 + far or y < f.y0 - far or y > f.y1 + far:
                continue
            for level in range(f.level[i], f.highest + 1):
                if f.scale[level] > 0:
                    look_around(f, i, s, level, item)


@kernel
def look_all(what: cython.p_void, part: cython.int) -> cython.void:
    """All circles, shared out to the team."""
    f: cython.pointer(Search) = cython.cast(cython.pointer(Search), what)
    team_stage(f.threads, look_stage, f, f.items)


def touching(position, radius, fixed, category, mask, shift, pairs, found, threads: cython.int):
    """Write i n + j of pairs of n circles whose rims overlap, i < j, but no two that are fixed, or that filters keep apart.

    They are looked for in as many parts of the circles as `pairs` (parts, room) has rows. How many each has found is written to
    `found` (parts,): more than there is room for are counted. shift (s, 2): to the images of a periodic room, (0, 0) the first.
    threads: that share this out.
    """
    search: Search
    f: cython.pointer(Search) = cython.address(search)
    f.count, f.position, f.radius, f.fixed = len(radius), const_reals(position), const_reals(radius), const_octets(fixed)
    rows, heads = np.empty((2, len(radius)), np.int64), np.empty(2 << len(radius).bit_length(), np.int64)
    scale = np.zeros(CELL_LEVELS)
    f.category, f.mask = const_indices(category), const_indices(mask)
    f.images, f.image, f.size, f.head = len(shift), const_doubles(shift), len(heads), integers(heads)
    f.level, f.following, f.scale = integers(rows[0]), integers(rows[1]), doubles(scale)
    f.items = len(found)
    f.together, f.room = -(-len(radius) // max(f.items, 1)), pairs.shape[1]
    f.pairs, f.found, f.threads = integers(pairs), integers(found), team_new(threads)
    if f.threads == cython.NULL:
        raise MemoryError
    with cython.nogil:
        put_in_cells(f)
        team_run(f.threads, look_all, f, threads)
        team_free(f.threads)
