"""Sums over all particles in float64, in the user's order and on one thread: they never depend on the number of threads."""

from __future__ import annotations

import numpy as np

from pyverlet._jit import kernel, parallel_kernel, prange


@kernel
def energies(position, velocity, spin, radius, mass, gx, gy):
    """(kinetic energy of motion, of spin, potential energy of gravity, 0 at the origin), J. Pinned particles have none."""
    motion = turning = height = 0.0
    for i in range(mass.shape[0]):
        m = np.float64(mass[i])
        if m < np.inf:
            vx, vy = np.float64(velocity[i, 0]), np.float64(velocity[i, 1])
            w, r = np.float64(spin[i]), np.float64(radius[i])
            motion += 0.5 * m * (vx * vx + vy * vy)
            turning += 0.25 * m * r * r * w * w
            height -= m * (gx * np.float64(position[i, 0]) + gy * np.float64(position[i, 1]))
    return motion, turning, height


_BLOCK = 4096


@parallel_kernel
def mechanical(position, velocity, acceleration, lag, spin, radius, mass, gx, gy):
    """Sum of the three energies, J, with velocities moved on by `lag` seconds; 0 leaves the acceleration alone.

    Blocks of a fixed size are summed apart, and then together in order: any number of threads gives the same bits.
    """
    blocks = (mass.shape[0] + _BLOCK - 1) // _BLOCK
    part = np.zeros(blocks)
    for block in prange(blocks):
        total = 0.0
        for i in range(block * _BLOCK, min((block + 1) * _BLOCK, mass.shape[0])):
            m = np.float64(mass[i])
            if m < np.inf:
                vx, vy = np.float64(velocity[i, 0]), np.float64(velocity[i, 1])
                if lag != 0.0:
                    vx += lag * acceleration[i, 0]
                    vy += lag * acceleration[i, 1]
                turning = np.float64(radius[i]) * np.float64(spin[i])
                height = gx * np.float64(position[i, 0]) + gy * np.float64(position[i, 1])
                total += m * (0.5 * (vx * vx + vy * vy) + 0.25 * turning * turning - height)
        part[block] = total
    total = 0.0
    for block in range(blocks):
        total += part[block]
    return total


@kernel
def momenta(position, velocity, spin, radius, mass):
    """(momentum x, momentum y, angular momentum about the origin, spin included); kg m/s and kg m^2/s."""
    px = py = turning = 0.0
    for i in range(mass.shape[0]):
        m = np.float64(mass[i])
        if m < np.inf:
            vx, vy = m * np.float64(velocity[i, 0]), m * np.float64(velocity[i, 1])
            r = np.float64(radius[i])
            px += vx
            py += vy
            turning += np.float64(position[i, 0]) * vy - np.float64(position[i, 1]) * vx
            turning += 0.5 * m * r * r * np.float64(spin[i])
    return px, py, turning
