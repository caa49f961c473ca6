"""The inertia that circles at rest against each other have lent each other, kept while slots are reordered."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile.rows import WIDTH
from pyverlet.ground.constants import FED, LOAN_S, PUSHED
from pyverlet.kernels import balance, loans
from pyverlet.laws.contacts.wide import Wide
from pyverlet.state.state import Slots

Array = NDArray[Any]


class Lent(NamedTuple):
    """By slot: the particle in it; kg it has borrowed, negative: lent; s for which it does neither; whether walls hold it."""

    particle: Array
    lent: Array
    busy: Array
    held: Array


class Loans:
    """Who has lent how much to the others, and what that changes for the contacts of a substep. Costs nothing until `begin`."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.forget()

    def forget(self) -> None:
        """Nobody has lent anything."""
        self._kept = Lent(np.empty(0, np.int32), np.empty(0, self._dtype), np.empty(0, self._dtype), np.empty(0, np.uint8))
        self._fit(0)

    def _fit(self, count: int) -> None:
        """Room for what lasts a substep."""
        self._lighter, self._touched = np.empty(count, self._dtype), np.empty(count, np.uint8)
        self._before, self._spin_before = np.empty((count, 2), self._dtype), np.empty(count, self._dtype)
        self._unpushed, self._rows = np.empty((count, 2), self._dtype), np.empty((count, WIDTH), self._dtype)
        self._root, self._sums, self._open_to = np.empty(count, np.int64), np.empty((count, 10)), np.empty(count, np.uint8)

    def begin(self, state: Slots, h: float) -> Array:
        """(n,) inverse masses with which this substep's contacts are solved; each is pulled at by its own weight all the same."""
        if self._kept.particle is not state.particle:
            self._follow(state)
        loans.weigh(state.mass, state.inverse_mass, self._kept.lent, self._lighter)
        # At rest a substep ends with the velocity -(1 - PUSHED / FED) a h: the same for all that way.
        self._kick, self._fall = state.real(h), state.real((state.drop - 1 + PUSHED / FED) * h * h)
        held = self._kept.held
        balance.set_out(state.velocity, state.acceleration, state.spin, held, self._kick, self._before, self._spin_before)
        loans.pull(state.position, state.acceleration, state.inverse_mass, self._lighter, held, self._fall)
        return self._lighter

    def noted(self) -> tuple[Array, Array, Array, Array]:
        """Where an impact notes what it does by masses of their own: before, spin_before, lent, busy."""
        return self._before, self._spin_before, self._kept.lent, self._kept.busy

    def _follow(self, state: Slots) -> None:
        """Slots were reordered, or particles have come or gone."""
        alive = self._kept.particle >= 0
        where, columns = self._kept.particle[alive], []
        for column in self._kept[1:]:
            kept = np.zeros(len(state), column.dtype)
            kept[where] = column[alive]
            columns.append(kept[state.particle])
        self._kept = Lent(state.particle, *columns)
        self._fit(len(state))

    def settle(self, state: Slots, wide: Wide, h: float) -> None:
        """Those that touch lend each other; those that do not have fallen by themselves."""
        _, lent, busy, held = self._kept
        loans.share(*wide.touching(), wide.cut(), state.mass, state.inverse_mass, lent, busy, self._touched, self._rows)
        bodies = (state.position, state.velocity, state.acceleration, state.inverse_mass, self._lighter, held)
        loans.settle(*bodies, self._touched, self._kick, self._fall)
        loans.give_back(state.mass, state.real(min(h / LOAN_S, 1.0)), state.real(h), lent, busy)

    def free_of_walls(self, state: Slots) -> None:
        """Contacts have been solved; what changes velocities from now on is walls."""
        self._unpushed[:] = state.velocity

    def leave_out(self, change: Array) -> None:
        """But not this `change` (n, 2), m/s, which keeps momentum by itself."""
        self._before += change
        self._unpushed += change

    def join(self, state: Slots, wide: Wide) -> None:
        """Walls have pushed: who hangs together, and is held by them."""
        balance.cluster(*wide.touching(), state.inverse_mass, self._root)
        who = (state.inverse_mass, self._touched, self._root)
        balance.note_walls(state.velocity, self._unpushed, *who, self._sums, self._kept.held)

    def balance(self, state: Slots, *, rubs: bool) -> None:
        """The substep is done: give those who have met with borrowed inertia what their momentum lacks."""
        bodies = (state.position, state.velocity, state.spin, state.radius, state.mass, state.inverse_mass, self._lighter)
        before = (self._touched, self._before, self._spin_before)
        balance.balance(*bodies, *before, self._root, rubs, self._sums, self._open_to)

    def let_fall(self, state: Slots) -> None:
        """The frame is done: those on whom only others of their cluster have pushed do not rest."""
        balance.let_fall(state.resting, self._kept.held)

    def renumber(self, now: Array) -> None:
        """The particles are now at `now` (n,), or no more (-1)."""
        before = self._kept.particle  # some may be no more already
        self._kept = self._kept._replace(particle=np.where(before >= 0, now[before], -1).astype(np.int32))

    def save(self) -> Lent:
        """What `restore` needs."""
        return Lent(*(array.copy() for array in self._kept))

    def restore(self, saved: Lent) -> None:
        """Back to what was saved."""
        self._kept = Lent(*(array.copy() for array in saved))
