"""The inertia that circles at rest against each other have lent each other, kept while slots are reordered."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile.bundle import hold
from pyverlet.compile.lanes import LANES
from pyverlet.ground.constants import FED, LOAN_S, PUSHED, SUNK
from pyverlet.kernels import balance, hanging
from pyverlet.kernels.lending import Hanging, Lending
from pyverlet.kernels.loans import CHUNK
from pyverlet.laws.contacts.wide import Wide
from pyverlet.state.slots import Slots

Array = NDArray[Any]

_NONE: tuple[Any, Any] = None, None


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
        self._lending, self._terms = self._arrays(np.empty(0, dtype)), (dtype.type(0),) * 5
        self._empty = self._lending, self._hanging
        self._nobody: Any = None
        self._bundles = _NONE

    def forget(self) -> None:
        """Nobody has lent anything."""
        self._kept = Lent(np.empty(0, np.int32), np.empty(0, self._dtype), np.empty(0, self._dtype), np.empty(0, np.uint8))
        self._fit(0)

    def _fit(self, count: int) -> None:
        """Room for what lasts a substep."""
        self._lighter, self._touched, self._linked = np.empty(count, self._dtype), *np.zeros((2, count), np.uint8)
        self._before, self._spin_before = np.empty((count, 2), self._dtype), np.empty(count, self._dtype)
        self._unpushed, self._inertia = np.empty((2, count, 2), self._dtype)
        self._calm = np.zeros(count, self._dtype)
        self._what, self._sums = np.empty(count, np.uint8), np.empty((count, 10))
        self._among, self._found = np.empty(count, np.int32), np.zeros(-(-count // CHUNK), np.int64)
        none = np.empty(0, np.int64)
        self._strips, self._hanging = none, self._unknown(none, none, 0, 0)

    def _unknown(self, lanes: Array, first: Array, packs: int, count: int) -> tuple[Array, ...]:
        """Of circles that hang together who knows how."""
        root, heads, seen, group, chiefs = np.zeros((5, count), np.int32)
        left = np.full(count, -1, np.int32)
        sets, changed = np.array([-1, 0, 0]), np.empty(packs, np.int64)
        where, found = np.empty(2 * LANES * packs, np.int32), np.empty(hanging.AROUND, np.int64)
        touch, changes = np.zeros(packs, np.uint8), np.zeros_like(lanes)
        return root, heads, sets, touch, changed, changes, first, where, found, seen, left, group, chiefs

    def _hang(self, wide: Wide, count: int) -> None:
        """The list of pairs is new."""
        first = np.empty(count + 1, np.int64)
        self._strips, self._hanging = wide.lanes, self._unknown(wide.lanes, first, len(wide.lane_i) // LANES, count)
        hanging.list_lanes(wide.begin, wide.lanes, wide.lane_i, wide.lane_j, *self._hanging[6:8])

    def begin(self, state: Slots, wide: Wide, h: float, strongest: float, linked: Array | None) -> tuple[Array, ...]:
        """Contacts will be solved with lent inertia. Where an impact notes what it does by masses of their own: before,
        spin_before, lent, busy; and calm, and inertia. strongest: m/s^2, that anybody feels. linked: slots of whom links join.
        """
        if self._kept.particle is not state.particle:
            self._follow(state)
        if self._strips is not wide.lanes:
            self._hang(wide, len(state))
        self._linked.fill(0)
        if linked is not None:
            self._linked[linked] = 1
        # At rest a substep ends with the velocity -(1 - PUSHED / FED) a h: the same for all that way.
        fall, part, sunk = (state.drop - 1 + PUSHED / FED) * h * h, min(h / LOAN_S, 1.0), SUNK * strongest * LOAN_S
        self._lending, self._terms = self._arrays(state.mass), state.reals(h, fall, part, sunk, h)
        return self._before, self._spin_before, self._kept.lent, self._kept.busy, self._calm, self._inertia

    def compiled(self, lends: bool) -> tuple[Any, Any, Any]:
        """What `kernels.lending` takes since `begin`: `Lending`, `Hanging`, and the numbers of `Terms`.

        lends: whether anybody does; else all is empty.
        """
        if not lends:
            self._nobody = self._nobody or _bundled(*self._empty)
            return *self._nobody, self._terms
        self._bundles = _bundled(self._lending, self._hanging, self._bundles)
        return *self._bundles, self._terms

    def _arrays(self, mass: Array) -> tuple[Array, ...]:
        _, lent, busy, held = self._kept
        return (
            mass, lent, busy, self._calm, held, self._lighter, self._touched, self._linked, self._before, self._spin_before,
            self._unpushed, self._what, self._sums, self._among, self._found,
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


def _bundled(lending: tuple[Array, ...], hanging: tuple[Array, ...], before: tuple[Any, Any] = _NONE) -> tuple[Any, Any]:
    return hold(Lending, lending, before[0]), hold(Hanging, hanging, before[1])
