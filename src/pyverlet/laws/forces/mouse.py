"""Forces by the mouse: dragging one particle, or pushing some away."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.shown import Shown
from pyverlet.state.sorted_state import SortedState


class Grip(Shown):
    """The mouse: a spring that pulls one particle to a target, F = m (s w^2 (target - x) - 2 w v); critically damped for s = 1.

    Args:
        particle: the user's index of the particle.
        target: (x, y) in m; set it as the mouse moves.
        frequency: w / (2 pi) in Hz; higher pulls harder.
        strength: s, factor for a particle that moves others linked to it.
    """

    _shows = ("particle", "target", "frequency", "strength")

    velocity_dependent = True

    particle = Checked(checks.integer, least=0)
    target = Checked(checks.vector)
    frequency = Checked(checks.number, above=0.0)
    strength = Checked(checks.number, above=0.0)

    def __init__(self, particle: int, *, target: Sequence[float], frequency: float = 5.0, strength: float = 1.0) -> None:
        self.particle, self.target, self.frequency, self.strength = particle, target, frequency, strength

    def apply(self, state: SortedState, t: float) -> None:
        if self.particle < 0:
            return
        sorted_index = state.sorted_index(checks.integer("particle of a Grip", self.particle, least=0, most=len(state) - 1))
        mass = state.mass[sorted_index]
        if not np.isfinite(mass):
            return
        w = 2.0 * np.pi * self.frequency
        reach = state.periodic.nearest(np.asarray(self.target, state.dtype) - state.position[sorted_index])
        pull = reach * (self.strength * w**2) - 2.0 * w * state.velocity[sorted_index]
        state.force[sorted_index] += mass * pull

    def renumber(self, now: NDArray[Any]) -> None:
        """Keep the particle after others were removed, or none (`particle` is -1) if it was removed itself."""
        if self.particle >= 0:
            vars(self)["particle"] = int(now[self.particle])


class Push(Shown):
    """A push: everything closer than `radius` is accelerated away from `center`, most at the centre and not at all at the rim.

    Args:
        center: (x, y), m; set it as the mouse moves.
        radius: m.
        acceleration: m/s^2 at the centre.
    """

    _shows = ("center", "radius", "acceleration")

    velocity_dependent = False

    center = Checked(checks.vector)
    radius = Checked(checks.number, above=0.0)
    acceleration = Checked(checks.number)

    def __init__(self, *, center: Sequence[float], radius: float, acceleration: float) -> None:
        self.center, self.radius, self.acceleration = center, radius, acceleration

    def apply(self, state: SortedState, t: float) -> None:
        offset = state.periodic.nearest(state.position - np.asarray(self.center, state.dtype))
        distance = np.hypot(offset[:, 0], offset[:, 1])
        near = np.flatnonzero((distance < self.radius) & (distance > 0) & np.isfinite(state.mass))
        strength = self.acceleration * state.mass[near] * (1 / distance[near] - 1 / self.radius)
        state.force[near] += strength[:, None] * offset[near]
