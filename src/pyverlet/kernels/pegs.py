"""Circles between two that are pinned, and nearer to each other than the circle is wide: they stay on the side they came from.

Pushed out of one such peg and then out of the other a circle goes from side to side, and neither push has much of what would
send it back: the less, the nearer it is to the middle. So both conditions are met at once, as by obstacles (`kernels.meetings`):
the place is where it touches both, and the velocity leads into neither.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.kernels.motion import ON_WALL


@kernel
def _frame(position, a, b):
    """From peg a to peg b: distance, m, and unit vector."""
    dx, dy = np.float64(position[b, 0]) - position[a, 0], np.float64(position[b, 1]) - position[a, 1]
    distance = np.sqrt(dx * dx + dy * dy)
    return distance, dx / distance, dy / distance


@kernel
def _corner(distance, one, other):
    """(along, across) from the first peg, of the place that is `one` away from it and `other` from the second; across >= 0."""
    along = (one * one - other * other + distance * distance) / (2.0 * distance)
    return along, np.sqrt(max(one * one - along * along, 0.0))


@kernel
def beside(first, count, pair_i, pair_j, inverse_mass, circle, peg):
    """Circles and pegs that are listed as near each other, into `circle` and `peg` (pairs,). Returns how many there are."""
    found = 0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            i, j = np.int64(pair_i[k]), np.int64(pair_j[k])
            if (inverse_mass[i] == 0) != (inverse_mass[j] == 0):
                circle[found], peg[found] = (j, i) if inverse_mass[i] == 0 else (i, j)
                found += 1
    return found


@kernel
def narrow(position, radius, circle, first, second, found):
    """Which of these circles cannot pass between these pegs, and would be held by both at more than a right angle.

    found: (k,) becomes 1 or 0.
    """
    for k in range(circle.shape[0]):
        i, a, b = circle[k], first[k], second[k]
        one, other = np.float64(radius[i]) + radius[a], np.float64(radius[i]) + radius[b]
        distance, _, _ = _frame(position, a, b)
        found[k] = 0
        if abs(one - other) < distance < one + other:
            along, across = _corner(distance, one, other)
            found[k] = along * (along - distance) + across * across < 0.0


@kernel
def note_sides(position, velocity, circle, first, second, h, side):
    """Of each circle, on which side of the line from one peg to the other it was a substep ago: 1, -1, or 0 for on the line."""
    for k in range(circle.shape[0]):
        i, a, b = circle[k], first[k], second[k]
        _, ux, uy = _frame(position, a, b)
        x = np.float64(position[i, 0]) - np.float64(h) * velocity[i, 0] - position[a, 0]
        y = np.float64(position[i, 1]) - np.float64(h) * velocity[i, 1] - position[a, 1]
        across = ux * y - uy * x
        side[k] = 1.0 if across > 0.0 else -1.0 if across < 0.0 else 0.0


@kernel
def _along(u, v, speed, nx, ny, mx, my):
    """The velocity (u, v), whose part along n is `speed`, without that; none if what is left leads into the peg of normal m."""
    u, v = u - speed * nx, v - speed * ny
    return (u, v) if u * mx + v * my > 0.0 else (0.0, 0.0)


@kernel
def hold(position, velocity, resting, size, circle, first, second, side):
    """Put circles that are between their pegs, or have gone through, back to where they touch both."""
    for k in range(circle.shape[0]):
        i, a, b = circle[k], first[k], second[k]
        one, other = np.float64(size[i]) + size[a], np.float64(size[i]) + size[b]
        distance, ux, uy = _frame(position, a, b)
        if side[k] == 0.0 or not abs(one - other) < distance < one + other:
            continue
        if velocity[a, 0] != 0.0 or velocity[a, 1] != 0.0 or velocity[b, 0] != 0.0 or velocity[b, 1] != 0.0:
            continue  # pegs that are on their way would push it through a wall
        x, y = np.float64(position[i, 0]) - position[a, 0], np.float64(position[i, 1]) - position[a, 1]
        s, t = ux * x + uy * y, side[k] * (ux * y - uy * x)
        along, across = _corner(distance, one, other)
        # Between the pegs, and nearer to their line than where it touches both, it is in one of them or both.
        if not (0.0 < s < distance and t < across):
            continue
        nx, ny = -side[k] * uy, side[k] * ux  # across, to the side it came from
        position[i, 0] = position[a, 0] + along * ux + across * nx
        position[i, 1] = position[a, 1] + along * uy + across * ny
        resting[i] |= ON_WALL
        # Away from each peg: (along, across) and (along - distance, across), over how far they are.
        u, v = np.float64(velocity[i, 0]) * ux + np.float64(velocity[i, 1]) * uy, velocity[i, 0] * nx + velocity[i, 1] * ny
        from_one, from_other = (u * along + v * across) / one, (u * (along - distance) + v * across) / other
        if from_one < 0.0 and from_other < 0.0:
            u = v = 0.0
        elif from_one < 0.0:
            u, v = _along(u, v, from_one, along / one, across / one, (along - distance) / other, across / other)
        elif from_other < 0.0:
            u, v = _along(u, v, from_other, (along - distance) / other, across / other, along / one, across / one)
        velocity[i, 0] = u * ux + v * nx
        velocity[i, 1] = u * uy + v * ny
