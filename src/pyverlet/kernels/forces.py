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
def drag(force, velocity, wind, resistance, linear, quadratic):
    """F = -(linear + quadratic |u|) u with u = v - wind; `wind` has a row for each particle, or one for all.

    resistance (n,): N s/m, grows by what the force changes by with the speed; `soften` needs to know.
    """
    f, v, air, two = force.reshape(-1), velocity.reshape(-1), wind.reshape(-1), force.dtype.type(2.0)
    if wind.shape[0] > 1:
        for k in range(resistance.shape[0]):
            i = np.uint64(2 * k)
            ux, uy = v[i] - air[i], v[i + _ONE] - air[i + _ONE]
            more = quadratic * np.sqrt(ux * ux + uy * uy)
            resistance[k] += linear + two * more
            f[i], f[i + _ONE] = f[i] - (linear + more) * ux, f[i + _ONE] - (linear + more) * uy
        return
    x, y = air[0], air[1]
    for k in range(resistance.shape[0]):
        i = np.uint64(2 * k)
        ux, uy = v[i] - x, v[i + _ONE] - y
        more = quadratic * np.sqrt(ux * ux + uy * uy)
        resistance[k] += linear + two * more
        f[i], f[i + _ONE] = f[i] - (linear + more) * ux, f[i + _ONE] - (linear + more) * uy


@kernel
def soften(force, resistance, inverse_mass, gx, gy, h):
    """Scale all that accelerates a particle, gravity (gx, gy) included, where drag would stop it within a substep of h seconds.

    With z = c h / m beyond 1/2 the velocity goes by k = 3/4 - 1 / 8 z of the way to where all forces balance, instead of by z: it
    gets there without swinging, however strong the drag is, and terminal speeds are exact. With k = 1 integrators of Stormer's
    kind, which reckon with the acceleration of the substep before, would swing for ever.
    """
    f, zero, one = force.reshape(-1), force.dtype.type(0.0), force.dtype.type(1.0)
    half, most, eighth = force.dtype.type(0.5), force.dtype.type(0.75), force.dtype.type(0.125)
    for k in range(resistance.shape[0]):
        i, w = np.uint64(2 * k), inverse_mass[np.uint64(k)]
        z = resistance[k] * w * h
        if z > half:
            part = (most - eighth / z) / z
            m = (one - part) / w
            f[i], f[i + _ONE] = part * f[i] - m * gx, part * f[i + _ONE] - m * gy
        resistance[k] = zero


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
    """Have the user's function, as `laws.forces._native` makes it, add to `force`; for how many particles that is not finite."""
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
