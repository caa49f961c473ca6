"""Newton's law of gravitation, to a point and between particles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.ground import checks
from pyverlet.ground.shown import Shown
from pyverlet.state.group import Group
from pyverlet.state.slots import Slots
from pyverlet.state.state import State


class Attractor(Shown):
    """A fixed mass that attracts every particle: F = m strength d / (|d|^2 + softening^2)^(3/2), d from particle to centre.

    Its potential is -m strength / sqrt(|d|^2 + softening^2). Without softening a particle at the very centre feels nothing.

    Args:
        center: (x, y), m.
        strength: G M, m^3/s^2; negative repels.
        softening: distance within which the pull stops growing, m.
    """

    _shows = ("center", "strength", "softening")

    velocity_dependent = False

    def __init__(self, *, center: Sequence[float] = (0.0, 0.0), strength: float, softening: float = 0.0) -> None:
        self.center = checks.vector("center", center)
        self.strength = checks.number("strength", strength)
        self.softening = checks.number("softening", softening, least=0.0)

    def apply(self, state: Slots, t: float) -> None:
        law = *self.center, self.strength, self.softening, *state.seam.period
        state.motion.attract(state.force, state.position, state.inverse_mass, *law)

    def potential(self, state: State) -> float:
        distance = np.hypot(*state.seam.nearest(state.position.astype(np.float64) - self.center).T)
        apart = np.hypot(distance, self.softening)
        felt = (apart > 0) & np.isfinite(state.mass)
        return -self.strength * float(np.sum(state.mass[felt] / apart[felt]))


class Gravitation(Shown):
    """Particles that attract each other: F = strength m_i m_j d / (|d|^2 + softening^2)^(3/2) for every pair, and its potential.

    All pairs are summed, so that the cost grows with the square of their number. Pinned particles take no part.

    Args:
        group: the particles that attract each other; None is all.
        strength: G, N m^2/kg^2; negative repels.
        softening: distance within which the pull stops growing, m.
    """

    _shows = ("group", "strength", "softening")

    velocity_dependent = False

    def __init__(self, group: Group | None = None, *, strength: float, softening: float = 0.0) -> None:
        self.group = group
        self.strength = checks.number("strength", strength)
        self.softening = checks.number("softening", softening, least=0.0)

    def among(self, state: Slots) -> NDArray[Any]:
        """Slots of those whose forces on each other add up to nothing."""
        return np.asarray(state.slots_of(np.arange(len(state)) if self.group is None else self.group.index))

    def apply(self, state: Slots, t: float) -> None:
        state.motion.gravitate(
            state.force, state.position, state.mass, self.among(state), self.strength, state.real(self.softening),
            *state.seam.period,
        )  # fmt: skip

    def potential(self, state: State) -> float:
        where = slice(None) if self.group is None else self.group.index
        position, mass = state.position[where].astype(np.float64), state.mass[where].astype(np.float64)
        energy = unit("motion", np.float64).gravitational_potential(position, mass, self.softening, *state.seam.period)
        return self.strength * float(energy)
