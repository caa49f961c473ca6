"""The same force at all times: a thrust, a charge in a uniform field."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.shown import Shown
from pyverlet.kernels.drive import UNIFORM
from pyverlet.laws.forces._base import Row
from pyverlet.state.group import Group
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
        self.group = group

    def apply(self, state: Slots, t: float) -> None:
        where = slice(None) if self.group is None else state.slots_of(self.group.index)
        state.force[where] += np.asarray(self.newtons, state.dtype)

    def compiled(self, state: Slots) -> Row | None:
        """What `kernels.drive` needs to know of it; None: it has to be asked."""
        return (UNIFORM, self.newtons, (0.0, 0.0)) if type(self) is ConstantForce and self.group is None else None

    def potential(self, state: State) -> float:
        where = slice(None) if self.group is None else self.group.index
        free = np.isfinite(state.mass[where])
        return -float(state.position[where][free].sum(axis=0, dtype=np.float64) @ self.newtons)
