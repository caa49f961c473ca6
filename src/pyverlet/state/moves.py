"""The moves integrators are made of, on slots: each a call of a kernel in `kernels.motion`."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from pyverlet.kernels import leaving, motion
from pyverlet.state.slots import Slots

Array = NDArray[Any]


def advance(out: Array, base: Array, slope: Array, h: float) -> None:
    """out = base + h * slope on (n, 2) arrays; the move every integrator is made of. out may be base."""
    if out is base:
        motion.add_scaled(out, slope, out.dtype.type(h))
    else:
        motion.advance(out, base, slope, out.dtype.type(h))


def newton(state: Slots, force: Array, gravity: tuple[float, float]) -> float:
    """acceleration = gravity + force / mass; force: (n, 2), or (0, 2) for none. Returns the largest of them, m/s^2."""
    where = state.acceleration, force, state.inverse_mass
    return float(motion.newton(*where, *state.reals(*gravity)))


def newton_kick_drift(state: Slots, force: Array, gravity: tuple[float, float], h: float, ahead: float) -> float:
    """Take back a kick of `ahead` seconds; `newton`; velocity += h * acceleration; position += h * velocity."""
    where = state.position, state.velocity, state.acceleration, force, state.inverse_mass
    return float(motion.newton_kick_drift(*where, *state.reals(*gravity, h, ahead)))


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
    return bool(motion.first_leap(*where, *state.reals(*gravity, h), reference, distance, origin, moved, state.claims()))


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


def first_non_finite(state: Slots) -> int:
    """The user's index of a particle whose position or velocity is NaN or infinite; -1 if all are finite."""
    if motion.all_finite(state.position, state.velocity):
        return -1
    for array in (state.position, state.velocity):
        slot = int(motion.first_non_finite(array))
        if slot >= 0:
            return int(state.particle[slot])
    return -1
