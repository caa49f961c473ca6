"""Newton's law of gravitation between particles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.ground import checks
from pyverlet.ground.checked import Checked
from pyverlet.ground.shown import Shown
from pyverlet.state.group import Group, checked_group, members
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

FEW = 256
"""Particles of which all pairs are summed in the time that nodes of the tree take."""


class Gravitation(Shown):
    """Particles that attract each other: F = strength m_i m_j d / (|d|^2 + softening^2)^(3/2) for every pair, and its potential.

    Pinned particles take no part. More than FEW particles are summed by a tree (Barnes and Hut 1986, with second moments), in a
    time that grows as n log n: a part of them whose size is below `theta` times its distance counts as a whole. With theta = 0.5
    accelerations in a cloud, in a lattice and on a ring are within 1 % of their root mean square. What the sum of all forces is
    then not 0 by is taken from each by its size, so that momentum is kept to rounding; all torques add up to less than 1e-4 of
    their sizes. The potential is that of the tree, within 1e-3, and costs as much as the forces. Fewer particles are summed by
    all pairs, in a time that grows as n^2, as all are for theta = 0 and with periodic boundaries.

    Args:
        group: the particles that attract each other; None is all.
        strength: G, N m^2/kg^2; negative repels.
        softening: distance within which the pull stops growing, m.
        theta: 0 to 1; errors grow with its third power.
    """

    _shows = ("group", "strength", "softening", "theta")

    velocity_dependent = False

    group = Checked(checked_group)
    strength = Checked(checks.number)
    softening = Checked(checks.number, least=0.0)
    theta = Checked(checks.fraction)

    def __init__(self, group: Group | None = None, *, strength: float, softening: float = 0.0, theta: float = 0.5) -> None:
        self.group = group
        self._last: tuple[NDArray[Any], ...] = ()
        self._pull: Any = None
        self._work: Any = None
        self.strength, self.softening, self.theta = strength, softening, theta

    def among(self, state: Slots) -> NDArray[Any]:
        """Slots of those whose forces on each other add up to nothing."""
        return np.asarray(state.slots_of(np.arange(len(state))[members(self.group)]))

    def _law(self, count: int, state: Slots | State) -> tuple[float, float, float]:
        return self.strength, self.softening, 0.0 if count <= FEW or state.seam else self.theta

    def apply(self, state: Slots, t: float) -> None:
        who = self.among(state)
        law = self._law(len(who), state)
        given = state.position, state.mass, who, np.array((*law, *state.seam))
        if not self._last or not all(map(np.array_equal, given, self._last)):  # a frame begins where the last one has ended
            if not (self._last and len(who) == len(self._last[2])):
                self._work = state.motion.tree_work(len(who), state.dtype)
            self._last, self._pull = tuple(map(np.copy, given)), np.zeros_like(state.force)
            state.motion.gravitate(self._pull, *given[:3], *law, state.seam, *state.thread_team, self._work, False)
        state.force += self._pull

    def potential(self, state: State) -> float:
        where = members(self.group)
        position, mass = state.position[where].astype(np.float64), state.mass[where].astype(np.float64)
        given = np.zeros_like(position), position, mass, np.arange(len(mass), dtype=np.int32)
        return float(unit("motion", np.float64).gravitate(*given, *self._law(len(mass), state), state.seam, 0, 1))

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_last": (), "_pull": None, "_work": None}
