"""The solver's copy of the particles that have links: compact, in float64, made anew in every substep."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.kernels import links, motion
from pyverlet.state.state import Slots

Array = NDArray[Any]


class Work:
    """The linked particles.

    Args:
        particle: (m,) the user's indices, ascending.
        count: of all particles.

    Attributes:
        compact: (n,) where each of the user's particles is in here; only that of linked ones means anything.
        start, earlier: (m, 2) where each was at the start of this substep, and a substep before that, m.
        position, predicted: (m, 2) where the solver has it, and where the integrator had put it, m.
        weight: (m,) inverse mass, as the rows feel it, 1/kg.
        pull: (m, 2) acceleration by all links in this substep, m/s^2.
    """

    def __init__(self, particle: Array, count: int) -> None:
        self.particle = particle
        self.compact = np.zeros(count, np.int64)
        self.compact[particle] = np.arange(len(particle))
        self.start, self.earlier, self.position, self.predicted = np.zeros((4, len(particle), 2))
        self._where, self._velocity, self.pull = np.zeros((3, len(particle), 2))
        self.weight = np.zeros(len(particle))
        self._slot = np.zeros(len(particle), np.int64)
        self._order: Array | None = None

    def __len__(self) -> int:
        return len(self.particle)

    def slots(self, state: Slots) -> Array:
        """(m,) where the particles stand in the engine's order."""
        if self._order is not state.particle:  # every new order is a new array
            self._order = state.particle
            slot_of = np.empty(len(state.particle), np.int64)
            slot_of[state.particle] = np.arange(len(slot_of))
            self._slot = slot_of[self.particle]
        return self._slot

    def look(self, state: Slots, h: float) -> None:
        """Before the integrator: where they are, and where they were."""
        slot = self.slots(state)
        motion.take_rows(self.start, state.position, slot)
        motion.take_rows(self._velocity, state.velocity, slot)
        links.step_back(self.earlier, self.start, self._velocity, h)
        self.weight[:] = state.inverse_mass[slot]

    def take(self, state: Slots) -> None:
        """After the integrator and the contacts."""
        motion.take_rows(self.predicted, state.position, self.slots(state))
        self.position[:] = self.predicted

    def where(self, state: Slots) -> Array:
        """(m, 2) where they are now, m; good until asked again."""
        motion.take_rows(self._where, state.position, self.slots(state))
        return self._where

    def give(self, state: Slots, h: float) -> None:
        """Hand the result back."""
        links.hand_back(state.position, state.velocity, self.slots(state), self.position, self.predicted, 1 / h, self.pull)
