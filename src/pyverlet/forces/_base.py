"""What a force is, and the sum of all of them."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from pyverlet.kernels import motion
from pyverlet.state import Slots, State, fall, kick_drift


@runtime_checkable
class Force(Protocol):
    """Anything with this method is a force. One without `velocity_dependent` is taken to look at the velocity."""

    def apply(self, state: Slots, t: float) -> None:
        """Add this force to `state.force` (n, 2), in N, at time t in s."""


@runtime_checkable
class Conservative(Protocol):
    """A force with a potential."""

    def potential(self, state: State) -> float:
        """Potential energy of all particles, J."""


@runtime_checkable
class Numbered(Protocol):
    """Something that holds particles by their index."""

    def renumber(self, now: NDArray[Any]) -> None:
        """Particles were removed: the one that was at k is at now[k], or is no more if that is -1."""


class ForceSum:
    """Gravity and the world's forces together: what integrators call. Forces are summed, then a = F / m.

    Args:
        gravity: (x, y), m/s^2.
        forces: the world's list, read anew at each evaluation.
    """

    def __init__(self, gravity: tuple[float, float], forces: list[Any]) -> None:
        self.gravity = gravity
        self.forces = forces
        self._strength = gravity, float(np.hypot(*gravity))

    @property
    def velocity_dependent(self) -> bool:
        """Whether any of the forces may look at the velocity."""
        return bool(self.forces) and any(getattr(force, "velocity_dependent", True) for force in self.forces)

    def strongest(self, state: Slots) -> float:
        """The largest acceleration that anyone has felt in the last evaluation, m/s^2."""
        if self.forces:
            return float(motion.largest_norm(state.acceleration))
        if self._strength[0] != self.gravity:
            self._strength = self.gravity, float(np.hypot(*self.gravity))
        return self._strength[1]

    def __call__(self, state: Slots, t: float) -> None:
        gx, gy = state.real(self.gravity[0]), state.real(self.gravity[1])
        if not self.forces:
            motion.uniform_acceleration(state.acceleration, state.inverse_mass, gx, gy)
            return
        state.force[:] = 0
        for force in self.forces:
            force.apply(state, t)
        motion.newton(state.acceleration, state.force, state.inverse_mass, gx, gy)

    def kick_drift(self, state: Slots, t: float, h: float) -> None:
        """Evaluate, then velocity += h * acceleration, then position += h * velocity."""
        if not self.forces:
            fall(state, self.gravity, h)
            return
        self(state, t)
        kick_drift(state, h)
