"""Sums over all particles in float64, in the user's order and on one thread: they never depend on the number of threads."""

from __future__ import annotations

import numpy as np

from pyverlet._jit import kernel


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
