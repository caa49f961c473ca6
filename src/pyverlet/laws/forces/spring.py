"""A spring to a point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.shown import Shown
from pyverlet.kernels.drive import SPRING
from pyverlet.laws.forces._base import Row
from pyverlet.state.group import Group
from pyverlet.state.slots import Slots
from pyverlet.state.state import State


class PointSpring(Shown):
    """A spring of zero length from every particle, or each of a group, to one point.

    F = -stiffness (x - center), with the potential stiffness |x - center|^2 / 2. Pinned particles take no part.

    Args:
        group: whom it acts on; None is all.
        center: (x, y), m.
        stiffness: N/m.
    """

    _shows = ("center", "stiffness")

    velocity_dependent = False

    def __init__(self, group: Group | None = None, *, center: Sequence[float] = (0.0, 0.0), stiffness: float) -> None:
        self.group = group
        self.center = checks.vector("center", center)
        self.stiffness = checks.number("stiffness", stiffness, least=0.0)

    def apply(self, state: Slots, t: float) -> None:
        where = slice(None) if self.group is None else state.slots_of(self.group.index)
        state.force[where] -= self.stiffness * state.seam.nearest(state.position[where] - np.asarray(self.center, state.dtype))

    def compiled(self, state: Slots) -> Row | None:
        """What `kernels.drive` needs to know of it; None: it has to be asked."""
        plain = type(self) is PointSpring and self.group is None and not state.seam
        return (SPRING, self.center, (self.stiffness, 0.0)) if plain else None

    def potential(self, state: State) -> float:
        where = slice(None) if self.group is None else self.group.index
        free = np.isfinite(state.mass[where])
        offset = state.seam.nearest(state.position[where][free].astype(np.float64) - self.center)
        return float(0.5 * self.stiffness * np.sum(offset * offset))
