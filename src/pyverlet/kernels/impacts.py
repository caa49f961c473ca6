"""Impacts between circles: pairs that meet faster than contact at rest explains bounce.

It happens before projection, while velocities are still those of the motion: a pair that meets faster than contact at
rest explains goes back to when and where it touched, gets the impulse (1 + e) v_n there, and travels the time since with the new
velocities. So e = 1 keeps the kinetic energy, and any e the angular momentum, to rounding, in whatever order the pairs come. Two
circles that both carried weight a substep ago do not meet, they tremble: bouncing them keeps small ones in a pile rattling.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.kernels.bounds import CARRIES, impact_time

# How a candidate pair stands at the end of the integration, before contacts have changed a velocity.
APART, RESTING, PARTING = 0, 1, 2


@kernel
def part(position, velocity, inverse_mass, i, j, nx, ny, shift, kick):
    """Move i and j apart along n by `shift` per inverse mass, and their velocities by `kick`."""
    wi, wj = inverse_mass[i], inverse_mass[j]
    position[i, 0] -= shift * wi * nx
    position[i, 1] -= shift * wi * ny
    position[j, 0] += shift * wj * nx
    position[j, 1] += shift * wj * ny
    velocity[i, 0] -= kick * wi * nx
    velocity[i, 1] -= kick * wi * ny
    velocity[j, 0] += kick * wj * nx
    velocity[j, 1] += kick * wj * ny


@kernel
def _impact_strip(
    position, velocity, acceleration, radius, inverse_mass, restitution, pair_i, pair_j, h, lag, e, rest_speed,
    fed, meeting, impulse, spent,
):  # fmt: skip
    zero = h - h
    half = h / (h + h)
    for k in range(pair_i.shape[0]):
        i, j = pair_i[k], pair_j[k]
        dx = position[j, 0] - position[i, 0]
        dy = position[j, 1] - position[i, 1]
        reach = radius[i] + radius[j]
        square = dx * dx + dy * dy
        if square >= reach * reach:
            meeting[k] = APART
            continue
        impulse[k] = zero
        # Relative to each other, and at the time of the position.
        ax = acceleration[j, 0] - acceleration[i, 0]
        ay = acceleration[j, 1] - acceleration[i, 1]
        vx = velocity[j, 0] - velocity[i, 0] + lag * ax
        vy = velocity[j, 1] - velocity[i, 1] + lag * ay
        along = dx * vx + dy * vy
        if fed[i] & fed[j] & CARRIES or square == zero:
            # Both carried weight a substep ago: what speed they have is the trembling of the pile, not an arrival.
            meeting[k] = RESTING
        elif along > rest_speed * np.sqrt(square):
            meeting[k] = PARTING
        elif along >= zero:
            meeting[k] = RESTING
        else:
            time = impact_time(dx, dy, vx, vy, ax, ay, reach, h)
            dx -= time * (vx - half * time * ax)
            dy -= time * (vy - half * time * ay)
            # In float64, so that velocities are rounded once, as in `kernels.bounce`.
            distance = np.sqrt(np.float64(dx) * dx + np.float64(dy) * dy)
            nx, ny = dx / distance, dy / distance
            ux = np.float64(velocity[j, 0]) - velocity[i, 0] + (np.float64(lag) - time) * ax
            uy = np.float64(velocity[j, 1]) - velocity[i, 1] + (np.float64(lag) - time) * ay
            hit = -(ux * nx + uy * ny)
            if hit > rest_speed:
                bounce = _pair_restitution(restitution[i], restitution[j], e)
                w = np.float64(inverse_mass[i]) + inverse_mass[j]
                kick = (hit + bounce * hit) / w
                meeting[k] = PARTING
                impulse[k] = kick
                part(position, velocity, inverse_mass, i, j, nx, ny, time * kick, kick)
                spent[0] -= 0.5 * hit * hit * (1.0 - np.float64(bounce) * bounce) / w
            else:
                meeting[k] = RESTING


@kernel
def _pair_restitution(a, b, e):
    """The larger of two circles' restitutions; e, that of all, stands for one that is negative: not given."""
    return max(a if a >= a - a else e, b if b >= b - b else e)


@parallel_kernel
def impacts(
    position, velocity, acceleration, radius, inverse_mass, restitution, first, count, pair_i, pair_j, h, lag, e, rest_speed,
    fed, meeting, impulse, spent,
):  # fmt: skip
    """Bounce every pair that meets faster than rest_speed; note in `meeting` how each stands, in `impulse` how hard it hit.

    spent[s, 0] gains the energy the impacts of strip s have taken, J, negative.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            _impact_strip(
                position, velocity, acceleration, radius, inverse_mass, restitution, pair_i[a:b], pair_j[a:b], h, lag, e,
                rest_speed, fed, meeting[a:b], impulse[a:b], spent[s],
            )  # fmt: skip
