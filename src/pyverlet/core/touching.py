# mypy: ignore-errors
"""Finds overlapping discs, and their depths: each disc is listed in one hashed cell, of a level whose cells are wider than it.

A disc searches the cells around its own, of its level and all coarser ones (hierarchical hash grid; Ericson, Real-Time Collision
Detection, 2005, 7.2). All in float64.
"""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_indices, const_integers, const_reals, doubles, integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, ceil, fabs, floor, isfinite, ldexp, log2, sqrt
from cython.cimports.libc.stdint import int64_t, uint32_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.segments import head_at

FINEST_DISC = cython.declare(int64_t, -100)
DISC_LEVELS = cython.declare(int64_t, 200)
"""Exponent of the smallest cells, whose width is a power of two, m, and the number of levels."""

FARTHEST_CELL = cython.declare(cython.double, 68719476736.0)
"""2^36: discs beyond it share the last cell."""

LEVEL_APART = cython.declare(int64_t, 83492791)
"""Columns between the cells of two levels, for the hash."""

Touching = cython.struct(
    count=int64_t,
    position=cython.pointer[cython.const[real]],
    radius=cython.pointer[cython.const[real]],
    mass=cython.pointer[cython.const[real]],
    category=cython.pointer[cython.const[uint32_t]],
    mask=cython.pointer[cython.const[uint32_t]],
    period_x=cython.double,
    period_y=cython.double,
    apart=cython.pointer[cython.const[int64_t]],
    aparts=int64_t,
    size=int64_t,  # of the table of cells
    head=cython.pointer(int64_t),
    following=cython.pointer(int64_t),
    level=cython.pointer(int64_t),  # (count,) level at which each is listed, -1: none
    scale=cython.pointer(cython.double),  # (DISC_LEVELS,) inverse width of the cells, 1/m; 0 for unused levels
    highest=int64_t,
    capacity=int64_t,
    pairs=cython.pointer(int64_t),
    found=int64_t,
    total=cython.double,
    largest=cython.double,
)


@inlined
def bucket(f: cython.pointer(Touching), column: int64_t, row: int64_t, level: int64_t) -> int64_t:
    """Hash of a cell; levels are offset by many columns."""
    return head_at(column + LEVEL_APART * level, row, f.size)


@inlined
def cell_along(x: cython.double, scale: cython.double) -> int64_t:
    """Cell index along one axis."""
    return cython.cast(int64_t, floor(min(max(x * scale, -FARTHEST_CELL), FARTHEST_CELL)))


@kernel
def fill_levels(f: cython.pointer(Touching)) -> cython.void:
    """List each disc in its cell."""
    for k in range(f.size):
        f.head[k] = -1
    f.highest = -1
    for i in range(f.count):
        x: cython.double = f.position[2 * i]
        y: cython.double = f.position[2 * i + 1]
        f.level[i] = -1
        if not isfinite(x + y):
            continue
        own: int64_t = cython.cast(int64_t, ceil(log2(2.0 * cython.cast(cython.double, f.radius[i])))) - FINEST_DISC
        own = min(max(own, 0), DISC_LEVELS - 1)
        f.level[i], f.highest = own, max(f.highest, own)
        f.scale[own] = ldexp(1.0, cython.cast(cython.int, -(own + FINEST_DISC)))
        to: int64_t = bucket(f, cell_along(x, f.scale[own]), cell_along(y, f.scale[own]), own)
        f.following[i], f.head[to] = f.head[to], i


@kernel
def is_apart(f: cython.pointer(Touching), pair: int64_t) -> cython.bint:
    """Whether a pair is in the sorted list of excluded pairs."""
    low: int64_t = 0
    high: int64_t = f.aparts
    while low < high:
        middle: int64_t = (low + high) // 2
        if f.apart[middle] < pair:
            low = middle + 1
        else:
            high = middle
    return low < f.aparts and f.apart[low] == pair


@kernel
def store_overlap(f: cython.pointer(Touching), i: int64_t, j: int64_t, square: cython.double) -> cython.void:
    """Count two discs whose squared centre distance is `square`, m^2, if they overlap and may collide."""
    pinned: cython.bint = f.mass[i] == INFINITY and f.mass[j] == INFINITY
    if pinned or not (f.category[i] & f.mask[j] and f.category[j] & f.mask[i]):
        return
    pair: int64_t = min(i, j) * f.count + max(i, j)
    if f.aparts > 0 and is_apart(f, pair):
        return
    if f.found < f.capacity:
        f.pairs[f.found] = pair
    depth: cython.double = 1.0 - sqrt(square) / (cython.cast(cython.double, f.radius[i]) + f.radius[j])
    f.found, f.total, f.largest = f.found + 1, f.total + depth, max(f.largest, depth)


@inlined
def look_around(
    f: cython.pointer(Touching), i: int64_t, shift_x: cython.double, shift_y: cython.double, level: int64_t
) -> cython.void:
    """Compare an image of disc i with discs in cells around it, of this level, which is no finer than its own; each pair once."""
    x: cython.double = f.position[2 * i] + shift_x
    y: cython.double = f.position[2 * i + 1] + shift_y
    left: int64_t = cell_along(x, f.scale[level]) - 1
    below: int64_t = cell_along(y, f.scale[level]) - 1
    around: int64_t
    for around in range(9):
        column: int64_t = left + around % 3
        row: int64_t = below + around // 3
        following: int64_t = f.head[bucket(f, column, row, level)]
        while following >= 0:
            j: int64_t = following
            following = f.following[j]
            if f.level[j] != level or (level == f.level[i] and j <= i):
                continue
            dx: cython.double = x - f.position[2 * j]
            dy: cython.double = y - f.position[2 * j + 1]
            reach: cython.double = cython.cast(cython.double, f.radius[i]) + f.radius[j]
            if not dx * dx + dy * dy < reach * reach:
                continue
            if (f.period_x > 0 and fabs(dx) > f.period_x / 2) or (f.period_y > 0 and fabs(dy) > f.period_y / 2):
                continue  # another image is nearer
            if (
                cell_along(f.position[2 * j], f.scale[level]) != column
                or cell_along(f.position[2 * j + 1], f.scale[level]) != row
            ):
                continue  # a different cell with the same hash
            store_overlap(f, i, j, dx * dx + dy * dy)


@kernel
def look_for_all(f: cython.pointer(Touching), shift: cython.pointer[cython.const[cython.double]], images: int64_t) -> cython.void:
    """Compare all discs, at all images of a periodic room."""
    for i in range(f.count):
        for level in range(max(f.level[i], 0), f.highest + 1 if f.level[i] >= 0 else 0):
            if f.scale[level] > 0:
                for s in range(images):
                    look_around(f, i, shift[2 * s], shift[2 * s + 1], level)


def touching(position, radius, mass, category, mask, period_x: cython.double, period_y: cython.double, shift, apart, pairs):
    """(number, sum and maximum of depth / (r_i + r_j)) of overlapping pairs, i < j; writes i n + j of each to `pairs`.

    Excludes pinned pairs, filtered ones, and those in `apart`, sorted numbers i n + j. shift (s, 2): to the images of a periodic
    room, first (0, 0), m. Periods are 0 otherwise. Pairs beyond the room of `pairs` are counted, too.
    """
    search: Touching
    f: cython.pointer(Touching) = cython.address(search)
    f.count, f.position, f.radius, f.mass = len(radius), const_reals(position), const_reals(radius), const_reals(mass)
    f.category, f.mask, f.period_x, f.period_y = const_indices(category), const_indices(mask), period_x, period_y
    f.apart, f.aparts, f.pairs, f.capacity = const_integers(apart), len(apart), integers(pairs), len(pairs)
    f.size = 2
    while f.size < 2 * f.count:
        f.size *= 2
    rows, scale = np.empty(2 * f.count + f.size, np.int64), np.zeros(DISC_LEVELS)
    f.level, f.scale = integers(rows), doubles(scale)
    f.following, f.head = f.level + f.count, f.level + 2 * f.count
    f.found, f.total, f.largest = 0, 0.0, 0.0
    to: cython.pointer[cython.const[cython.double]] = const_doubles(shift)
    images: int64_t = len(shift)
    with cython.nogil:
        fill_levels(f)
        look_for_all(f, to, images)
    return f.found, f.total, f.largest
