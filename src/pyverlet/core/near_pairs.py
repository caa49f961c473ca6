# mypy: ignore-errors
"""Pairs of particles closer than a range, among listed ones, and forces along their lines of centres."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_reals, const_small_integers, doubles, reals, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.periodic import nearest_in_double


def moved_beyond(position, before, limit: cython.double, period_x: cython.double, period_y: cython.double) -> bool:
    """Whether any particle has moved by more than `limit` m."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    was: cython.pointer[cython.const[real]] = const_reals(before)
    count: cython.Py_ssize_t = len(position)
    moved: cython.bint = False
    with cython.nogil:
        for i in range(count):
            dx: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * i]) - was[2 * i], period_x)
            dy: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * i + 1]) - was[2 * i + 1], period_y)
            if not dx * dx + dy * dy <= limit * limit:  # true for NaN
                moved = True
                break
    return moved


def measure_near(
    position, first, second, cutoff: cython.double, period_x: cython.double, period_y: cython.double, together: cython.bint,
    near, distance, way,
):  # fmt: skip
    """Select the listed pairs closer than `cutoff`; returns their number. Coincident pairs have no direction: they are left out,
    or (`together`) get that of x.

    near (2, k) int32: first and second of each; distance (k,) m; way (k, 2): the unit vector from first to second.
    """
    x: cython.pointer[cython.const[real]] = const_reals(position)
    a: cython.pointer[cython.const[int32_t]] = const_small_integers(first)
    b: cython.pointer[cython.const[int32_t]] = const_small_integers(second)
    out: cython.pointer(int32_t) = small_integers(near)
    far: cython.pointer(cython.double) = doubles(distance)
    unit: cython.pointer(cython.double) = doubles(way)
    count: int64_t = len(first)
    capacity: int64_t = len(distance)
    found: int64_t = 0
    with cython.nogil:
        for k in range(count):
            i: int64_t = a[k]
            j: int64_t = b[k]
            dx: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * j]) - x[2 * i], period_x)
            dy: cython.double = nearest_in_double(cython.cast(cython.double, x[2 * j + 1]) - x[2 * i + 1], period_y)
            square: cython.double = dx * dx + dy * dy
            if square < cutoff * cutoff and (square > 0 or together):
                size: cython.double = sqrt(square)
                out[found] = cython.cast(int32_t, i)
                out[capacity + found] = cython.cast(int32_t, j)
                far[found] = size
                unit[2 * found] = dx / size if size > 0 else 1.0
                unit[2 * found + 1] = dy / size if size > 0 else 0.0
                found += 1
    return found


def add_along(force, first, second, way, on_first, on_second):
    """Add forces along `way` (k, 2) of pairs, in N; positive is repulsive. Summed in float64, in the order of the pairs."""
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
