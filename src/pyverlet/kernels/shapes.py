"""What links measure that are one equation each: a value C, 0 where the link is content, and its gradient by every particle.

A row concerns the particles of its entries, from `a` up to b; corner[e] is where the one of entry e is, and gradient[e] becomes
the gradient by it. Also said is how fast that turns when particles move, the size of the second derivatives. All float64. A new
kind of link is one more function of this form, and its number below.
"""

from __future__ import annotations

import math

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.kernels.seam import nearest

ANGLE, AREA = range(2)
"""Kinds of rows, as they are solved: who comes first holds best."""


@kernel
def _way(corner, i, j, period_x, period_y):
    """From i to j, m."""
    return nearest(corner[j, 0] - corner[i, 0], period_x), nearest(corner[j, 1] - corner[i, 1], period_y)


@kernel
def _angle(a, b, corner, period_x, period_y, rest, gradient):
    """C = angle from j -> i to j -> k, counter-clockwise, minus rest, in -pi to pi, rad."""
    i, j, k = a, a + 1, a + 2
    ax, ay = _way(corner, j, i, period_x, period_y)
    bx, by = _way(corner, j, k, period_x, period_y)
    turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by) - rest
    a2, b2 = max(ax * ax + ay * ay, 1e-300), max(bx * bx + by * by, 1e-300)
    gradient[i, 0], gradient[i, 1] = ay / a2, -ax / a2
    gradient[k, 0], gradient[k, 1] = -by / b2, bx / b2
    gradient[j, 0], gradient[j, 1] = -gradient[i, 0] - gradient[k, 0], -gradient[i, 1] - gradient[k, 1]
    return turn - 2.0 * math.pi * np.floor(turn / (2.0 * math.pi) + 0.5), 1.0 / min(a2, b2)


@kernel
def _area(a, b, corner, period_x, period_y, rest, gradient):
    """C = area of the ring, positive if it runs counter-clockwise, minus rest, m^2 (the shoelace formula)."""
    # From corner to corner, each the nearest image of the one before; seen from the first, for far away digits would cancel.
    twice = x = y = 0.0
    bx, by = _way(corner, b - 1, a, period_x, period_y)
    for e in range(a, b):
        ax, ay = _way(corner, e, e + 1 if e + 1 < b else a, period_x, period_y)
        gradient[e, 0], gradient[e, 1] = 0.5 * (by + ay), -0.5 * (bx + ax)
        twice += x * ay - ax * y
        x, y, bx, by = x + ax, y + ay, ax, ay
    return 0.5 * twice - rest, 0.5


@kernel
def measure(kind, a, b, corner, period_x, period_y, rest, gradient):
    """C of a row of this kind, in its unit, and how fast its gradient turns, that per m^2; writes its gradient."""
    if kind == ANGLE:
        return _angle(a, b, corner, period_x, period_y, rest, gradient)
    return _area(a, b, corner, period_x, period_y, rest, gradient)
