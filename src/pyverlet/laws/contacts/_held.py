"""What kernels of the contact laws in Python hold of the slots: arrays as one struct, and counts for work that threads share."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.compile import jit
from pyverlet.compile.bundle import hold
from pyverlet.compile.rows import WIDTH
from pyverlet.compile.stealing import Claims
from pyverlet.kernels import frame, leaving, motion, tables
from pyverlet.laws.integrators import Integrator, PositionVerlet
from pyverlet.state.slots import Array, Slots

STAGES = frame.STAGES
use_threads = jit.use_threads


def circles(state: Slots) -> Any:
    """What walls and obstacles need of the particles: `kernels.tables.Circles`, of which that for contacts is empty."""
    if state._circles is None:
        state._circles = tuple(np.empty(shape, state.dtype) for shape in (0, (0, 2), (0, WIDTH))), None
    (none, rows, wide), held = state._circles
    arrays = (
        state.position, state.velocity, state.acceleration, state.inverse_mass, rows, rows, state.resting, state.spin, none,
        state.fed, wide, state.turn, state.lift, none, state.start, state.radius, state.restitution, state.friction, state.hits,
        state.spent, state.impacts, rows, none, none, none, none, rows,
    )  # fmt: skip
    state._circles = (none, rows, wide), (held := hold(tables.Circles, arrays, held))
    return held


def claims(state: Slots) -> Any:
    """For kernels whose threads claim what they do."""
    if state._claims is None:
        state._claims = Claims()
    return state._claims()


def strayed(state: Slots, reference: Array, distance: float) -> bool:
    """Whether any particle has moved by more than this, m, from its row of `reference`."""
    return bool(motion.strayed(state.position, reference, state.real(distance * distance)))


def first_leap(
    state: Slots, gravity: tuple[float, float], h: float, reference: Array, distance: Any, origin: Array, moved: Array
) -> bool:
    """Under gravity alone velocity += h * acceleration, position += h * velocity, moved = position - origin.

    distance: the square of that in `strayed`, in the dtype of the state. Returns whether anyone has then strayed.
    """
    where = state.position, state.velocity, state.acceleration, state.inverse_mass
    return bool(motion.first_leap(*where, *state.reals(*gravity, h), reference, distance, origin, moved, claims(state)))


def pick_falling(state: Slots, before: Array, lag: float, dt: float) -> None:
    """Circles that touch others but fall as if alone rest on nobody: `resting` is 0 for them.

    before: (n, 2) velocities dt seconds ago, m/s, in the user's order.
    """
    moving = state.velocity, state.acceleration, before, state.particle
    leaving.pick_falling(state.resting, *moving, *state.reals(lag, dt))


def leave(state: Slots, h: float) -> None:
    """Make of what circles carry weight with no velocity; of others' velocity, half a substep old, that of now.

    Scales the accelerations of those that are held, so that h / 2 of it does that, and kicks all by it.
    """
    held = state.acceleration, state.velocity, state.resting, state.along
    leaving.leave(*held, *state.reals(state.lean, h, 0.5 * h))
    if len(state.along):
        state.along = state.along[:0].copy()  # of use no more, and as large as a column


def end(integrator: Integrator, state: Slots, h: float) -> None:
    """`Integrator.end`, but for circles at rest, which carry weight with the velocity that integrators of Stormer's kind keep."""
    if type(integrator).end is PositionVerlet.end:
        leave(state, h)
    else:
        integrator.end(state, h)
