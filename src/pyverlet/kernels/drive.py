"""The integration of a substep under forces that are known by a few numbers each: none of them is asked, block by block.

Integrators of Stormer's kind keep a velocity half a substep old: it is kicked for the forces to see, and that is taken back.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.compile.bundle import bundle
from pyverlet.compile.jit import kernel, parallel_kernel, prange, variant
from pyverlet.kernels.forces import attract, drag, soften
from pyverlet.kernels.motion import BLOCK, add_scaled, any_strayed, kick_drift, newton_block, set_out

DRAG, UNIFORM, SPRING, ATTRACTION = range(4)
"""Kinds of forces. Vector and numbers of each: velocity of the medium, (linear, quadratic); newtons; centre, (stiffness,);
centre, (strength, softening)."""

NUMBERS = 2
"""Each has, of which some need fewer."""


@bundle
class Forces:
    """kind: (k,) of the constants above; vector: (k, 2), number: (k, NUMBERS), in the dtype of the world. total: (n, 2) N,
    becomes their sum. mass: (n,) kg. resistance: (n,) of `drag`, 0 in between.
    """

    kind: Any
    vector: Any
    number: Any
    total: Any
    mass: Any
    resistance: Any


PASSES = 4
"""Evaluations of functions that look at the velocity: each brings the one that they see nearer to that of the middle of the kick,
(before + after) / 2, by h / 2 times what they change by with it. With that a force across the velocity does no work (Boris)."""

CALLS = False
"""Whether there are functions of the user's own."""


@kernel
def _push(force, x, y):
    for i in range(force.shape[0]):
        force[i, 0] += x
        force[i, 1] += y


@kernel
def _pull(force, position, x, y, stiffness):
    for i in range(force.shape[0]):
        force[i, 0] -= stiffness * (position[i, 0] - x)
        force[i, 1] -= stiffness * (position[i, 1] - y)


@kernel
def _add_up(force, position, velocity, inverse_mass, resistance, kind, vector, number, period_x, period_y):
    """force = the sum of all, in their order; whether any is drag."""
    f, zero = force.reshape(-1), force.dtype.type(0.0)
    for k in range(f.shape[0]):
        f[k] = zero
    slowed = False
    for row in range(kind.shape[0]):
        x, y, first, second = vector[row, 0], vector[row, 1], number[row, 0], number[row, 1]
        if kind[row] == DRAG:
            drag(force, velocity, vector[row : row + 1], resistance, first, second)
            slowed = True
        elif kind[row] == UNIFORM:
            _push(force, x, y)
        elif kind[row] == SPRING:
            _pull(force, position, x, y, first)
        else:
            attract(force, position, inverse_mass, x, y, first, second, period_x, period_y)
    return slowed


def _some(circles, forces, period_x, period_y, gx, gy, h, ahead, function, t, a, b):
    """Of the particles from a up to b; the square of the largest acceleration.

    Where the user's function fails the first of them is nowhere: the frame is then gone through again by who can say why.
    """
    x, v, felt, light = circles.position[a:b], circles.velocity[a:b], circles.acceleration[a:b], circles.inverse_mass[a:b]
    pushed, resistance, wrong, largest = forces.total[a:b], forces.resistance[a:b], 0, gx - gx
    if forces.kind.shape[0] == 0 and not CALLS:  # gravity alone: links have pulled, and that is not felt again
        pushed = pushed[:0]
    for _ in range(PASSES if CALLS and ahead != 0 else 1):
        if pushed.shape[0]:
            if ahead != 0:
                add_scaled(v, felt, ahead)
            slowed = _add_up(pushed, x, v, light, resistance, forces.kind, forces.vector, forces.number, period_x, period_y)
            if CALLS:
                wrong = function(pushed, x, v, forces.mass[a:b], t)
            if slowed:
                soften(pushed, resistance, light, gx, gy, h)
            if ahead != 0:
                add_scaled(v, felt, -ahead)
        largest = newton_block(felt, pushed, light, gx, gy)
    kick_drift(x, v, felt, h)
    if wrong > 0:
        x[0, 0] = np.nan
    return largest


def _drive(circles, forces, period_x, period_y, gx, gy, h, ahead, reference, square, function, t):
    """What `motion.leap` does after all forces have been asked: v += h a, x += h v, moved = x - origin.

    ahead: s, by which velocities are kicked for forces to see. reference, square: as for `motion.leap`.
    function: what `laws.forces._native` makes of the user's functions, for the time t, s; nothing if there are none.

    Returns the largest acceleration, m/s^2, and whether anyone has strayed.
    """
    position, origin, moved = circles.position, circles.origin, circles.moved
    where, start = position.reshape(-1), reference.reshape(-1)
    largest, found = gx - gx, 0
    for block in prange((position.shape[0] + BLOCK - 1) // BLOCK):
        a, b = block * BLOCK, min((block + 1) * BLOCK, position.shape[0])
        largest = max(largest, some(circles, forces, period_x, period_y, gx, gy, h, ahead, function, t, a, b))
        found += int(any_strayed(where, start, a, b, square))
        set_out(position[a:b], origin[a:b], moved[a:b])
    return np.sqrt(largest), found > 0


some = kernel(variant(_some, "some"))
drive = parallel_kernel(variant(_drive, "drive", some=some))
some_called = kernel(variant(_some, "some_called", CALLS=True))
drive_called = parallel_kernel(variant(_drive, "drive_called", some=some_called))
