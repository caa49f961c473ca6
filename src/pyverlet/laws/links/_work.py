"""The solver's copy of the particles that have links: compact, in the dtype of the world, made anew in every substep."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile.lanes import LANES
from pyverlet.ground import memory
from pyverlet.kernels import clusters, links, motion
from pyverlet.state.seam import NONE
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

Array = NDArray[Any]


class Past(NamedTuple):
    """What is remembered of linked particles from frame to frame; it counts for who has not been put elsewhere since."""

    number: Array
    """(m,) of the particles, ascending."""
    start: Array
    """(m, 2) where each was at the start of the last substep, m."""
    left: Array
    """(m, 2) and where at its end."""
    calm: Array
    """(m,) m/s, see `kernels.links.look_back`."""


def nobody(dtype: np.dtype[Any]) -> Past:
    """Nothing is remembered."""
    return Past(np.empty(0, np.int64), np.empty((0, 2)), np.empty((0, 2), dtype), np.empty(0))


class Work:
    """The linked particles.

    All arrays have a multiple of eight of rows: the last particle is repeated.

    Args:
        particle: (m,) the user's indices, ascending.
        mass: (n,) of all particles, kg.
        dtype: of their positions.

    Attributes:
        compact: (n,) where each of the user's particles is in here; only that of linked ones means anything.
        start: (m, 2) where each was at the start of this substep, m, and the way `back` to a substep before that.
        predicted: (m, 2) where the integrator, and then its pin, had put it, and how far links have moved it by now, its `shift`.
        weight: (m,) inverse mass, as the rows feel it, 1/kg.
        pinned: (m,) bool, whose mass is infinite.
        assembly: (m,) row in here of the first of those each hangs together with by links, once that is `assembled`.
    """

    def __init__(self, particle: Array, mass: Array, dtype: np.dtype[Any]) -> None:
        self.particle = particle
        self.pinned = np.isinf(mass[particle])
        self.compact = np.zeros(len(mass), np.int64)
        self.compact[particle] = np.arange(len(particle))
        rows = -(-len(particle) // LANES) * LANES
        self.start, self.back, self.predicted, self.shift = np.zeros((4, rows, 2), dtype)
        self._where = np.zeros((rows, 2))
        self.weight = np.zeros(rows, dtype)
        self.assembly, self.assembled = np.arange(rows), False
        self._slot = np.zeros(rows, np.uint32)
        self._calm = np.full(rows, np.nan, dtype)
        self._burden, self._kept = np.zeros((2, rows, 2), dtype)
        self._past = nobody(dtype)
        self.seam = NONE
        self._order: Array | None = None

    def __len__(self) -> int:
        return len(self.particle)

    def good(self, state: State) -> bool:
        """Whether all is as it was when this was made, but for links: how many there are, and who is pinned."""
        return len(self.compact) == len(state) and not links.pins_differ(state.mass, self.particle, self.pinned)

    def assemble(self, joined: Array) -> None:
        """Note who hangs together. joined: (k, 2) the user's indices of those that links join."""
        clusters.join_rows(self.compact[joined], np.ones(len(self.weight)), self.assembly)
        clusters.settle(self.assembly)
        self.assembled = True
        self.assembly[len(self) :] = self.assembly[len(self) - 1 : len(self)]

    def slots(self, state: Slots) -> Array:
        """(m,) where the particles stand in the engine's order."""
        if self._order is not state.particle:  # every new order is a new array
            self._order = state.particle
            slot_of = np.empty(len(state.particle), np.uint32)
            slot_of[state.particle] = np.arange(len(slot_of))
            count = len(self)
            self._slot[:count] = slot_of[self.particle]
            self._slot[count:] = self._slot[count - 1 : count]
        return self._slot

    def begin(self, state: State, past: Past | None) -> None:
        """A frame begins: take up what is remembered of those who are where they were left."""
        self.seam = state.seam
        if past is self._past:
            links.recall_all(*past[1:], state.position, self.particle, self.start, self._calm)
        else:
            links.recall(*(past or nobody(state.dtype)), state.number, state.position, self.particle, self.start, self._calm)
        self._calm[len(self) :] = self._calm[len(self) - 1 : len(self)]  # the last one is repeated

    def end(self, state: State) -> Past:
        """The frame is good: what is to be remembered, until the `end` of the next."""
        if len(self._past.number) != (count := len(self)):
            number = memory.taken(state.number, self.particle)
            self._past = Past(number, np.empty((count, 2)), np.empty((count, 2), state.dtype), np.empty(count))
        links.remember(*self._past[1:], state.position, self.particle, self.start, self._calm)
        return self._past

    def arrays(self) -> tuple[Array, ...]:
        """As `kernels.linked.Linked` has them; the slots are right once `slots` has been asked."""
        return (
            self._slot,
            self.start,
            self.back,
            self.predicted,
            self.shift,
            self.weight,
            self._calm,
            self._burden,
            self._kept,
            self.assembly,
        )

    def where(self, state: Slots) -> Array:
        """(m, 2) where they are now, m; good until asked again."""
        motion.take_rows(self._where, state.position, self.slots(state))
        return self._where
