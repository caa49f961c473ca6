# mypy: ignore-errors
"""Sums over all particles in float64, in the order given and on one thread: they never depend on the number of threads."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY


def energies(position, velocity, spin, radius, mass, gx: cython.double, gy: cython.double):
    """(kinetic energy of motion, of spin, potential energy of gravity, 0 at the origin), J. Pinned particles have none.

    position, velocity (n, 2) and spin, radius, mass (n,): of one precision. gx, gy: m/s^2.
    """
    x: cython.pointer[cython.const[real]] = const_reals(position)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    turn: cython.pointer[cython.const[real]] = const_reals(spin)
    size: cython.pointer[cython.const[real]] = const_reals(radius)
    weight: cython.pointer[cython.const[real]] = const_reals(mass)
    count: cython.Py_ssize_t = len(mass)
    motion: cython.double = 0.0
    turning: cython.double = 0.0
    height: cython.double = 0.0
    i: cython.Py_ssize_t
    for i in range(count):
        m: cython.double = weight[i]
        if m < INFINITY:
            vx: cython.double = v[2 * i]
            vy: cython.double = v[2 * i + 1]
            w: cython.double = turn[i]
            r: cython.double = size[i]
            motion += 0.5 * m * (vx * vx + vy * vy)
            turning += 0.25 * m * r * r * w * w
            height -= m * (gx * x[2 * i] + gy * x[2 * i + 1])
    return motion, turning, height
