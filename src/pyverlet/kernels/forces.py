"""Forces on all particles at once: each kernel adds newtons to `force` (n, 2).

Pinned particles are left out: no force moves them, and one that grows with mass would be infinite.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.kernels.seam import nearest

_ONE = np.uint64(1)

_BLOCK = 4096
"""Particles that one thread takes at a time."""


@kernel
def _resistance(ux, uy, w, linear, quadratic, h, half):
    """Times -u it is the force on one. All is computed, whether it counts or not: so it is done for eight at a time."""
    c, whole = linear + quadratic * np.sqrt(ux * ux + uy * uy), w * h
    most = half / whole
    return most if c * whole > half else c


@kernel
def drag(force, velocity, wind, inverse_mass, linear, quadratic, h):
    """F = -(linear + quadratic |u|) u with u = v - wind; `wind` has a row for each particle, or one for all.

    No more than m u / 2 h, which takes half of u in a substep of h seconds: resistance turns nobody round. With m u / h
    integrators of Stormer's kind, which reckon with the acceleration of the substep before, swing for ever.
    """
    f, v, air, half = force.reshape(-1), velocity.reshape(-1), wind.reshape(-1), force.dtype.type(0.5)
    if wind.shape[0] > 1:
        for k in range(inverse_mass.shape[0]):
            i = np.uint64(2 * k)
            ux, uy = v[i] - air[i], v[i + _ONE] - air[i + _ONE]
            c = _resistance(ux, uy, inverse_mass[np.uint64(k)], linear, quadratic, h, half)
            f[i], f[i + _ONE] = f[i] - c * ux, f[i + _ONE] - c * uy
        return
    x, y = air[0], air[1]
    for k in range(inverse_mass.shape[0]):
        i = np.uint64(2 * k)
        ux, uy = v[i] - x, v[i + _ONE] - y
        c = _resistance(ux, uy, inverse_mass[np.uint64(k)], linear, quadratic, h, half)
        f[i], f[i + _ONE] = f[i] - c * ux, f[i + _ONE] - c * uy


@kernel
def attract(force, position, inverse_mass, x, y, strength, softening, period_x, period_y):
    """F = m strength d / (|d|^2 + softening^2)^(3/2), d from the particle to (x, y); none on a particle at that very point."""
    zero = strength - strength
    one = force.dtype.type(1)
    for i in range(position.shape[0]):
        dx = nearest(x - position[i, 0], period_x)
        dy = nearest(y - position[i, 1], period_y)
        square = dx * dx + dy * dy + softening * softening
        cube = np.float64(square) * np.sqrt(np.float64(square))  # of float32 it underflows at 1e-15 m
        if cube > 0.0 and inverse_mass[i] > zero:
            pull = strength / cube * (one / inverse_mass[i])
            force[i, 0] += pull * dx
            force[i, 1] += pull * dy


@parallel_kernel
def gravitate(force, position, mass, slot, strength, softening, period_x, period_y):
    """Every pair of the particles in these slots attracts: F = strength m_i m_j d / (|d|^2 + softening^2)^(3/2).

    Each particle sums over all others in the order of `slot`, in float64: one writer each, so the same bits on any threads.
    """
    square_of_softening = np.float64(softening) * np.float64(softening)
    for k in prange(slot.shape[0]):
        i = slot[k]
        m = np.float64(mass[i])
        if m < np.inf:
            x = np.float64(position[i, 0])
            y = np.float64(position[i, 1])
            fx = fy = 0.0
            for other in range(slot.shape[0]):
                j = slot[other]
                dx = nearest(np.float64(position[j, 0]) - x, period_x)
                dy = nearest(np.float64(position[j, 1]) - y, period_y)
                square = dx * dx + dy * dy + square_of_softening
                cube = square * np.sqrt(square)
                if cube > 0.0 and mass[j] < np.inf:  # it underflows before the square does
                    pull = np.float64(mass[j]) / cube
                    fx += pull * dx
                    fy += pull * dy
            force[i, 0] += strength * m * fx
            force[i, 1] += strength * m * fy


@kernel
def gravitational_potential(position, mass, softening, period_x, period_y):
    """Sum over pairs of -m_i m_j / sqrt(|d|^2 + softening^2), in float64; to be multiplied by the strength."""
    total = 0.0
    for i in range(mass.shape[0]):
        for j in range(i):
            dx = nearest(position[j, 0] - position[i, 0], period_x)
            dy = nearest(position[j, 1] - position[i, 1], period_y)
            square = dx * dx + dy * dy + softening * softening
            if square > 0.0 and mass[i] < np.inf and mass[j] < np.inf:
                total -= mass[i] * mass[j] / np.sqrt(square)
    return total


@parallel_kernel
def call(function, force, position, velocity, mass, t):
    """Have the user's function, as `compile.native` makes it, add to `force`; for how many particles that is not finite."""
    wrong = 0
    for block in prange((mass.shape[0] + _BLOCK - 1) // _BLOCK):
        a, b = block * _BLOCK, min((block + 1) * _BLOCK, mass.shape[0])
        wrong += function(force[a:b], position[a:b], velocity[a:b], mass[a:b], t)
    return wrong


@kernel
def call_potential(function, position, mass):
    """Sum of the user's `function(x, y, mass)` over all free particles, J."""
    total = 0.0
    for i in range(mass.shape[0]):
        m = np.float64(mass[i])
        if m < np.inf:
            total += function(np.float64(position[i, 0]), np.float64(position[i, 1]), m)
    return total
