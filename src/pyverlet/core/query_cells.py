# mypy: ignore-errors
"""Particles sorted by square cells of one size, for questions about where they are."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, integers, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import isfinite
from cython.cimports.libc.stdint import int32_t, int64_t


def extent(position):
    """(min x, min y, max x, max y) of the particles with finite positions; zeros if there are none."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    count: cython.Py_ssize_t = len(position)
    x0: real = 0
    y0: real = 0
    x1: real = 0
    y1: real = 0
    found: cython.bint = False
    i: cython.Py_ssize_t
    with cython.nogil:
        for i in range(count):
            if isfinite(x[2 * i]) and isfinite(x[2 * i + 1]):
                x0 = min(x0, x[2 * i]) if found else x[2 * i]
                x1 = max(x1, x[2 * i]) if found else x[2 * i]
                y0 = min(y0, x[2 * i + 1]) if found else x[2 * i + 1]
                y1 = max(y1, x[2 * i + 1]) if found else x[2 * i + 1]
                found = True
    return x0, y0, x1, y1


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def cell_at(value: cython.double, cells: int64_t) -> int64_t:
    """floor(value), not below 0 and below `cells`: what is outside stands at the rim. NaN fails both comparisons: 0."""
    if value >= cells - 1:
        return cells - 1
    return cython.cast(int64_t, value) if value > 0 else 0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def count_and_sort(
    to: cython.pointer(int32_t), count: cython.Py_ssize_t, begin: cython.pointer(int64_t), cells: int64_t,
    order: cython.pointer(int64_t),
) -> cython.void:  # fmt: skip
    """Stable counting sort by cell: order[begin[k] : begin[k + 1]] become those in cell k. begin: (cells + 2,)."""
    i: cython.Py_ssize_t
    k: int64_t
    for k in range(cells + 2):
        begin[k] = 0
    for i in range(count):
        begin[to[i] + 2] += 1
    for k in range(cells):
        begin[k + 2] += begin[k + 1]
    for i in range(count):
        k = to[i] + 1
        order[begin[k]] = i
        begin[k] += 1


def sort_into_cells(
    position, x0: cython.double, y0: cython.double, per_length: cython.double, columns: int64_t, rows: int64_t, cell, start, order
):
    """Stable counting sort: order[start[k] : start[k + 1]] become the particles in cell k, row by row.

    per_length: cells a metre. cell: (n,) int32, becomes that of each. start: (columns rows + 2,) int64; order: (n,) int64.
    """
    x: cython.pointer[cython.const[real]] = const_reals(position)
    to: cython.pointer(int32_t) = small_integers(cell)
    begin: cython.pointer(int64_t) = integers(start)
    sorted_: cython.pointer(int64_t) = integers(order)
    count: cython.Py_ssize_t = len(position)
    i: cython.Py_ssize_t
    with cython.nogil:
        for i in range(count):
            row: int64_t = cell_at((x[2 * i + 1] - y0) * per_length, rows)
            to[i] = cython.cast(int32_t, row * columns + cell_at((x[2 * i] - x0) * per_length, columns))
        count_and_sort(to, count, begin, columns * rows, sorted_)
