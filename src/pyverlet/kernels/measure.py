"""Sums over all particles in float64, in the user's order and on one thread: they never depend on the number of threads."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import LANES, add_lanes, load, load_rows, spread, where_above, where_zero, which_above, widen
from pyverlet.kernels.motion import BLOCK


@kernel
def _mechanical(position, velocity, acceleration, lag, spin, radius, mass, gx, gy, first, stop):
    """`mechanical` of the particles from `first` up to `stop`: eight sums at once, for one waits for every addition."""
    zero, half, quarter, inf = spread(0.0), spread(0.5), spread(0.25), spread(np.inf)
    later, down_x, down_y = spread(np.float64(lag)), spread(np.float64(gx)), spread(np.float64(gy))
    none, some = spread(spin.dtype.type(0)), spread(spin.dtype.type(1))
    sums, packed = zero, stop - (stop - first) % LANES
    for k in range(first, packed, LANES):
        m, w = widen(load(mass, k)), load(spin, k)
        x, y = load_rows(position, k)
        vx, vy = load_rows(velocity, k)
        vx, vy = widen(vx), widen(vy)
        if lag != 0.0:
            ax, ay = load_rows(acceleration, k)
            vx, vy = vx + later * widen(ax), vy + later * widen(ay)
        height = down_x * widen(x) + down_y * widen(y)
        m = where_above(inf, m, m, zero)  # a pinned particle has none
        energy = half * (vx * vx + vy * vy)
        if which_above(where_zero(w, none, some), none) != 0:  # smooth circles do not turn: a fourth of the work
            turning = widen(load(radius, k)) * widen(w)
            energy = energy + quarter * turning * turning
        sums = sums + m * (energy - height)
    total = add_lanes(sums, LANES)
    for i in range(packed, stop):
        m = np.float64(mass[i])
        if m < np.inf:
            vx, vy = np.float64(velocity[i, 0]), np.float64(velocity[i, 1])
            if lag != 0.0:
                vx += lag * acceleration[i, 0]
                vy += lag * acceleration[i, 1]
            turning = np.float64(radius[i]) * np.float64(spin[i])
            height = gx * np.float64(position[i, 0]) + gy * np.float64(position[i, 1])
            total += m * (0.5 * (vx * vx + vy * vy) + 0.25 * turning * turning - height)
    return total


@parallel_kernel
def mechanical(position, velocity, acceleration, lag, spin, radius, mass, gx, gy):
    """Sum of the three energies, J, with velocities moved on by `lag` seconds; 0 leaves the acceleration alone.

    Blocks of a fixed size are summed apart, and then together in order: any number of threads gives the same bits.
    """
    blocks = (mass.shape[0] + BLOCK - 1) // BLOCK
    part = np.zeros(blocks)
    for block in prange(blocks):
        first, stop = block * BLOCK, min((block + 1) * BLOCK, mass.shape[0])
        part[block] = _mechanical(position, velocity, acceleration, lag, spin, radius, mass, gx, gy, first, stop)
    total = 0.0
    for block in range(blocks):
        total += part[block]
    return total


@kernel
def gained(position, velocity, spin, radius, mass, now_position, now_velocity, now_spin, now_radius, now_mass, gx, gy):
    """How much larger `mechanical` is now, J."""
    before = mechanical(position, velocity, velocity, 0.0, spin, radius, mass, gx, gy)
    return mechanical(now_position, now_velocity, now_velocity, 0.0, now_spin, now_radius, now_mass, gx, gy) - before
