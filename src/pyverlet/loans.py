"""The inertia that circles at rest against each other have lent each other, kept while slots are reordered."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.broadphase import PairList
from pyverlet.constants import LOAN_S, PUSHED
from pyverlet.kernels import loans
from pyverlet.state import Slots

Array = NDArray[Any]


class Lent(NamedTuple):
    """By slot: the particle in it; kg it has borrowed, negative: lent; s for which it neither lends nor borrows."""

    particle: Array
    lent: Array
    busy: Array


class Loans:
    """Who has lent how much to the others, and what that changes for the contacts of a substep. Costs nothing until `begin`."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.forget()

    def forget(self) -> None:
        """Nobody has lent anything."""
        self._kept = Lent(np.empty(0, np.int32), np.empty(0, self._dtype), np.empty(0, self._dtype))
        self._lighter, self._touched = np.empty(0, self._dtype), np.empty(0, np.uint8)

    def begin(self, state: Slots) -> Array:
        """(n,) inverse masses with which this substep's contacts are solved."""
        if self._kept.particle is not state.particle:
            self._follow(state)
        loans.weigh(state.mass, state.inverse_mass, self._kept.lent, self._lighter)
        return self._lighter

    def _follow(self, state: Slots) -> None:
        """Slots were reordered, or particles have come or gone."""
        kept = np.zeros((2, len(state)), self._dtype)
        alive = self._kept.particle >= 0
        kept[:, self._kept.particle[alive]] = self._kept.lent[alive], self._kept.busy[alive]
        self._kept = Lent(state.particle, *kept[:, state.particle])
        self._lighter, self._touched = np.empty(len(state), self._dtype), np.empty(len(state), np.uint8)

    def recall(self, state: Slots, pairs: PairList) -> None:
        """Those that have bounced in this substep do so with a mass of their own."""
        which = (pairs.first, pairs.count, pairs.pair_i, pairs.pair_j, pairs.meeting, pairs.impulse)
        loans.recall(state.inverse_mass, *which, state.real(LOAN_S), self._kept.lent, self._kept.busy, self._lighter)

    def keep_weight(self, state: Slots, h: float, fed: float) -> None:
        """Let the integration have pulled at each circle with its own weight. fed: what velocities are fed, of an overlap."""
        # At rest a substep ends with the velocity -(1 - PUSHED / fed) a h: the same for all that way.
        self._pull = state.real(h), state.real((state.drop - 1 + PUSHED / fed) * h * h)
        moving = (state.position, state.velocity, state.acceleration)
        loans.keep_weight(*moving, state.inverse_mass, self._lighter, *self._pull)

    def settle(self, state: Slots, pairs: PairList, h: float) -> None:
        """Those that touch lend each other; those that do not have fallen by themselves."""
        _, lent, busy = self._kept
        which = (pairs.first, pairs.count, pairs.pair_i, pairs.pair_j, pairs.touching, pairs.impulse, pairs.touches)
        self._touched.fill(0)
        loans.share(state.mass, state.inverse_mass, *which, lent, busy, self._touched)
        moving, masses = (state.position, state.velocity, state.acceleration), (state.mass, state.inverse_mass, self._lighter)
        loans.settle(*moving, *masses, *self._pull, self._touched, state.real(min(h / LOAN_S, 1.0)), state.real(h), lent, busy)

    def renumber(self, now: Array) -> None:
        """The particles are now at `now` (n,), or no more (-1)."""
        self._kept = self._kept._replace(particle=now[self._kept.particle].astype(np.int32))

    def save(self) -> Lent:
        """What `restore` needs."""
        return Lent(*(array.copy() for array in self._kept))

    def restore(self, saved: Lent) -> None:
        """Back to what was saved."""
        self._kept = Lent(*(array.copy() for array in saved))
