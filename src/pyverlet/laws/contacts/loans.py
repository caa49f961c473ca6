"""The inertia that circles at rest against each other have lent each other, kept while slots are reordered."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile.bundle import fields
from pyverlet.compile.lanes import LANES
from pyverlet.ground.constants import FED, LOAN_S, PUSHED, SUNK
from pyverlet.kernels import balance, hanging, lending
from pyverlet.kernels.loans import CHUNK
from pyverlet.laws.contacts.wide import Wide
from pyverlet.state.slots import Slots

Array = NDArray[Any]

_ROOT, _GROUP = (fields(lending.Hanging).index(name) for name in ("root", "group"))


class Lent(NamedTuple):
    """By slot: the particle in it; kg it has borrowed, negative: lent; s for which it does neither; whether walls hold it."""

    particle: Array
    lent: Array
    busy: Array
    held: Array


class Joined(NamedTuple):
    """Whom links join, as `kernels.linked.Linked` has them: their slots, the inverse mass links move them by, 1/kg, and how far,
    m; with whom they hang together; and who is tied to a point, if the pin is intact.
    """

    slot: Array
    weight: Array
    shift: Array
    assembly: Array
    tied: Array
    intact: Array


class Loans:
    """Who has lent how much to the others, and what that changes for the contacts of a substep. Costs nothing until `begin`.

    Attributes:
        compiled: what `kernels.lending` takes since `begin`, (arrays, arrays of `kernels.hanging`, terms).
        nobody: the same, empty, of worlds where nobody lends.
    """

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.forget()
        self.compiled = self.nobody = self._arrays(np.empty(0, dtype)), self._hanging, (dtype.type(0),) * 5

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

    def begin(self, state: Slots, wide: Wide, h: float, strongest: float, joined: Joined | None) -> tuple[Array, ...]:
        """Contacts will be solved with lent inertia. Where an impact notes what it does by masses of their own: before,
        spin_before, lent, busy; and calm, and inertia. strongest: m/s^2, that anybody feels.
        """
        if self._kept.particle is not state.particle:
            self._follow(state)
        if self._strips is not wide.lanes:
            self._hang(wide, len(state))
        self._linked.fill(0)
        if joined:
            self._linked[joined.slot] = 1
        # At rest a substep ends with the velocity -(1 - PUSHED / FED) a h: the same for all that way.
        terms = state.reals(h, (state.drop - 1 + PUSHED / FED) * h * h, min(h / LOAN_S, 1.0), SUNK * strongest * LOAN_S, h)
        self.compiled = self._arrays(state.mass), self._hanging, terms
        return self._before, self._spin_before, self._kept.lent, self._kept.busy, self._calm, self._inertia

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

    # ---- the stages of a substep, as `kernels.lending` has them --------------------------------------------------------------

    def lend(self, wide: Wide) -> None:
        """The inertia with which this substep's contacts are solved; each is pulled at by its own weight all the same."""
        arrays, _, terms = self.compiled
        lending.call_lend(wide.circles, wide.arrays, arrays, terms, wide.cut(), int(wide.rubs))

    def settle(self, state: Slots, wide: Wide) -> None:
        """Those that touch lend each other; those that do not have fallen by themselves."""
        lending.call_settle(wide.circles, wide.arrays, *self.compiled, wide.cut(), state.claims())

    def tell_weights(self, joined: Joined) -> None:
        """Links come, and move whom they join by the inertia of now."""
        lending.call_tell_weights(joined.slot, joined.weight, self.compiled[0])

    def note_unpushed(self, wide: Wide) -> None:
        """They are done: what changes velocities next is walls."""
        lending.call_note_unpushed(wide.circles, self.compiled[0])

    def join(self, wide: Wide, joined: Joined | None) -> None:
        """Walls have pushed: who hangs together, and is held by them."""
        arrays, hanging, _ = self.compiled
        if joined:
            slot, _, _, *others = joined
            lending.call_join_linked(wide.circles, wide.arrays, arrays, hanging, slot, *others)
        else:
            lending.call_join(wide.circles, wide.arrays, arrays, hanging)

    def even_up(self, wide: Wide, joined: Joined | None) -> None:
        """The substep is done: give those who have met with borrowed inertia what their momentum lacks."""
        arrays, hanging, _ = self.compiled
        lending.call_even_up(wide.circles, arrays, hanging[_GROUP if joined else _ROOT], int(wide.rubs))

    def balance_pull(self, wide: Wide, joined: Joined, h: float) -> None:
        """What links have added to accelerations keeps momentum, too."""
        arrays, hanging, _ = self.compiled
        lending.call_balance_pull(wide.circles, arrays, hanging[_GROUP], joined.slot, joined.shift, 1 / h)

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
