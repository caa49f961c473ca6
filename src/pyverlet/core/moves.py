# mypy: ignore-errors
"""The moves that integrators consist of: a = g + F / m, kicks (v += h a) and drifts (x += h v), on (n, 2) arrays in SI units.

Loops that treat x and y alike run over the 2 n numbers of an array, which allows vectorisation.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import isfinite, sqrt

from pyverlet.core.forces import soften_forces
from pyverlet.core.kernels import inlined, kernel

PART = cython.declare(cython.Py_ssize_t, 2048)  # particles whose arrays fit into the caches


def advance(out, base, slope, h: real):
    """out = base + h slope; out may be base."""
    to: cython.pointer(real) = reals(out)
    start: cython.pointer[cython.const[real]] = const_reals(base)
    rate: cython.pointer[cython.const[real]] = const_reals(slope)
    count: cython.Py_ssize_t = 2 * len(out)
    in_place: cython.bint = out is base
    with cython.nogil:
        if in_place:
            add_scaled(to, rate, h, 0, count)
        else:
            for k in range(count):
                to[k] = start[k] + h * rate[k]


def advance_by_two(out, base, slope, h: real, other, k: real):
    """out = base + h slope + k other; out may be base."""
    to: cython.pointer(real) = reals(out)
    start: cython.pointer[cython.const[real]] = const_reals(base)
    rate: cython.pointer[cython.const[real]] = const_reals(slope)
    more: cython.pointer[cython.const[real]] = const_reals(other)
    count: cython.Py_ssize_t = 2 * len(out)
    with cython.nogil:
        for i in range(count):
            to[i] = (start[i] + h * rate[i]) + k * more[i]


def mean_of_step(position, velocity, acceleration, begin, before, h: real, left):
    """Convert the result of a step of h seconds: mean velocity and acceleration, and the excess of the velocity over that mean.

    position, velocity: become those at the start, and the mean velocity. begin, before: position and velocity at the start.
    """
    x: cython.pointer(real) = reals(position)
    v: cython.pointer(real) = reals(velocity)
    a: cython.pointer(real) = reals(acceleration)
    x_then: cython.pointer[cython.const[real]] = const_reals(begin)
    v_then: cython.pointer[cython.const[real]] = const_reals(before)
    beyond: cython.pointer(real) = reals(left)
    count: cython.Py_ssize_t = 2 * len(left)
    with cython.nogil:
        for k in range(count):
            mean: real = (x[k] - x_then[k]) / h
            a[k] = (v[k] - v_then[k]) / h
            beyond[k] = v[k] - mean
            x[k], v[k] = x_then[k], mean


@inlined
def add_scaled(
    x: cython.pointer(real), rate: cython.pointer[cython.const[real]], h: real, first: cython.Py_ssize_t, stop: cython.Py_ssize_t
) -> cython.void:
    """x += h rate, for the numbers from `first` up to `stop`."""
    for k in range(first, stop):
        x[k] = x[k] + h * rate[k]


def newton(acceleration, force, resistance, inverse_mass, gx: real, gy: real, h: real):
    """a = g + F / m for every free particle, 0 for a pinned one (Newton's second law).

    force: (n, 2), or (0, 2) for gravity alone. resistance: (n,) of drag, by which the force is softened first; or None.
    """
    a: cython.pointer(real) = reals(acceleration)
    f: cython.pointer(real) = reals(force)
    drags: cython.bint = resistance is not None
    r: cython.pointer(real) = reals(resistance) if drags else cython.NULL
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(inverse_mass)
    forced: cython.bint = len(force) > 0
    zero: real = 0
    with cython.nogil:
        if forced and drags:
            soften_forces(f, r, w, count, gx, gy, h)
        for k in range(count):
            x: real = gx + (f[2 * k] * w[k] if forced else zero)
            y: real = gy + (f[2 * k + 1] * w[k] if forced else zero)
            a[2 * k] = x if w[k] > zero else zero
            a[2 * k + 1] = y if w[k] > zero else zero


def strengths(out, force, inverse_mass, gx: real, gy: real):
    """Write |g + F / m| of every particle to `out` (n,), 0 if pinned. Returns the mean of free ones, and the largest, m/s^2."""
    to: cython.pointer(real) = reals(out)
    f: cython.pointer[cython.const[real]] = const_reals(force)
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(inverse_mass)
    forced: cython.bint = len(force) > 0
    total: cython.double = 0
    most: real = 0
    free: cython.Py_ssize_t = 0
    with cython.nogil:
        for k in range(count):
            x: real = gx + (f[2 * k] * w[k] if forced else 0)
            y: real = gy + (f[2 * k + 1] * w[k] if forced else 0)
            found: real = cython.cast(real, sqrt(x * x + y * y)) if w[k] > 0 else 0
            to[k] = found
            total += found
            most = max(most, found)
            free += w[k] > 0
    return total / max(free, 1), most


@kernel
def are_finite(x: cython.pointer[cython.const[real]], count: cython.Py_ssize_t) -> cython.bint:
    """Whether all these numbers are finite."""
    for part in range((count + PART - 1) // PART):
        found: cython.int = 0  # a sum, which can be vectorised
        for k in range(part * PART, min((part + 1) * PART, count)):
            found += not isfinite(x[k])
        if found > 0:
            return False
    return True


def all_finite(position, velocity) -> bool:
    """Whether all rows are finite."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    count: cython.Py_ssize_t = 2 * len(position)
    return are_finite(x, count) and are_finite(v, count)


def first_non_finite(vectors) -> int:
    """Index of the first row with a NaN or an infinity; -1 if all are finite."""
    x: cython.pointer[cython.const[real]] = const_reals(vectors)
    count: cython.Py_ssize_t = len(vectors)
    for i in range(count):
        if not (isfinite(x[2 * i]) and isfinite(x[2 * i + 1])):
            return i
    return -1
