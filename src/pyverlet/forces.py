"""Forces besides gravity: objects with `apply(state, t)`, which add newtons to `state.force`.

`state` is the engine's working copy (`pyverlet.state.Slots`): arrays in the engine's order, `state.particle` naming the user's
index in each slot. A force that looks at the velocity says so by `velocity_dependent = True`, so that integrators
keep their order. A conservative force adds `potential(state)` in joules, and the world's energy includes it. The work of any
other is on the world's ledger, under `forces` or the name in the force's `account`.

To add one: a class with `apply`, and a test against its closed form.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from pyverlet import checks
from pyverlet.kernels import motion
from pyverlet.state import Slots, State


@runtime_checkable
class Force(Protocol):
    """Anything with this method is a force. One without `velocity_dependent` is taken to look at the velocity."""

    def apply(self, state: Slots, t: float) -> None:
        """Add this force to `state.force` (n, 2), in N, at time t in s."""


@runtime_checkable
class Conservative(Protocol):
    """A force with a potential."""

    def potential(self, state: State | Slots) -> float:
        """Potential energy of all particles, J."""


class Drag:
    """Resistance of the medium: F = -(linear + quadratic |v|) v.

    Args:
        linear: N s/m (Stokes).
        quadratic: N s^2/m^2 (Newton).
    """

    velocity_dependent = True
    account = "drag"

    def __init__(self, *, linear: float = 0.0, quadratic: float = 0.0) -> None:
        self.linear = checks.number("linear", linear, least=0.0)
        self.quadratic = checks.number("quadratic", quadratic, least=0.0)

    def apply(self, state: Slots, t: float) -> None:
        if self.linear:
            state.force -= self.linear * state.velocity
        if self.quadratic:
            speed = np.hypot(state.velocity[:, 0], state.velocity[:, 1])[:, None]
            state.force -= self.quadratic * speed * state.velocity


class PointSpring:
    """A spring of zero length from every particle to one point.

    F = -stiffness (x - center), with the potential stiffness |x - center|^2 / 2.

    Args:
        center: (x, y), m.
        stiffness: N/m.
    """

    velocity_dependent = False

    def __init__(self, *, center: Sequence[float] = (0.0, 0.0), stiffness: float) -> None:
        self.center = checks.vector("center", center)
        self.stiffness = checks.number("stiffness", stiffness, least=0.0)

    def apply(self, state: Slots, t: float) -> None:
        state.force -= self.stiffness * (state.position - np.asarray(self.center, state.dtype))

    def potential(self, state: State | Slots) -> float:
        offset = state.position.astype(np.float64) - self.center
        return float(0.5 * self.stiffness * np.sum(offset * offset))


class Grip:
    """The mouse: a critically damped spring that pulls one particle to a target, F = m w^2 (target - x) - 2 m w v.

    Args:
        particle: the user's index of the particle.
        target: (x, y) in m; set it anew as the mouse moves.
        frequency: w / (2 pi) in Hz; higher pulls harder.
    """

    velocity_dependent = True

    def __init__(self, particle: int, *, target: Sequence[float], frequency: float = 5.0) -> None:
        self.particle = checks.whole("particle", particle, least=0)
        self.target = checks.vector("target", target)
        self.frequency = checks.number("frequency", frequency, above=0.0)

    def apply(self, state: Slots, t: float) -> None:
        slot = state.slot_of(self.particle)
        mass = state.mass[slot]
        if not np.isfinite(mass):
            return
        w = 2.0 * np.pi * self.frequency
        pull = (np.asarray(self.target, state.dtype) - state.position[slot]) * w**2 - 2.0 * w * state.velocity[slot]
        state.force[slot] += mass * pull


class Push:
    """A poke: everything nearer than `radius` is accelerated away from `center`, most at the centre and not at all at the rim.

    Args:
        center: (x, y), m; set it anew as the mouse moves.
        radius: m.
        acceleration: m/s^2 at the centre.
    """

    velocity_dependent = False

    def __init__(self, *, center: Sequence[float], radius: float, acceleration: float) -> None:
        self.center = checks.vector("center", center)
        self.radius = checks.number("radius", radius, above=0.0)
        self.acceleration = checks.number("acceleration", acceleration)

    def apply(self, state: Slots, t: float) -> None:
        offset = state.position - np.asarray(self.center, state.dtype)
        distance = np.hypot(offset[:, 0], offset[:, 1])
        near = np.flatnonzero((distance < self.radius) & (distance > 0) & np.isfinite(state.mass))
        strength = self.acceleration * state.mass[near] * (1 / distance[near] - 1 / self.radius)
        state.force[near] += strength[:, None] * offset[near]


class ForceSum:
    """Gravity and the world's forces together: what integrators call. Forces are summed, then a = F / m.

    Args:
        gravity: (x, y), m/s^2.
        forces: the world's list, read anew at each evaluation.
    """

    def __init__(self, gravity: tuple[float, float], forces: list[Any]) -> None:
        self.gravity = gravity
        self.forces = forces

    @property
    def velocity_dependent(self) -> bool:
        """Whether any of the forces may look at the velocity."""
        return any(getattr(force, "velocity_dependent", True) for force in self.forces)

    def __call__(self, state: Slots, t: float) -> None:
        gx, gy = map(state.real, self.gravity)
        if not self.forces:
            motion.uniform_acceleration(state.acceleration, state.inverse_mass, gx, gy)
            return
        state.force[:] = 0
        for force in self.forces:
            force.apply(state, t)
        motion.newton(state.acceleration, state.force, state.inverse_mass, gx, gy)
