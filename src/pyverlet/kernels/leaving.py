"""How circles that something holds leave a frame: who rests on others, and what remains of their accelerations and velocities.

Of those that a smooth wall holds what is along it remains.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import copy_row
from pyverlet.ground.constants import STANDS_OUT
from pyverlet.kernels.meetings import ROUND
from pyverlet.kernels.motion import BLOCK, IN_PILE, ON_WALL, add_scaled

_ONE = np.uint64(1)


@kernel
def _slides(resting, own, mu):
    """Whether a wall of friction mu holds this circle, alone, and does not rub it."""
    return resting == ON_WALL and (mu if own < 0.0 else mu * own) == 0.0


@kernel
def anybody_slides(resting, friction, mu):
    """Whether there is such a circle."""
    alone = resting.dtype.type(0)
    for k in range(resting.shape[0]):
        alone |= resting.dtype.type(resting[k] == ON_WALL)
    if alone == 0:  # in a heap, mostly
        return False
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


@kernel
def _pick_falling(resting, velocity, acceleration, before, particle, lag, dt):
    v, a, then, half = velocity.reshape(-1), acceleration.reshape(-1), before.reshape(-1), dt / (dt + dt)
    for m in range(resting.shape[0]):
        k, i = np.uint64(2 * m), np.uint64(2 * np.int64(particle[np.uint64(m)]))
        ax, ay = a[k], a[k + _ONE]
        gained = (v[k] + lag * ax - then[i]) * ax + (v[k + _ONE] + lag * ay - then[i + _ONE]) * ay
        held = resting[np.uint64(m)]
        falls = (held == IN_PILE) & (gained > half * dt * (ax * ax + ay * ay))
        resting[np.uint64(m)] = np.uint8(0) if falls else held


@parallel_kernel
def pick_falling(resting, velocity, acceleration, before, particle, lag, dt):
    """Circles that touch others but fall as if alone rest on nobody: those whose velocity has followed half of a or more.

    before: (n, 2) velocities dt seconds ago, by `particle`. lag: s, how far behind `velocity` is.
    """
    for block in prange((resting.shape[0] + BLOCK - 1) // BLOCK):
        a, b = block * BLOCK, min((block + 1) * BLOCK, resting.shape[0])
        _pick_falling(resting[a:b], velocity[a:b], acceleration[a:b], before, particle[a:b], lag, dt)


@kernel
def _remember_rest(acceleration, velocity, resting, lean, h):
    a, v = acceleration.reshape(-1), velocity.reshape(-1)
    zero, one = h - h, h / h
    for k in range(resting.shape[0]):
        i = np.uint64(2 * k)
        j, held = i + _ONE, resting[np.uint64(k)]
        # All is computed, whoever it is for: so it is done for eight at a time.
        ax, ay = a[i], a[j]
        along, square = -(v[i] * ax + v[j] * ay), h * (ax * ax + ay * ay)
        partly = along / square
        partly = partly if partly > zero else zero
        partly = partly if partly < lean else lean
        partly = partly if square > zero else zero
        part = partly if held == ON_WALL | IN_PILE else lean
        part = zero if held == ON_WALL else part
        part = part * (one + one) if held != 0 else one
        a[i], a[j] = part * ax, part * ay


@parallel_kernel
def leave(acceleration, velocity, resting, left, lean, h, half):
    """Scale the accelerations of those that are held, so that h / 2 of it makes of what they carry weight with no velocity.
    Then v += half a.

    Nothing for who rests on a wall alone: it has none. Among others that is lean |a| h against a; at a wall what there is of it.
    left: (n, 2) acceleration that obstacles leave to those they hold, m/s^2, or (0, 2): that is no weight, and remains.
    """
    for block in prange((resting.shape[0] + BLOCK - 1) // BLOCK):
        first, stop = block * BLOCK, min((block + 1) * BLOCK, resting.shape[0])
        _remember_rest(acceleration[first:stop], velocity[first:stop], resting[first:stop], lean, h)
        for i in range(first, min(stop, left.shape[0])):
            if resting[i] == ON_WALL:
                copy_row(acceleration, i, left, i)
        add_scaled(velocity[first:stop], acceleration[first:stop], half)
