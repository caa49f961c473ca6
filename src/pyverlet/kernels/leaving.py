"""What is left of the accelerations of circles that a smooth wall holds: what is along it."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.ground.constants import STANDS_OUT
from pyverlet.kernels.meetings import ROUND
from pyverlet.kernels.motion import ON_WALL


@kernel
def _slides(resting, own, mu):
    """Whether a wall of friction mu holds this circle, alone, and does not rub it."""
    return resting == ON_WALL and (mu if own < 0.0 else mu * own) == 0.0


@kernel
def anybody_slides(resting, friction, mu):
    """Whether there is such a circle."""
    for i in range(resting.shape[0]):  # noqa: SIM110  (Numba has no `any` of a generator)
        if resting[i] == ON_WALL and _slides(resting[i], friction[i], mu):
            return True
    return False


@kernel
def _without(ax, ay, nx, ny):
    """An acceleration without what of it leads against the normal of a wall."""
    into = min(ax * nx + ay * ny, 0.0)
    return ax - into * nx, ay - into * ny


@kernel
def note_along(what, x0, y0, x1, y1, mu, position, radius, friction, resting, acceleration, along):
    """`along` (n, 2) m/s^2 becomes what is left to those who slide on walls, and 0 for others.

    what, x0, y0, x1, y1: the room, as in `kernels.meetings`; of a round one x1 is the radius.
    """
    for i in range(resting.shape[0]):
        along[i, 0] = along[i, 1] = 0.0
        if not _slides(resting[i], friction[i], mu):
            continue
        x, y, reach = np.float64(position[i, 0]), np.float64(position[i, 1]), (1.0 + STANDS_OUT) * radius[i]
        ax, ay = np.float64(acceleration[i, 0]), np.float64(acceleration[i, 1])
        if what == ROUND:
            dx, dy = x0 - x, y0 - y
            far = np.sqrt(dx * dx + dy * dy)
            if x1 - far < reach and far > 0.0:
                ax, ay = _without(ax, ay, dx / far, dy / far)
        else:
            if x - x0 < reach:
                ax, ay = _without(ax, ay, 1.0, 0.0)
            if x1 - x < reach:
                ax, ay = _without(ax, ay, -1.0, 0.0)
            if y - y0 < reach:
                ax, ay = _without(ax, ay, 0.0, 1.0)
            if y1 - y < reach:
                ax, ay = _without(ax, ay, 0.0, -1.0)
        along[i, 0], along[i, 1] = ax, ay
