"""Forces that depend only on a particle's position: a constant force, a spring to a point, a mass at a point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.shown import Shown
from pyverlet.laws.forces._base import swing_time
from pyverlet.state.group import Group, checked_group, members
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State


def _sorted_rows(state: SortedState, group: Group | None) -> Any:
    """Rows of a group's particles, or of all."""
    return slice(None) if group is None else state.sorted_index(members(group))


class ConstantForce(Shown):
    """A constant force on every particle, or on each of a group; its potential is -F x, 0 at the origin.

    Args:
        newtons: (x, y), N.
        group: the particles it acts on; None for all.
    """

    _shows = ("newtons", "group")

    velocity_dependent = False

    newtons = Checked(checks.vector)
    group = Checked(checked_group)

    def __init__(self, newtons: Sequence[float], *, group: Group | None = None) -> None:
        self.newtons, self.group = newtons, group

    def apply(self, state: SortedState, t: float) -> None:
        state.force[_sorted_rows(state, self.group)] += np.asarray(self.newtons, state.dtype)

    def potential(self, state: State) -> float:
        where = members(self.group)
        free = np.isfinite(state.mass[where])
        return -float(state.position[where][free].sum(axis=0, dtype=np.float64) @ self.newtons)


TURN = 1.0
"""rad, most of an oscillation per substep. Verlet's method is stable up to 2, but not with varying steps."""


class PointSpring(Shown):
    """A spring of zero length from every particle, or each of a group, to one point.

    F = -stiffness (x - center), with the potential stiffness |x - center|^2 / 2. Pinned particles are ignored. Frames whose
    substeps h are longer than TURN / omega, with omega^2 = stiffness / m, are divided.

    Args:
        group: the particles it acts on; None for all.
        center: (x, y), m.
        stiffness: N/m.
    """

    _shows = ("group", "center", "stiffness")

    velocity_dependent = False

    group = Checked(checked_group)
    center = Checked(checks.vector)
    stiffness = Checked(checks.number, least=0.0)

    def __init__(self, group: Group | None = None, *, center: Sequence[float] = (0.0, 0.0), stiffness: float) -> None:
        self.group, self.center, self.stiffness = group, center, stiffness

    def apply(self, state: SortedState, t: float) -> None:
        where = _sorted_rows(state, self.group)
        state.force[where] -= self.stiffness * state.periodic.nearest(
            state.position[where] - np.asarray(self.center, state.dtype)
        )

    def longest_substep(self, state: SortedState) -> float:
        """The longest allowed substep, s; longer frames are divided."""
        return TURN * swing_time(self.stiffness * float(state.inverse_mass[_sorted_rows(state, self.group)].max(initial=0.0)))

    def potential(self, state: State) -> float:
        where = members(self.group)
        free = np.isfinite(state.mass[where])
        offset = state.periodic.nearest(state.position[where][free].astype(np.float64) - self.center)
        return float(0.5 * self.stiffness * np.sum(offset * offset))


class Attractor(Shown):
    """A fixed mass that attracts every particle: F = m strength d / (|d|^2 + softening^2)^(3/2), d from particle to centre.

    The potential is -m strength / sqrt(|d|^2 + softening^2). Without softening the force at the very centre is 0.

    Args:
        center: (x, y), m.
        strength: G M, m^3/s^2; negative repels.
        softening: distance within which the pull stops growing, m.
    """

    _shows = ("center", "strength", "softening")

    velocity_dependent = False

    center = Checked(checks.vector)
    strength = Checked(checks.number)
    softening = Checked(checks.number, least=0.0)

    def __init__(self, *, center: Sequence[float] = (0.0, 0.0), strength: float, softening: float = 0.0) -> None:
        self.center, self.strength, self.softening = center, strength, softening

    def apply(self, state: SortedState, t: float) -> None:
        law = *self.center, self.strength, self.softening, *state.periodic.period
        state.motion.attract(state.force, state.position, state.inverse_mass, *law)

    def potential(self, state: State) -> float:
        distance = np.hypot(*state.periodic.nearest(state.position.astype(np.float64) - self.center).T)
        apart = np.hypot(distance, self.softening)
        felt = (apart > 0) & np.isfinite(state.mass)
        return -self.strength * float(np.sum(state.mass[felt] / apart[felt]))
