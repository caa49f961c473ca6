# mypy: ignore-errors
"""Pairs of particles nearer to each other than a range, found by a grid of cells, and forces along their lines of centres.

A grid is (x0, y0, width, height, columns, rows, period_x, period_y): its corner and size, m, and the periods of the room, 0 for
none. Cells are at least as wide as the range, so that neighbours stand in the same or in adjacent cells.
"""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_reals, const_small_integers, doubles, integers, reals, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import floor, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined
from pyverlet.core.periodic import nearest_in_double
from pyverlet.core.query_cells import cell_at, count_and_sort


@inlined
def in_room(x: cython.double, low: cython.double, period: cython.double) -> cython.double:
    """The image of a coordinate inside a periodic room, to rounding; itself where the period is 0."""
    return x - period * floor((x - low) / period) if period > 0 else x


@inlined
def folded(way: cython.double, period: cython.double) -> cython.double:
    """The nearest image of a difference of two places in the room: less work than a division."""
    half: cython.double = 0.5 * period
    way = way - period if way > half and period > 0 else way
    return way + period if way < -half else way


@inlined
def neighbour_cell(cell: int64_t, step: int64_t, cells: int64_t, wraps: cython.bint) -> int64_t:
    """The cell `step` away, -1 to 1; -1 if there is none, or if it is seen at another step already."""
    to: int64_t = cell + step
    if to >= 0 and to < cells:
        return to
    if not wraps or cells < 3:  # of two cells in a circle each is next to the other once
        return -1
    return cells - 1 if to < 0 else 0


def list_near(position, reach: cython.double, grid, cell, start, order, spot, first, second):
    """Write the pairs nearer than `reach`, first < second, ascending; returns how many there are, also beyond the room.

    The order depends on that of the positions alone, not on the grid. first, second: (k,) int32. cell (n,) int32, start
    (columns rows + 2,) and order (n,), int64, and spot (n, 2) float64: room to work in.
    """
    x: cython.pointer[cython.const[real]] = const_reals(position)
    to: cython.pointer(int32_t) = small_integers(cell)
    begin: cython.pointer(int64_t) = integers(start)
    sorted_: cython.pointer(int64_t) = integers(order)
    there: cython.pointer(cython.double) = doubles(spot)
    a: cython.pointer(int32_t) = small_integers(first)
    b: cython.pointer(int32_t) = small_integers(second)
    x0: cython.double = grid[0]
    y0: cython.double = grid[1]
    width: cython.double = grid[2]
    height: cython.double = grid[3]
    columns: int64_t = grid[4]
    rows: int64_t = grid[5]
    period_x: cython.double = grid[6]
    period_y: cython.double = grid[7]
    count: int64_t = len(position)
    room: int64_t = len(first)
    found: int64_t = 0
    i: int64_t
    k: int64_t
    s: int64_t
    t: int64_t
    with cython.nogil:
        for i in range(count):
            k = cell_at((in_room(x[2 * i + 1], y0, period_y) - y0) / height * rows, rows)
            k = k * columns + cell_at((in_room(x[2 * i], x0, period_x) - x0) / width * columns, columns)
            to[i] = cython.cast(int32_t, k)
        count_and_sort(to, count, begin, columns * rows, sorted_)
        for k in range(count):
            i = sorted_[k]
            there[2 * k], there[2 * k + 1] = in_room(x[2 * i], x0, period_x), in_room(x[2 * i + 1], y0, period_y)
        for i in range(count):
            x_i: cython.double = in_room(x[2 * i], x0, period_x)
            y_i: cython.double = in_room(x[2 * i + 1], y0, period_y)
            from_: int64_t = found
            for s in range(-1, 2):
                row: int64_t = neighbour_cell(to[i] // columns, s, rows, period_y > 0)
                if row < 0:
                    continue
                for t in range(-1, 2):
                    column: int64_t = neighbour_cell(to[i] % columns, t, columns, period_x > 0)
                    if column < 0:
                        continue
                    for k in range(begin[row * columns + column], begin[row * columns + column + 1]):
                        j: int64_t = sorted_[k]
                        if j <= i:
                            continue
                        dx: cython.double = folded(there[2 * k] - x_i, period_x)
                        dy: cython.double = folded(there[2 * k + 1] - y_i, period_y)
                        if dx * dx + dy * dy < reach * reach:
                            if found < room:
                                insert(b, from_, found, cython.cast(int32_t, j))
                                a[found] = cython.cast(int32_t, i)
                            found += 1
    return found


@inlined
def insert(b: cython.pointer(int32_t), from_: int64_t, at: int64_t, j: int32_t) -> cython.void:
    """Insert j into the ascending b[from_ : at]."""
    while at > from_ and b[at - 1] > j:
        b[at] = b[at - 1]
        at -= 1
    b[at] = j


def moved_beyond(position, before, limit: cython.double, period_x: cython.double, period_y: cython.double) -> bool:
    """Whether a particle is not within `limit` m of where it was before."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    was: cython.pointer[cython.const[real]] = const_reals(before)
    count: cython.Py_ssize_t = len(position)
    moved: cython.bint = False
    with cython.nogil:
        for i in range(count):
            dx: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * i]) - was[2 * i], period_x)
            dy: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * i + 1]) - was[2 * i + 1], period_y)
            if not dx * dx + dy * dy <= limit * limit:  # NaN, too
                moved = True
                break
    return moved


def measure_near(
    position, first, second, reach: cython.double, period_x: cython.double, period_y: cython.double, near, distance, way
):
    """Of listed pairs those nearer than `reach`, but for those at the same place, which have no direction; returns how many.

    near (2, k) int32: first and second of each; distance (k,) m; way (k, 2): the unit vector from first to second.
    """
    x: cython.pointer[cython.const[real]] = const_reals(position)
    a: cython.pointer[cython.const[int32_t]] = const_small_integers(first)
    b: cython.pointer[cython.const[int32_t]] = const_small_integers(second)
    out: cython.pointer(int32_t) = small_integers(near)
    far: cython.pointer(cython.double) = doubles(distance)
    unit: cython.pointer(cython.double) = doubles(way)
    count: int64_t = len(first)
    room: int64_t = len(distance)
    found: int64_t = 0
    with cython.nogil:
        for k in range(count):
            i: int64_t = a[k]
            j: int64_t = b[k]
            dx: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * j]) - x[2 * i], period_x)
            dy: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * j + 1]) - x[2 * i + 1], period_y)
            square: cython.double = dx * dx + dy * dy
            if square < reach * reach and square > 0:
                size: cython.double = sqrt(square)
                out[found] = cython.cast(int32_t, i)
                out[room + found] = cython.cast(int32_t, j)
                far[found] = size
                unit[2 * found] = dx / size
                unit[2 * found + 1] = dy / size
                found += 1
    return found


def add_along(force, first, second, way, on_first, on_second):
    """Add forces along `way` (k, 2) of pairs, in N: positive drives both apart. Summed in float64, in the order of the pairs."""
    f: cython.pointer(real) = reals(force)
    a: cython.pointer[cython.const[int32_t]] = const_small_integers(first)
    b: cython.pointer[cython.const[int32_t]] = const_small_integers(second)
    u: cython.pointer[cython.const[cython.double]] = const_doubles(way)
    p: cython.pointer[cython.const[cython.double]] = const_doubles(on_first)
    q: cython.pointer[cython.const[cython.double]] = const_doubles(on_second)
    total = np.zeros(2 * len(force))
    sums: cython.pointer(cython.double) = doubles(total)
    count: int64_t = len(first)
    particles: int64_t = len(force)
    axis: int64_t
    with cython.nogil:
        for k in range(count):
            i: int64_t = a[k]
            j: int64_t = b[k]
            for axis in range(2):
                sums[2 * i + axis] -= p[k] * u[2 * k + axis]
                sums[2 * j + axis] += q[k] * u[2 * k + axis]
        for k in range(2 * particles):
            f[k] = cython.cast(real, f[k] + sums[k])
