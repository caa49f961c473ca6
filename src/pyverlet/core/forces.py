# mypy: ignore-errors
"""Forces on all particles at once: each kernel adds newtons to `force` (n, 2), in one call a substep.

Pinned particles do not matter: no force moves them. One that grows with mass leaves them out, for it would be infinite.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt

from pyverlet.core.periodic import nearest_of


def add_drag(force, velocity, resistance, wind, linear: real, quadratic: real):
    """F = -(linear + quadratic |u|) u with u = v - wind, (n, 2), or (1, 2) where the medium moves everywhere alike.

    resistance: (n,) N s/m, grows by what the force changes by with the speed; `soften` needs it.
    """
    f: cython.pointer(real) = reals(force)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    r: cython.pointer(real) = reals(resistance)
    air: cython.pointer[cython.const[real]] = const_reals(wind)
    count: cython.Py_ssize_t = len(force)
    step: cython.Py_ssize_t = 2 if len(wind) > 1 else 0
    with cython.nogil:
        for i in range(count):
            ux: real = v[2 * i] - air[step * i]
            uy: real = v[2 * i + 1] - air[step * i + 1]
            more: real = quadratic * cython.cast(real, sqrt(ux * ux + uy * uy))
            r[i] = r[i] + (linear + cython.cast(real, 2) * more)
            f[2 * i] = f[2 * i] - (linear + more) * ux
            f[2 * i + 1] = f[2 * i + 1] - (linear + more) * uy


def soften(force, resistance, inverse_mass, gx: real, gy: real, h: real):
    """Scale all that accelerates a particle, gravity (gx, gy) included, where drag would stop it within a substep of h seconds.

    With z = c h / m beyond 1/2 the velocity goes by k = 3/4 - 1 / 8 z of the way to where all forces balance, instead of by z: it
    gets there without swinging, however strong the drag is, and terminal speeds are exact. With k = 1 integrators of Stormer's
    kind, which reckon with the acceleration of the substep before, would swing for ever.
    """
    f: cython.pointer(real) = reals(force)
    r: cython.pointer(real) = reals(resistance)
    light: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(resistance)
    one: real = 1
    half: real = 0.5
    most: real = 0.75
    eighth: real = 0.125
    with cython.nogil:
        for i in range(count):
            w: real = light[i]
            z: real = r[i] * w * h
            if z > half:
                part: real = (most - eighth / z) / z
                m: real = (one - part) / w
                f[2 * i] = part * f[2 * i] - m * gx
                f[2 * i + 1] = part * f[2 * i + 1] - m * gy
            r[i] = 0


def attract(force, position, inverse_mass, x: real, y: real, strength: real, softening: real, period_x: real, period_y: real):
    """F = m strength d / (|d|^2 + softening^2)^(3/2), d from the particle to (x, y); none on a particle at that very point."""
    f: cython.pointer(real) = reals(force)
    at: cython.pointer[cython.const[real]] = const_reals(position)
    light: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(force)
    one: real = 1
    with cython.nogil:
        for i in range(count):
            dx: real = nearest_of(x - at[2 * i], period_x)
            dy: real = nearest_of(y - at[2 * i + 1], period_y)
            square: cython.double = cython.cast(real, dx * dx + dy * dy + softening * softening)
            cube: cython.double = square * sqrt(square)  # in float32 it underflows at 1e-15 m
            if cube > 0 and light[i] > 0:
                pull: cython.double = strength / cube * (one / light[i])
                f[2 * i] = cython.cast(real, f[2 * i] + pull * dx)
                f[2 * i + 1] = cython.cast(real, f[2 * i + 1] + pull * dy)
