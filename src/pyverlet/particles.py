"""The arrays of a world's particles, in the order they were added."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet import checks
from pyverlet.collisions import ContactSolver
from pyverlet.forces import Force, Numbered
from pyverlet.state import Group, Slots, State

Array = NDArray[Any]


class Particles:
    """What a world shows of its particles: views, so that reading copies nothing and writing changes the world."""

    _state: State
    _slots: Slots
    _contacts: ContactSolver | None
    forces: list[Force]

    def remove(self, which: Group | ArrayLike) -> None:
        """Remove particles. Groups keep the others, whose indices close ranks.

        Args:
            which: a group, an index, several, or (n,) bool. Many at once cost as much as one.

        Raises:
            InputError: there is no such particle; nothing is removed.
        """
        if isinstance(which, Group):
            which = which.index
        gone = checks.indices("which", which, len(self))
        if not len(gone):
            return
        kept = np.ones(len(self), bool)
        kept[gone] = False
        now = self._state.remove(kept)
        self._slots.forget(now)
        if self._contacts:
            self._contacts.broad_phase.forget()
        self._renumber(now)

    def _renumber(self, now: Array) -> None:
        """Tell those who hold a particle by its index where it is now, or that it is no more (-1)."""
        for force in self.forces:
            if isinstance(force, Numbered):
                force.renumber(now)

    def __len__(self) -> int:
        return len(self._state)

    @property
    def position(self) -> Array:
        """(n, 2) centres of all particles in the order they were added, m; a view."""
        return self._state.position

    @property
    def velocity(self) -> Array:
        """(n, 2) m/s; a view."""
        return self._state.velocity

    @property
    def spin(self) -> Array:
        """(n,) angular velocity, rad/s, counter-clockwise; a view."""
        return self._state.spin

    @property
    def radius(self) -> Array:
        """(n,) m; a view."""
        return self._state.radius

    @property
    def mass(self) -> Array:
        """(n,) kg, infinite where pinned; a view."""
        return self._state.mass
