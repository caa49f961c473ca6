# mypy: ignore-errors
"""Particles listed in square cells of one size, in all that they reach into, for questions about where they are."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import isfinite
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined


def extent(position):
    """(min x, min y, max x, max y) of the particles with finite positions; zeros if there are none."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    count: cython.Py_ssize_t = len(position)
    x0: real = 0
    y0: real = 0
    x1: real = 0
    y1: real = 0
    found: cython.bint = False
    with cython.nogil:
        for i in range(count):
            if isfinite(x[2 * i]) and isfinite(x[2 * i + 1]):
                x0 = min(x0, x[2 * i]) if found else x[2 * i]
                x1 = max(x1, x[2 * i]) if found else x[2 * i]
                y0 = min(y0, x[2 * i + 1]) if found else x[2 * i + 1]
                y1 = max(y1, x[2 * i + 1]) if found else x[2 * i + 1]
                found = True
    return x0, y0, x1, y1


@inlined
def cell_at(value: cython.double, cells: int64_t) -> int64_t:
    """floor(value), not below 0 and below `cells`: what is outside stands at the rim. NaN fails both comparisons: 0."""
    if value >= cells - 1:
        return cells - 1
    return cython.cast(int64_t, value) if value > 0 else 0


def list_discs(
    position, radius, reach: cython.double, x0: cython.double, y0: cython.double, cell: cython.double,
    columns: int64_t, rows: int64_t, begin, member,
) -> int:  # fmt: skip
    """member[begin[k] : begin[k + 1]] become the discs within `reach` m of cell k, row by row; returns how many that are in all.

    radius: (n,), or empty: all are points. begin: (columns rows + 2,) int32. member: int32; where it is too short, nothing is
    written to it.
    """
    x: cython.pointer[cython.const[real]] = const_reals(position)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    first: cython.pointer(int32_t) = small_integers(begin)
    to: cython.pointer(int32_t) = small_integers(member)
    count: cython.Py_ssize_t = len(position)
    sized: cython.bint = len(radius) > 0
    room: int64_t = len(member)
    found: int64_t = 0
    per: cython.double = 1.0 / cell
    k: int64_t
    fill: cython.int
    with cython.nogil:
        for k in range(columns * rows + 2):
            first[k] = 0
        for fill in range(2):
            for i in range(count):
                if not (isfinite(x[2 * i]) and isfinite(x[2 * i + 1])):
                    continue
                far: cython.double = r[i] + reach if sized else reach
                left: int64_t = cell_at((x[2 * i] - far - x0) * per, columns)
                right: int64_t = left if far == 0 else cell_at((x[2 * i] + far - x0) * per, columns)
                low: int64_t = cell_at((x[2 * i + 1] - far - y0) * per, rows)
                high: int64_t = low if far == 0 else cell_at((x[2 * i + 1] + far - y0) * per, rows)
                if not fill:
                    found += (right - left + 1) * (high - low + 1)
                for row in range(low, high + 1):
                    for column in range(left, right + 1):
                        k = row * columns + column
                        if fill:
                            to[first[k + 1]] = cython.cast(int32_t, i)
                            first[k + 1] += 1
                        else:
                            first[k + 2] += 1
            if found > room:
                break
            if not fill:
                for k in range(columns * rows):
                    first[k + 2] += first[k + 1]
    return found
