# mypy: ignore-errors
"""Random kicks whose numbers are a function of a seed, of the particle and of the time, whatever has been drawn before."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_integers, const_reals, const_small_integers, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import cos, log, sin, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t, uint64_t

from pyverlet.core.kernels import inlined

# Of SplitMix64 (Steele, Lea, Flood 2014, the variant of Stafford): each value differs from the next as if thrown by dice.
GAMMA = cython.declare(uint64_t, 0x9E3779B97F4A7C15)
FIRST = cython.declare(uint64_t, 0xBF58476D1CE4E5B9)
SECOND = cython.declare(uint64_t, 0x94D049BB133111EB)

TWO_PI = cython.declare(cython.double, 6.283185307179586)
UNIT = cython.declare(cython.double, 1.1102230246251565e-16)  # 2^-53


@inlined
def scrambled(value: uint64_t) -> uint64_t:
    """The number of SplitMix64 for this state."""
    value = (value ^ (value >> 30)) * FIRST
    value = (value ^ (value >> 27)) * SECOND
    return value ^ (value >> 31)


@inlined
def next_key(key: uint64_t, counter: int64_t) -> uint64_t:
    """A key for one more counter."""
    return scrambled((key ^ cython.cast(uint64_t, counter)) + GAMMA)


def thermalize(
    velocity, position, inverse_mass, particle, number, when, keeps: cython.double, thermal: cython.double, ahead: cython.double
) -> float:
    """v' = keeps v + sqrt((1 - keeps^2) thermal / m) N with N normal, of variance 1, for each direction of free particles.

    Positions are moved by `ahead` s of what velocities change by. Returns the kinetic energy gained, J.

    particle (n,) int32: which of `number`, int64, is that of each; when: (seed, frame, substep), whole numbers from 0 on.
    thermal: kT, J.
    """
    v: cython.pointer(real) = reals(velocity)
    x: cython.pointer(real) = reals(position)
    light: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    who: cython.pointer[cython.const[int32_t]] = const_small_integers(particle)
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
            a: uint64_t = next_key(key, name[who[i]])
            b: uint64_t = scrambled(a + GAMMA)
            # Box and Muller 1958: two normal numbers of two even ones, the first of them never 0.
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
