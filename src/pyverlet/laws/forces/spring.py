"""A spring to a point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.shown import Shown
from pyverlet.state.group import Group, checked_group
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

    _shows = ("group", "center", "stiffness")

    velocity_dependent = False

    def __init__(self, group: Group | None = None, *, center: Sequence[float] = (0.0, 0.0), stiffness: float) -> None:
        self.group = checked_group(group)
        self.center = checks.vector("center", center)
        self.stiffness = checks.number("stiffness", stiffness, least=0.0)

    def apply(self, state: Slots, t: float) -> None:
        if self.group is None:
            state.motion.add_point_spring(state.force, state.position, *self.center, self.stiffness, *state.seam.period)
            return
        where = state.slots_of(self.group.index)
        state.force[where] -= self.stiffness * state.seam.nearest(state.position[where] - np.asarray(self.center, state.dtype))

    def potential(self, state: State) -> float:
        where = slice(None) if self.group is None else self.group.index
        free = np.isfinite(state.mass[where])
        offset = state.seam.nearest(state.position[where][free].astype(np.float64) - self.center)
        return float(0.5 * self.stiffness * np.sum(offset * offset))
