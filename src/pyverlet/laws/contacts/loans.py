"""The inertia that circles at rest against each other have lent each other, kept while slots are reordered."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile.rows import WIDTH
from pyverlet.ground.constants import FED, LOAN_S, PUSHED, SUNK
from pyverlet.kernels import balance, lending
from pyverlet.laws.contacts.wide import Wide
from pyverlet.state.slots import Slots

Array = NDArray[Any]


class Lent(NamedTuple):
    """By slot: the particle in it; kg it has borrowed, negative: lent; s for which it does neither; whether walls hold it."""

    particle: Array
    lent: Array
    busy: Array
    held: Array


class Loans:
    """Who has lent how much to the others, and what that changes for the contacts of a substep. Costs nothing until `begin`.

    Attributes:
        compiled: what `kernels.lending` takes since `begin`, (arrays, terms).
        nobody: the same, empty, of worlds where nobody lends.
    """

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.forget()
        self.compiled = self.nobody = self._arrays(np.empty(0, dtype)), (dtype.type(0),) * 5

    def forget(self) -> None:
        """Nobody has lent anything."""
        self._kept = Lent(np.empty(0, np.int32), np.empty(0, self._dtype), np.empty(0, self._dtype), np.empty(0, np.uint8))
        self._fit(0)

    def _fit(self, count: int) -> None:
        """Room for what lasts a substep."""
        self._lighter, self._touched = np.empty(count, self._dtype), np.empty(count, np.uint8)
        self._before, self._spin_before = np.empty((count, 2), self._dtype), np.empty(count, self._dtype)
        self._unpushed, self._aside = np.empty((2, count, 2), self._dtype)
        self._rows, self._calm = np.empty((count, WIDTH), self._dtype), np.zeros(count, self._dtype)
        self._root, self._among = np.empty((2, count), np.int64)
        self._sums, self._open_to = np.empty((count, 10)), np.empty(count, np.uint8)

    def begin(self, state: Slots, h: float, strongest: float) -> tuple[Array, ...]:
        """Contacts will be solved with lent inertia. Where an impact notes what it does by masses of their own: before,
        spin_before, lent, busy; and calm. strongest: m/s^2, that anybody feels.
        """
        if self._kept.particle is not state.particle:
            self._follow(state)
        # At rest a substep ends with the velocity -(1 - PUSHED / FED) a h: the same for all that way.
        terms = state.reals(h, (state.drop - 1 + PUSHED / FED) * h * h, min(h / LOAN_S, 1.0), SUNK * strongest * LOAN_S, h)
        self.compiled = self._arrays(state.mass), terms
        return self._before, self._spin_before, self._kept.lent, self._kept.busy, self._calm

    def _arrays(self, mass: Array) -> tuple[Array, ...]:
        _, lent, busy, held = self._kept
        return (
            mass, lent, busy, self._calm, held, self._lighter, self._touched, self._before, self._spin_before, self._unpushed,
            self._aside, self._rows, self._root, self._sums, self._open_to, self._among,
        )  # fmt: skip

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

    # ---- the stages of a substep, as `kernels.lending` has them --------------------------------------------------------------

    def lend(self, wide: Wide) -> None:
        """The inertia with which this substep's contacts are solved; each is pulled at by its own weight all the same."""
        lending.call_lend(wide.circles, wide.arrays, *self.compiled, wide.cut())

    def settle(self, wide: Wide) -> None:
        """Those that touch lend each other; those that do not have fallen by themselves."""
        lending.call_settle(wide.circles, wide.arrays, *self.compiled, wide.cut())

    @contextmanager
    def aside(self, wide: Wide) -> Iterator[None]:
        """Meanwhile links, which keep momentum by themselves, change velocities."""
        lending.call_set_aside(wide.circles, self.compiled[0])
        yield
        lending.call_leave_out(wide.circles, self.compiled[0])

    def join(self, wide: Wide) -> None:
        """Walls have pushed: who hangs together, and is held by them."""
        lending.call_join(wide.circles, wide.arrays, self.compiled[0])

    def even_up(self, wide: Wide) -> None:
        """The substep is done: give those who have met with borrowed inertia what their momentum lacks."""
        lending.call_even_up(wide.circles, self.compiled[0], int(wide.rubs))

    # ---- beyond substeps -----------------------------------------------------------------------------------------------------

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
