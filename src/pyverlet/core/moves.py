# mypy: ignore-errors
"""The moves every integrator is made of: a = g + F / m, kicks (v += h a) and drifts (x += h v), on (n, 2) arrays in SI units.

Loops that treat x and y alike run over the 2 n numbers of an array: so they are vectorised.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import isfinite, sqrt

PART = cython.declare(cython.Py_ssize_t, 2048)  # particles whose arrays fit into the caches


def advance(out, base, slope, h: real):
    """out = base + h slope; out may be base."""
    to: cython.pointer(real) = reals(out)
    start: cython.pointer[cython.const[real]] = const_reals(base)
    rate: cython.pointer[cython.const[real]] = const_reals(slope)
    count: cython.Py_ssize_t = 2 * len(out)
    in_place: cython.bint = out is base
    k: cython.Py_ssize_t
    with cython.nogil:
        if in_place:
            add_scaled(to, rate, h, 0, count)
        else:
            for k in range(count):
                to[k] = start[k] + h * rate[k]


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def add_scaled(
    x: cython.pointer(real), rate: cython.pointer[cython.const[real]], h: real, first: cython.Py_ssize_t, stop: cython.Py_ssize_t
) -> cython.void:
    """x += h rate, of the numbers from `first` up to `stop`."""
    k: cython.Py_ssize_t
    for k in range(first, stop):
        x[k] = x[k] + h * rate[k]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def accelerate(
    a: cython.pointer(real),
    f: cython.pointer[cython.const[real]],
    inverse_mass: cython.pointer[cython.const[real]],
    gx: real,
    gy: real,
    forced: cython.bint,
    first: cython.Py_ssize_t,
    stop: cython.Py_ssize_t,
) -> real:
    """a = g + F / m of the particles from `first` up to `stop`, 0 where pinned; the square of the largest, g^2 without forces."""
    zero: real = 0
    k: cython.Py_ssize_t
    lane: cython.Py_ssize_t
    if not forced:
        for k in range(first, stop):
            free: cython.bint = inverse_mass[k] > zero
            a[2 * k] = gx if free else zero
            a[2 * k + 1] = gy if free else zero
        return gx * gx + gy * gy
    most: real[8]  # of every eighth: eight comparisons at a time
    for lane in range(8):
        most[lane] = zero
    whole: cython.Py_ssize_t = stop - (stop - first) % 8
    for k in range(first, whole, 8):
        for lane in range(8):
            w: real = inverse_mass[k + lane]
            ax: real = gx + f[2 * (k + lane)] * w
            ay: real = gy + f[2 * (k + lane) + 1] * w
            ax = ax if w > zero else zero
            ay = ay if w > zero else zero
            a[2 * (k + lane)] = ax
            a[2 * (k + lane) + 1] = ay
            square: real = ax * ax + ay * ay
            most[lane] = square if square > most[lane] else most[lane]
    largest: real = zero
    for k in range(whole, stop):
        free = inverse_mass[k] > zero
        ax = gx + f[2 * k] * inverse_mass[k]
        ay = gy + f[2 * k + 1] * inverse_mass[k]
        ax = ax if free else zero
        ay = ay if free else zero
        a[2 * k] = ax
        a[2 * k + 1] = ay
        largest = max(largest, ax * ax + ay * ay)
    for lane in range(8):
        largest = max(largest, most[lane])
    return largest


def newton(acceleration, force, inverse_mass, gx: real, gy: real) -> float:
    """a = g + F / m for every free particle, 0 for a pinned one (Newton's second law); returns the largest |a|.

    force: (n, 2), or (0, 2) where gravity alone acts.
    """
    a: cython.pointer(real) = reals(acceleration)
    f: cython.pointer[cython.const[real]] = const_reals(force)
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(inverse_mass)
    forced: cython.bint = len(force) > 0
    square: real
    with cython.nogil:
        square = accelerate(a, f, w, gx, gy, forced, 0, count)
    return cython.cast(real, sqrt(square))


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def are_finite(x: cython.pointer[cython.const[real]], count: cython.Py_ssize_t) -> cython.bint:
    """Whether there is neither NaN nor infinity among these numbers."""
    part: cython.Py_ssize_t
    k: cython.Py_ssize_t
    for part in range((count + PART - 1) // PART):
        found: cython.int = 0  # a sum, which is vectorised
        for k in range(part * PART, min((part + 1) * PART, count)):
            found += not isfinite(x[k])
        if found > 0:
            return False
    return True


def all_finite(position, velocity) -> bool:
    """Whether no row is NaN or infinite."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    count: cython.Py_ssize_t = 2 * len(position)
    return are_finite(x, count) and are_finite(v, count)


def first_non_finite(vectors) -> int:
    """Index of the first row with a NaN or an infinity; -1 if all are finite."""
    x: cython.pointer[cython.const[real]] = const_reals(vectors)
    count: cython.Py_ssize_t = len(vectors)
    i: cython.Py_ssize_t
    for i in range(count):
        if not (isfinite(x[2 * i]) and isfinite(x[2 * i + 1])):
            return i
    return -1
