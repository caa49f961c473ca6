"""The same force at all times: a thrust, a charge in a uniform field."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.shown import Shown
from pyverlet.state.group import Group, checked_group
from pyverlet.state.slots import Slots
from pyverlet.state.state import State


class ConstantForce(Shown):
    """The same force on every particle, or on each of a group; its potential is -F x, 0 at the origin.

    Args:
        newtons: (x, y), N.
        group: whom it acts on; None is all.
    """

    _shows = ("newtons", "group")

    velocity_dependent = False

    def __init__(self, newtons: Sequence[float], *, group: Group | None = None) -> None:
        self.newtons = checks.vector("newtons", newtons)
        self.group = checked_group(group)

    def apply(self, state: Slots, t: float) -> None:
        if self.group is None:
            state.motion.add_constant(state.force, *self.newtons)
        else:
            state.force[state.slots_of(self.group.index)] += np.asarray(self.newtons, state.dtype)

    def potential(self, state: State) -> float:
        where = slice(None) if self.group is None else self.group.index
        free = np.isfinite(state.mass[where])
        return -float(state.position[where][free].sum(axis=0, dtype=np.float64) @ self.newtons)
