# mypy: ignore-errors
"""Solves v = u + s a(v) for forces that depend on velocity, by the secant method in two dimensions (Broyden 1965)."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, doubles, reals
from cython.cimports.lanes import real

from pyverlet.core.kernels import inlined

NUMBERS = cython.declare(cython.Py_ssize_t, 10)
"""Memory per particle: v, u + s a - v, its 2 x 2 Jacobian by v, and the last step."""

FAR = cython.declare(cython.double, 1e-5)
"""Tolerance of steps, relative to v and to s a."""


def next_velocity(velocity, base, acceleration, memory, s: cython.double, first: cython.bint) -> bool:
    """Advance `velocity` v (n, 2), at which `acceleration` a was evaluated, towards the solution of v = base + s a.

    The Jacobian starts as minus one, as if a did not depend on v. If a is linear in v, the third step is exact, however
    strong a is. Returns whether a step is longer than FAR.

    Args:
        velocity: (n, 2) m/s, replaced by the next velocity to evaluate.
        base: (n, 2) m/s.
        acceleration: (n, 2) m/s^2, replaced by (v - base) / s.
        memory: (n, 10), kept between evaluations.
        s: s.
        first: whether this is the first evaluation.
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
            # Forces that do not drive motion change the right side by at least as much as v, so longer steps are rejected.
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
    """Update the Jacobian for the last step (x, y), which changed (fx, fy), keeping its value across that step."""
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
