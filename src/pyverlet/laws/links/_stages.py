"""Links under the law of projection: the stages of a substep for the engine."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np

from pyverlet.compile import jit
from pyverlet.compile.bundle import hold
from pyverlet.ground.constants import LINKS_ONE_THREAD_BELOW, REST_ACCELERATIONS
from pyverlet.kernels import link_rows, linked, runs
from pyverlet.laws.contacts.broadphase import PairList
from pyverlet.laws.links._chains import PackedChains
from pyverlet.laws.links._link import Array
from pyverlet.laws.links._packed import Packed, PackedPins
from pyverlet.laws.links._pool import DistancePool, PinPool, RowPool
from pyverlet.laws.links._rows import PackedRows
from pyverlet.laws.links._work import Past, Work
from pyverlet.state.slots import Slots


class Stages:
    """What only the law of projection asks of the links of a world."""

    _state: Any
    _kept: Any
    _apart: Any
    _partners: Any
    _iterations: int
    _apart_changed: bool
    _know_apart: Any
    accept: Any
    joined: Any

    def _open_stages(self) -> None:
        self._few = True
        self._work = Work(np.empty(0, np.int64), self._state.mass[:0], self._state.dtype)
        self._past: Past | None = None
        self._packed: tuple[Packed, ...] = ()
        self._linked: Any = None
        self._rows: Any = None
        self._bundled = False  # whether these two are of the arrays of now

    def begin(self) -> bool:
        """A frame begins. True if other pairs than before are no contacts (`unlist`)."""
        if not self._kept:
            return False
        if any(pool.stale for pool in self._kept) or not self._work.good(self._state) or not self._packed:
            among = np.zeros(len(self._state), bool)
            for pool in self._kept:
                among[pool.entries["particle"]] = True
            self._work = Work(np.flatnonzero(among), self._state.mass, self._state.dtype)
            kinds = {type(pool): pool for pool in self._kept}
            distances, rows, pins = (kinds.get(kind) or kind() for kind in (DistancePool, RowPool, PinPool))
            known = self._packed[0] if self._packed and self._packed[0].pool is distances else None
            self._packed = known or PackedChains(distances, self._state.dtype), PackedRows(rows), PackedPins(pins)
            for packed in self._packed:
                packed.pack(self._work)
            self._few = len(self._work) < LINKS_ONE_THREAD_BELOW
        self._work.begin(self._state, self._past)
        for packed in self._packed:
            packed.begin()
        self._bundled = False
        return self.begin_apart()

    def begin_apart(self) -> bool:
        """A frame begins. True if other pairs than before are no contacts (`unlist`)."""
        self._know_apart()
        changed, self._apart_changed = self._apart_changed, False
        return changed

    def compiled(self, state: Slots, h: float) -> tuple[Any, Any, Any]:
        """What `kernels.linked` is handed in the substeps of a frame: `Linked`, `Rows`, and the numbers of `Linking`.

        Good as long as the order of the slots is.
        """
        self._work.slots(state)
        if not self._bundled:
            chains, rows, pins = (packed.arrays() for packed in self._packed)
            self._linked = hold(linked.Linked, (*self._work.arrays(), *chains, *pins), self._linked)
            self._rows, self._bundled = hold(link_rows.Rows, rows, self._rows), True
        numbers = (h, *self._work.seam.period, len(self._work), self._iterations, REST_ACCELERATIONS * h)
        return self._linked, self._rows, numbers

    def together(self, state: Slots) -> Array:
        """Slots of those they join, as long as the order of the slots is; from then on kernels know with whom."""
        if not self._work.assembled:
            self._work.assemble(self.joined())
        return self._work.slots(state)

    def unlist(self, pairs: PairList, particle: Array) -> None:
        """Take the pairs of `apart` from a list of candidates; particle: the user's index in each slot."""
        self._know_apart()
        if len(self._apart):
            runs.drop_pairs(pairs.first, pairs.count, pairs.pair_i, pairs.pair_j, particle, *self._partners)

    @property
    def stand_back(self) -> bool:
        """Whether they had better be solved on one thread while others use several: each colour is a meeting of theirs."""
        return self._few and jit.threads_in_use() > 1

    def _threads(self) -> AbstractContextManager[None]:
        return jit.one_thread() if self.stand_back else nullcontext()

    def before(self, state: Slots, h: float) -> None:
        """Before the integrator: remember where the substep starts."""
        links, _, numbers = self.compiled(state, h)
        with self._threads():
            linked.look(links, linked.Linking(*numbers), state.position, state.velocity, state.inverse_mass)

    def solve(self, state: Slots, h: float) -> None:
        """Move the linked particles to where their links allow, and break those that pull too hard."""
        links, rows, numbers = self.compiled(state, h)
        with self._threads():
            linked.solve(links, rows, linked.Linking(*numbers), state.position, state.velocity)

    def lay_down(self, state: Slots, h: float) -> None:
        """Before walls, where there are contacts: velocities are without what carries the pull of links."""
        links, _, numbers = self.compiled(state, h)
        with self._threads():
            linked.lay_down(links, linked.Linking(*numbers), state.velocity)

    def after(self, state: Slots, h: float) -> None:
        """After the contacts: what the links did is part of the acceleration, for integrators that remember it."""
        links, _, numbers = self.compiled(state, h)
        with self._threads():
            linked.note_pull(links, linked.Linking(*numbers), state.acceleration)

    def scatter(self) -> None:
        """The frame is good: what it did to the links holds."""
        self._past = self._work.end(self._state) if self._kept else None
        if self._kept:
            torn = [(packed, rows, packed.pulled()[rows]) for packed in self._packed if len(rows := packed.broken())]
            self.accept([(packed.pool, *rest) for packed, *rest in torn])
            for packed in self._packed:
                packed.end()

    def _save_past(self) -> Past | None:
        return self._past and Past(*(array.copy() for array in self._past))
