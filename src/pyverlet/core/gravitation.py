# mypy: ignore-errors
"""Particles that attract each other, all pairs summed in float64."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_reals, const_small_integers, doubles, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, sqrt
from cython.cimports.libc.stdint import int32_t

from pyverlet.core.kernels import kernel
from pyverlet.core.periodic import nearest_in_double


def gravitate(
    force,
    position,
    mass,
    slot,
    strength: cython.double,
    softening: cython.double,
    period_x: cython.double,
    period_y: cython.double,
):
    """Every pair of the particles in these slots attracts: F = strength m_i m_j d / (|d|^2 + softening^2)^(3/2).

    Each particle sums over all others in the order of `slot`; eight particles are summed for at a time. slot: (k,) int32.
    """
    f: cython.pointer(real) = reals(force)
    at: cython.pointer[cython.const[real]] = const_reals(position)
    m: cython.pointer[cython.const[real]] = const_reals(mass)
    who: cython.pointer[cython.const[int32_t]] = const_small_integers(slot)
    count: cython.Py_ssize_t = len(slot)
    copy = np.empty((3, count))
    flat = copy.reshape(-1)
    there: cython.pointer(cython.double) = doubles(flat)  # x of all, then y, then masses, 0 for pinned ones
    with cython.nogil:
        for k in range(count):
            there[k] = at[2 * who[k]]
            there[count + k] = at[2 * who[k] + 1]
            there[2 * count + k] = m[who[k]] if m[who[k]] < INFINITY else 0
        for k in range(0, count, 8):
            pull_eight(f, m, who, there, k, count, strength, softening * softening, period_x, period_y)


@kernel
def pull_eight(
    f: cython.pointer(real),
    m: cython.pointer[cython.const[real]],
    who: cython.pointer[cython.const[int32_t]],
    there: cython.pointer(cython.double),
    first: cython.Py_ssize_t,
    count: cython.Py_ssize_t,
    strength: cython.double,
    softening2: cython.double,
    period_x: cython.double,
    period_y: cython.double,
) -> cython.void:
    """The pull of all on the eight particles from `first` on, or those that are left."""
    x: cython.double[8]
    y: cython.double[8]
    fx: cython.double[8]
    fy: cython.double[8]
    for lane in range(8):
        k: cython.Py_ssize_t = min(first + lane, count - 1)
        x[lane] = there[k]
        y[lane] = there[count + k]
        fx[lane] = fy[lane] = 0
    periodic: cython.bint = period_x > 0 or period_y > 0
    for j in range(count):
        jx: cython.double = there[j]
        jy: cython.double = there[count + j]
        jm: cython.double = there[2 * count + j]
        for lane in range(8):
            dx: cython.double = jx - x[lane]
            dy: cython.double = jy - y[lane]
            if periodic:
                dx = nearest_in_double(dx, period_x)
                dy = nearest_in_double(dy, period_y)
            square: cython.double = dx * dx + dy * dy + softening2
            cube: cython.double = square * sqrt(square)
            there_is: cython.bint = cube > 0  # it underflows before the square does
            pull: cython.double = jm / (cube if there_is else 1)
            pull = pull if there_is else 0
            fx[lane] = fx[lane] + pull * dx
            fy[lane] = fy[lane] + pull * dy
    for lane in range(min(8, count - first)):
        i: cython.Py_ssize_t = who[first + lane]
        own: cython.double = m[i]
        if own < INFINITY:
            f[2 * i] = cython.cast(real, f[2 * i] + strength * own * fx[lane])
            f[2 * i + 1] = cython.cast(real, f[2 * i + 1] + strength * own * fy[lane])


def gravitational_potential(position, mass, softening: cython.double, period_x: cython.double, period_y: cython.double) -> float:
    """Sum over pairs of -m_i m_j / sqrt(|d|^2 + softening^2), to be multiplied by the strength; arrays of float64."""
    x: cython.pointer[cython.const[cython.double]] = const_doubles(position)
    m: cython.pointer[cython.const[cython.double]] = const_doubles(mass)
    count: cython.Py_ssize_t = len(mass)
    total: cython.double = 0.0
    with cython.nogil:
        for i in range(count):
            for j in range(i):
                dx: cython.double = nearest_in_double(x[2 * j] - x[2 * i], period_x)
                dy: cython.double = nearest_in_double(x[2 * j + 1] - x[2 * i + 1], period_y)
                square: cython.double = dx * dx + dy * dy + softening * softening
                if square > 0 and m[i] < INFINITY and m[j] < INFINITY:
                    total -= m[i] * m[j] / sqrt(square)
    return total
