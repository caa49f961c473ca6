# mypy: ignore-errors
"""Sums over all particles in float64, in fixed order on one thread: independent of the number of threads."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY


def energies(position, velocity, spin, radius, mass, gx: cython.double, gy: cython.double):
    """(kinetic energy of motion, of spin, potential energy of gravity, 0 at the origin), J. Pinned particles count as 0.

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


def momenta(position, velocity, spin, radius, mass):
    """(momentum x, momentum y, angular momentum about the origin, spin included); kg m/s and kg m^2/s, without pinned particles.

    Arrays as in `energies`.
    """
    x: cython.pointer[cython.const[real]] = const_reals(position)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    turn: cython.pointer[cython.const[real]] = const_reals(spin)
    size: cython.pointer[cython.const[real]] = const_reals(radius)
    weight: cython.pointer[cython.const[real]] = const_reals(mass)
    count: cython.Py_ssize_t = len(mass)
    px: cython.double = 0.0
    py: cython.double = 0.0
    turning: cython.double = 0.0
    for i in range(count):
        m: cython.double = weight[i]
        if m < INFINITY:
            vx: cython.double = m * v[2 * i]
            vy: cython.double = m * v[2 * i + 1]
            r: cython.double = size[i]
            px += vx
            py += vy
            turning += x[2 * i] * vy - x[2 * i + 1] * vx
            turning += 0.5 * m * r * r * turn[i]
    return px, py, turning


def pinned_move(mass, velocity, spin):
    """Whether any particle of infinite mass moves or turns."""
    weight: cython.pointer[cython.const[real]] = const_reals(mass)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    turn: cython.pointer[cython.const[real]] = const_reals(spin)
    count: cython.Py_ssize_t = len(mass)
    found: cython.bint = False
    for i in range(count):
        found |= weight[i] == INFINITY and (v[2 * i] != 0 or v[2 * i + 1] != 0 or turn[i] != 0)
    return found
