"""The moves integrators are made of, on slots: each a call of a kernel in `kernels.motion`, on as many threads as pay off."""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from pyverlet._jit import Kernel
from pyverlet.constants import SERIAL_BELOW
from pyverlet.kernels import motion
from pyverlet.state import Slots

Array = NDArray[Any]


def advance(out: Array, base: Array, slope: Array, h: float) -> None:
    """out = base + h * slope on (n, 2) arrays; the move every integrator is made of. out may be base."""
    _light(motion.advance, out)(out, base, slope, out.dtype.type(h))


def newton(state: Slots, force: Array, gravity: tuple[float, float]) -> float:
    """acceleration = gravity + force / mass; force: (n, 2), or (0, 2) for none. Returns the largest of them, m/s^2."""
    where = state.acceleration, force, state.inverse_mass
    return float(_light(motion.newton, state.position)(*where, *state.reals(*gravity)))


def newton_kick_drift(state: Slots, force: Array, gravity: tuple[float, float], h: float, ahead: float) -> float:
    """Take back a kick of `ahead` seconds; `newton`; velocity += h * acceleration; position += h * velocity."""
    where = state.position, state.velocity, state.acceleration, force, state.inverse_mass
    return float(_light(motion.newton_kick_drift, state.position)(*where, *state.reals(*gravity, h, ahead)))


def strayed(state: Slots, reference: Array, distance: float) -> bool:
    """Whether any particle has moved by more than this, m, from its row of `reference`."""
    return bool(_light(motion.strayed, reference)(state.position, reference, state.real(distance * distance)))


def pick_falling(state: Slots, before: Array, lag: float, dt: float) -> None:
    """Circles that touch others but fall as if alone rest on nobody: `resting` is 0 for them.

    before: (n, 2) velocities dt seconds ago, m/s, in the user's order.
    """
    moving = state.velocity, state.acceleration, before, state.particle
    _light(motion.pick_falling, state.position)(state.resting, *moving, *state.reals(lag, dt))


def remember_rest(state: Slots, h: float) -> None:
    """Scale the accelerations of those that are held, so that h / 2 of it makes of what they carry weight with no velocity."""
    held = state.acceleration, state.velocity, state.resting
    _light(motion.remember_rest, state.position)(*held, *state.reals(state.lean, h))


def _light(kernel: Kernel, particles: Array) -> Kernel:
    """For loops so light that a meeting of the threads costs more in all but the largest worlds."""
    return kernel if len(particles) >= SERIAL_BELOW else kernel.alone
