# mypy: ignore-errors
"""Columns of float64 that functions of the user's own are called with, and the forces that they return."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_reals, doubles, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, isfinite


def function_arguments(position, velocity, mass, columns):
    """columns (5, n) float64: x, y, vx, vy and masses."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    m: cython.pointer[cython.const[real]] = const_reals(mass)
    to: cython.pointer(cython.double) = doubles(columns)
    count: cython.Py_ssize_t = len(mass)
    with cython.nogil:
        for i in range(count):
            to[i] = x[2 * i]
            to[count + i] = x[2 * i + 1]
            to[2 * count + i] = v[2 * i]
            to[3 * count + i] = v[2 * i + 1]
            to[4 * count + i] = m[i]


def add_values(force, columns, fx, fy) -> int:
    """Add fx and fy (n,), or (1,) for all, to the forces on free particles.

    columns: as above. Returns for how many particles of finite position and velocity they are not finite.
    """
    f: cython.pointer(real) = reals(force)
    given: cython.pointer[cython.const[cython.double]] = const_doubles(columns)
    x: cython.pointer[cython.const[cython.double]] = const_doubles(fx)
    y: cython.pointer[cython.const[cython.double]] = const_doubles(fy)
    count: cython.Py_ssize_t = len(force)
    step_x: cython.Py_ssize_t = 1 if len(fx) > 1 else 0
    step_y: cython.Py_ssize_t = 1 if len(fy) > 1 else 0
    wrong: cython.Py_ssize_t = 0
    with cython.nogil:
        for i in range(count):
            if given[4 * count + i] < INFINITY:
                f[2 * i] = cython.cast(real, f[2 * i] + x[i * step_x])
                f[2 * i + 1] = cython.cast(real, f[2 * i + 1] + y[i * step_y])
                if not (isfinite(x[i * step_x]) and isfinite(y[i * step_y])):
                    wrong += (
                        isfinite(given[i])
                        and isfinite(given[count + i])
                        and isfinite(given[2 * count + i])
                        and isfinite(given[3 * count + i])
                    )
    return wrong
