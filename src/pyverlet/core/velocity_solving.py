# mypy: ignore-errors
"""Velocities that forces see and lead to, v = u + s a(v), found by the secant method in two dimensions (Broyden 1965)."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, doubles, reals
from cython.cimports.lanes import real

from pyverlet.core.kernels import inlined

NUMBERS = cython.declare(cython.Py_ssize_t, 10)
"""That are remembered of a particle: v, u + s a - v, the 2 x 2 matrix by which that changes with v, and the last step."""

FAR = cython.declare(cython.double, 1e-5)
"""Of v and of s a: after longer steps another one is due."""


def next_velocity(velocity, base, acceleration, memory, s: cython.double, first: cython.bint) -> bool:
    """From `velocity` v (n, 2), at which `acceleration` a has been evaluated, to where v = base + s a, as far as is known.

    The matrix is minus one at first, as if a did not depend on v. Where a is linear in v, the third step is exact, however
    strong a is. Returns whether a step is longer than FAR.

    Args:
        velocity: (n, 2) m/s, becomes what to evaluate next.
        base: (n, 2) m/s.
        acceleration: (n, 2) m/s^2, becomes (v - base) / s.
        memory: (n, 10), kept from one evaluation to the next.
        s: s.
        first: whether it is the first evaluation.
    """
    to: cython.pointer(real) = reals(velocity)
    u: cython.pointer[cython.const[real]] = const_reals(base)
    a: cython.pointer(real) = reals(acceleration)
    m: cython.pointer(cython.double) = doubles(memory)
    count: cython.Py_ssize_t = len(velocity)
    far: cython.bint = False
    rate: cython.double = 1.0 / s
    with cython.nogil:
        for i in range(count):
            k: cython.Py_ssize_t = NUMBERS * i
            vx: cython.double = to[2 * i]
            vy: cython.double = to[2 * i + 1]
            fx: cython.double = u[2 * i] + s * a[2 * i] - vx
            fy: cython.double = u[2 * i + 1] + s * a[2 * i + 1] - vy
            if first:
                m[k + 4] = m[k + 7] = -1.0
                m[k + 5] = m[k + 6] = m[k + 8] = m[k + 9] = 0.0
            else:
                learn(m, k, vx - m[k], vy - m[k + 1], fx - m[k + 2], fy - m[k + 3])
            x: cython.double = fx
            y: cython.double = fy
            if not first:
                part: cython.double = 1.0 / (m[k + 4] * m[k + 7] - m[k + 5] * m[k + 6])
                x = part * (m[k + 5] * fy - m[k + 7] * fx)
                y = part * (m[k + 6] * fx - m[k + 4] * fy)
            # Forces that do not drive motion change the right side by at least as much as v: a longer step is none of theirs.
            if not 0.25 * (x * x + y * y) <= fx * fx + fy * fy:
                x = fx
                y = fy
            m[k] = vx
            m[k + 1] = vy
            m[k + 2] = fx
            m[k + 3] = fy
            to[2 * i] = cython.cast(real, vx + x)
            to[2 * i + 1] = cython.cast(real, vy + y)
            a[2 * i] = cython.cast(real, a[2 * i] + rate * (x - fx))
            a[2 * i + 1] = cython.cast(real, a[2 * i + 1] + rate * (y - fy))
            fx += vx - u[2 * i]  # s a
            fy += vy - u[2 * i + 1]
            far |= x * x + y * y > FAR * FAR * (vx * vx + vy * vy + fx * fx + fy * fy)
    return far


@inlined
def learn(
    m: cython.pointer(cython.double), k: cython.Py_ssize_t,
    x: cython.double, y: cython.double, fx: cython.double, fy: cython.double,
) -> cython.void:  # fmt: skip
    """The matrix is to tell what the last step (x, y) has changed (fx, fy), and what the one before did: that across it."""
    fx -= m[k + 4] * x + m[k + 5] * y
    fy -= m[k + 6] * x + m[k + 7] * y
    px: cython.double = -m[k + 9]
    py: cython.double = m[k + 8]
    along: cython.double = px * x + py * y
    if along * along <= 0.01 * (px * px + py * py) * (x * x + y * y):
        px = x
        py = y
        along = x * x + y * y
    if along != 0.0:
        px /= along
        py /= along
        m[k + 4] += fx * px
        m[k + 5] += fx * py
        m[k + 6] += fy * px
        m[k + 7] += fy * py
    m[k + 8] = x
    m[k + 9] = y
