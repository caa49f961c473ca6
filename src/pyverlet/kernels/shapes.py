"""What links measure: the value C of each row, 0 where the link is content, and its gradient by every particle of the row.

Row r concerns the particles particle[e] for e in first[r] to first[r + 1]; its gradient stands in gradient[e]. bend[r]
is how fast the gradient turns when particles move, the size of the second derivatives. All float64.
A new type of link is one more function of this form.
"""

from __future__ import annotations

import math

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.kernels.seam import nearest


@kernel
def _way(position, i, j, period_x, period_y):
    """From i to j, m."""
    return nearest(position[j, 0] - position[i, 0], period_x), nearest(position[j, 1] - position[i, 1], period_y)


@kernel
def measure_distance(r, e, position, period_x, period_y, particle, rest, value, gradient, bend):
    """One row of `distance`."""
    i, j = particle[e], particle[e + 1]
    dx = nearest(position[j, 0] - position[i, 0], period_x)
    dy = nearest(position[j, 1] - position[i, 1], period_y)
    length = math.sqrt(dx * dx + dy * dy)
    if length > 0.0:
        nx, ny = dx / length, dy / length
    else:  # any direction is as good
        nx, ny = 1.0, 0.0
    value[r] = length - rest[r]
    bend[r] = 1.0 / max(length, 1e-12)
    gradient[e, 0] = -nx
    gradient[e, 1] = -ny
    gradient[e + 1, 0] = nx
    gradient[e + 1, 1] = ny


@parallel_kernel
def distance(position, period_x, period_y, first, particle, rest, begin, end, value, gradient, bend):
    """C = |x_j - x_i| - rest, m."""
    for r in prange(begin, end):
        measure_distance(r, first[r], position, period_x, period_y, particle, rest, value, gradient, bend)


@parallel_kernel
def angle(position, period_x, period_y, first, particle, rest, begin, end, value, gradient, bend):
    """C = angle from j -> i to j -> k, counter-clockwise, minus rest, in -pi to pi, rad."""
    for r in prange(begin, end):
        e = first[r]
        i, j, k = particle[e], particle[e + 1], particle[e + 2]
        ax, ay = nearest(position[i, 0] - position[j, 0], period_x), nearest(position[i, 1] - position[j, 1], period_y)
        bx, by = nearest(position[k, 0] - position[j, 0], period_x), nearest(position[k, 1] - position[j, 1], period_y)
        turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by) - rest[r]
        value[r] = turn - 2.0 * math.pi * np.floor(turn / (2.0 * math.pi) + 0.5)
        a2, b2 = max(ax * ax + ay * ay, 1e-300), max(bx * bx + by * by, 1e-300)
        bend[r] = 1.0 / min(a2, b2)
        gradient[e, 0] = ay / a2
        gradient[e, 1] = -ax / a2
        gradient[e + 2, 0] = -by / b2
        gradient[e + 2, 1] = bx / b2
        gradient[e + 1, 0] = -gradient[e, 0] - gradient[e + 2, 0]
        gradient[e + 1, 1] = -gradient[e, 1] - gradient[e + 2, 1]


@parallel_kernel
def area(position, period_x, period_y, first, particle, rest, begin, end, value, gradient, bend):
    """C = area of the ring, positive if it runs counter-clockwise, minus rest, m^2 (the shoelace formula)."""
    for r in prange(begin, end):
        a, b = first[r], first[r + 1]
        # From corner to corner, each the nearest image of the one before; seen from the first, for far away digits would cancel.
        twice = x = y = 0.0
        bx, by = _way(position, particle[b - 1], particle[a], period_x, period_y)
        for e in range(a, b):
            ax, ay = _way(position, particle[e], particle[e + 1] if e + 1 < b else particle[a], period_x, period_y)
            gradient[e, 0] = 0.5 * (by + ay)
            gradient[e, 1] = -0.5 * (bx + ax)
            twice += x * ay - ax * y
            x, y, bx, by = x + ax, y + ay, ax, ay
        value[r] = 0.5 * twice - rest[r]
        bend[r] = 0.5
