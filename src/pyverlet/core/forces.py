# mypy: ignore-errors
"""Forces on all particles at once, and random kicks: each kernel adds to `force` (n, 2), in newtons, once per substep.

Forces on pinned particles are ignored; those that grow with mass leave them out, as they would be infinite. User-defined
functions are called with columns of float64. Random numbers are a function of seed, particle and time (counter-based), so they
do not depend on the order of drawing.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, const_integers, const_reals, const_small_integers, doubles, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, cos, isfinite, log, sin, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t, uint64_t

from pyverlet.core.kernels import inlined
from pyverlet.core.periodic import nearest_of

# SplitMix64 (Steele, Lea, Flood 2014, in Stafford's variant), which mixes a counter to independent-looking values.
GAMMA = cython.declare(uint64_t, 0x9E3779B97F4A7C15)
FIRST = cython.declare(uint64_t, 0xBF58476D1CE4E5B9)
SECOND = cython.declare(uint64_t, 0x94D049BB133111EB)

TWO_PI = cython.declare(cython.double, 6.283185307179586)
UNIT = cython.declare(cython.double, 1.1102230246251565e-16)  # 2^-53


def add_drag(force, velocity, resistance, wind, linear: real, quadratic: real):
    """F = -(linear + quadratic |u|) u with u = v - wind, (n, 2), or (1, 2) where the medium moves everywhere alike.

    resistance: (n,) N s/m, increased by the derivative of the force by speed, which `soften` needs.
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


@inlined
def soften_forces(
    f: cython.pointer(real), r: cython.pointer(real), light: cython.pointer[cython.const[real]], count: cython.Py_ssize_t,
    gx: real, gy: real, h: real,
) -> cython.void:  # fmt: skip
    """Scale the acceleration of particles, gravity (gx, gy) included, where drag would stop them within a substep of h seconds.

    With z = c h / m above 1/2, the velocity goes k = 3/4 - 1 / 8 z of the way to the equilibrium velocity, instead of z: it gets
    there without oscillation, however strong the drag is, and terminal speeds are exact. With k = 1, Stormer integrators, which
    use the acceleration of the previous substep, would oscillate for ever.
    """
    one: real = 1
    half: real = 0.5
    most: real = 0.75
    eighth: real = 0.125
    for i in range(count):
        w: real = light[i]
        z: real = r[i] * w * h
        if z > half:
            part: real = (most - eighth / z) / z
            m: real = (one - part) / w
            f[2 * i] = part * f[2 * i] - m * gx
            f[2 * i + 1] = part * f[2 * i + 1] - m * gy
        r[i] = 0


def soften(force, resistance, inverse_mass, gx: real, gy: real, h: real):
    """Soften the forces on all particles, see `soften_forces`."""
    f: cython.pointer(real) = reals(force)
    r: cython.pointer(real) = reals(resistance)
    light: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(resistance)
    with cython.nogil:
        soften_forces(f, r, light, count, gx, gy, h)


def attract(force, position, inverse_mass, x: real, y: real, strength: real, softening: real, period_x: real, period_y: real):
    """F = m strength d / (|d|^2 + softening^2)^(3/2), d from the particle to (x, y); none on a particle at that point."""
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
            cube: cython.double = square * sqrt(square)  # float32 would underflow at 1e-15 m
            if cube > 0 and light[i] > 0:
                pull: cython.double = strength / cube * (one / light[i])
                f[2 * i] = cython.cast(real, f[2 * i] + pull * dx)
                f[2 * i + 1] = cython.cast(real, f[2 * i + 1] + pull * dy)


def function_arguments(position, velocity, mass, columns):
    """Write columns (5, n) float64: x, y, vx, vy and masses."""
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

    columns: as above. Returns the number of particles with finite position and velocity for which they are not finite.
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


@inlined
def scrambled(value: uint64_t) -> uint64_t:
    """The output of SplitMix64 for this state."""
    value = (value ^ (value >> 30)) * FIRST
    value = (value ^ (value >> 27)) * SECOND
    return value ^ (value >> 31)


@inlined
def next_key(key: uint64_t, counter: int64_t) -> uint64_t:
    """Derive a key from a key and a counter."""
    return scrambled((key ^ cython.cast(uint64_t, counter)) + GAMMA)


def thermalize(
    velocity, position, inverse_mass, particle, number, when, keeps: cython.double, thermal: cython.double, ahead: cython.double
) -> float:
    """v' = keeps v + sqrt((1 - keeps^2) thermal / m) N for free particles, with N standard normal in each direction.

    Positions move by `ahead` s times the change of velocity. Returns the kinetic energy gained, J.

    particle (n,) int32: index in `number`, int64, of each row; when: (seed, frame, substep), integers from 0 on.
    thermal: kT, J.
    """
    v: cython.pointer(real) = reals(velocity)
    x: cython.pointer(real) = reals(position)
    light: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    which: cython.pointer[cython.const[int32_t]] = const_small_integers(particle)
    name: cython.pointer[cython.const[int64_t]] = const_integers(number)
    count: cython.Py_ssize_t = len(velocity)
    seed: int64_t = when[0]
    frame: int64_t = when[1]
    substep: int64_t = when[2]
    gained: cython.double = 0.0
    with cython.nogil:
        key: uint64_t = next_key(next_key(next_key(0, seed), frame), substep)
        for i in range(count):
            w: cython.double = light[i]
            if not w > 0:
                continue
            a: uint64_t = next_key(key, name[which[i]])
            b: uint64_t = scrambled(a + GAMMA)
            # Box and Muller 1958: two normal numbers from two uniform ones, the first of which is never 0.
            size: cython.double = sqrt(-2.0 * log((cython.cast(cython.double, a >> 11) + 0.5) * UNIT))
            angle: cython.double = TWO_PI * (cython.cast(cython.double, b >> 11) * UNIT)
            spread: cython.double = size * sqrt((1.0 - keeps * keeps) * thermal * w)
            vx: cython.double = v[2 * i]
            vy: cython.double = v[2 * i + 1]
            v[2 * i] = cython.cast(real, keeps * vx + spread * cos(angle))
            v[2 * i + 1] = cython.cast(real, keeps * vy + spread * sin(angle))
            dx: cython.double = v[2 * i] - vx
            dy: cython.double = v[2 * i + 1] - vy
            x[2 * i] = cython.cast(real, x[2 * i] + ahead * dx)
            x[2 * i + 1] = cython.cast(real, x[2 * i + 1] + ahead * dy)
            gained += 0.5 * (dx * (v[2 * i] + vx) + dy * (v[2 * i + 1] + vy)) / w
    return gained
