"""The solver of the contact law in Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.constants import FED, PUSHED, REST_ACCELERATIONS, UNEVEN
from pyverlet.laws.contacts import _held_events
from pyverlet.laws.contacts._held import pick_falling
from pyverlet.laws.contacts.broadphase import PairList, Strips, start
from pyverlet.laws.contacts.collisions import Collisions
from pyverlet.laws.contacts.growth import Growth
from pyverlet.laws.contacts.loans import Lent, Loans
from pyverlet.laws.contacts.methods import BruteForce, Fast
from pyverlet.laws.contacts.pegs import Pegs
from pyverlet.laws.contacts.slips import Kept, Slips
from pyverlet.laws.contacts.wide import Wide
from pyverlet.laws.events import Events
from pyverlet.laws.sleep import Sleep
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

Array = NDArray[Any]

Unlist = Callable[[PairList, Any], None]
"""Takes pairs that are no contacts, since a link says so, from a list; the second argument is the user's index in each slot."""


class Linked(Protocol):
    """What contacts ask of links; methods as in `laws.links.Links`."""

    def together(self, state: Slots) -> Array:
        """Slots of those they join."""


class ContactSolver:
    """The contact stages of a substep: who is near whom, and what `kernels.frame` needs to go through them.

    Attributes:
        pegs: who may be too large for a gap between pinned circles; where there are any, a substep is more than its sweeps.
    """

    def __init__(
        self,
        settings: Collisions,
        dtype: np.dtype[Any],
        unlist: Unlist,
        events: Events | None = None,
        sleep: Sleep | None = None,
    ) -> None:
        self.settings = settings
        self.broad_phase = start(settings.method, dtype)
        self._unlist = unlist
        self._seen = 0
        self.wide = Wide(dtype, settings.restitution, settings.friction, listens=events is not None)
        self._packed = False
        self._uneven = False  # whether masses differ so much that contacts need loans of inertia
        self._lends = False  # in this substep
        self._sleep = sleep
        self._slips = Slips(dtype)
        self._loans = Loans(dtype)
        self.growth, self.pegs = Growth(), Pegs()
        self.broad_phase.replacing = self._slips.stop
        if events is not None:
            self.broad_phase.renewing = lambda state, pairs: self._collect(state, events)

    def begin(self, state: Slots, *, changed: bool) -> None:
        """A frame begins; changed: with other particles, or other radii or masses, than the last one."""
        if not changed:
            self.broad_phase.follow(state)
            return
        self.broad_phase.forget()
        if len(state) > 1:
            self.fit(state)

    def fit(self, state: Slots) -> None:
        """Let particles that were added on top of others start smaller."""
        fresh = np.isnan(state.acceleration[:, 0])
        if fresh.any():
            self._list(state)
            self.growth.fit(state, self.broad_phase.list.listed(), np.isnan(state.acceleration[:, 0]))  # in the order of the list

    def before(self, state: Slots, h: float) -> None:
        """Let those that are not full-grown grow; note where the substep starts, for friction measures slip from there."""
        if state.size is not state.radius:
            self.growth.grow(state, h)
        if self._rubs(state):
            state.note_start()
        else:
            self._slips.forget()
            self.wide.drop_slips()

    def find(self, state: Slots, lag: float) -> None:
        """Broad phase: bring the list of candidate pairs up to date, and note events before contacts change a velocity."""
        self._list(state)
        while self._sleep and self._sleep.touched(state, self.broad_phase.list):
            self.broad_phase.renew(state)
            self._list(state)

    def _collect(self, state: Slots, events: Events) -> None:
        """Tell the events who has met, and how fast."""
        if self._packed:
            _held_events.collect(events, state, self.wide)

    def packed(self, state: Slots) -> Wide | None:
        """The pairs in packs, if there are any about the circles of now. In them is noted who has met since they were made."""
        return self.wide if self._packed and len(self.wide.origin) == len(state) else None

    def _list(self, state: Slots) -> None:
        self.broad_phase.update(state)
        if self._seen != self.broad_phase.rebuilds:
            self._seen = self.broad_phase.rebuilds
            self._unlist(self.broad_phase.list, state.particle)
            free = state.inverse_mass[state.inverse_mass > 0]
            # Loans of inertia know of no seam.
            self._uneven = bool(len(free)) and float(free.max()) > UNEVEN * float(free.min()) and not state.seam
            self._lends &= self._uneven
            self._packed = False
            self.pegs.look(state, self.broad_phase.list)

    def _pack(self, state: Slots) -> Wide:
        if not self._packed:
            self.wide.take(self.broad_phase.list, self.broad_phase.built, state.radius, state.seam)
            self._packed = True
            if self._sleep is None:
                self.broad_phase.release()
        return self.wide

    def steady(self, state: Slots) -> Strips | None:
        """Where strips stand, if a substep's contacts are but the two sweeps; None: there is more to them."""
        alone = not ((self._sleep and self._sleep.anyone) or self.pegs) and state.size is state.radius
        return self.broad_phase.strips() if alone else None

    def keeps(self, state: Slots) -> bool:
        """Whether the pairs are packed and were listed well so far, and nobody borrows inertia: a frame may begin with them."""
        return self._packed and not self._uneven and len(self.wide.origin) == len(state)

    def set_up(self, state: Slots, h: float, lag: float, strongest: float, links: Linked | None) -> Wide:
        """The pairs of now, with all that their sweeps need in this substep."""
        wide = self._pack(state)
        if self._rubs(state):
            self._slips.start(wide, state.particle)
        self._lends = self._uneven and strongest > 0
        linked = links.together(state) if links and self._lends else None
        noted = self._loans.begin(state, wide, h, strongest, linked) if self._lends else None
        rest_speed, accounts = REST_ACCELERATIONS * strongest * h, len(state.spent) > 0
        wide.set_up(state, h, lag, strongest, rest_speed, accounts, noted, linked=links is not None)
        return wide

    @property
    def lends(self) -> bool:
        """Whether circles lend each other inertia since `set_up`."""
        return self._lends

    def lent(self) -> tuple[Any, Any, Any]:
        """What `kernels.lending` takes, empty if none does."""
        return self._loans.compiled(self._lends)

    def spent(self) -> Any:
        """(2,) J that impacts, and friction, have taken in this frame, negative."""
        return self.wide.spent[:, :2].sum(axis=0)

    def weigh(self, asked: bool) -> None:
        """Whether somebody asks for the virial."""
        self.wide.weigh(asked)

    def virial(self) -> float:
        """Sum over all contacts of this frame of what pushes them apart times their distance, N s m."""
        return float(self.wide.spent[:, 2].sum())

    def clear_notes(self, walls_bounce: bool) -> None:
        """A frame begins; `walls_bounce`: whether walls or obstacles throw circles back, and ask who carries weight."""
        self.wide.spent.fill(0)
        self.wide.bear(walls_bounce)

    def listed(self) -> tuple[Any, Any, Any, Any]:
        """first, count, pair_i, pair_j of the pairs of now."""
        return self.wide.listed() if self._packed else self.broad_phase.list.listed()

    def save(self) -> tuple[Any, Kept, Lent, tuple[float, float]]:
        """What outlives a frame: the list, what friction remembers, who has lent what, the pace of growth."""
        return self.broad_phase.save(), self._slips.save(), self._loans.save(), self.growth.save()

    def restore(self, saved: tuple[Any, Kept, Lent, tuple[float, float]] | None, state: Slots) -> None:
        """Back to what `save` returned, or to nothing; `state` already has the order and radii of then."""
        phase, slips, lent, pace = saved or (None, None, None, (1.0, 0.0))
        self.growth.restore(pace)
        self._packed = False
        self.broad_phase.forget()
        if phase is not None:  # None: collisions were off, or of a kind that remembers nothing
            self.broad_phase.restore(phase, state)
        self._slips.forget()
        if slips is not None:
            self._slips.restore(slips)
        self._loans.forget()
        if lent is not None:
            self._loans.restore(lent)

    def renumber(self, now: np.ndarray[Any, Any]) -> None:
        """The particles are now at `now` (n,), or no more (-1)."""
        self._slips.renumber(now)
        self._loans.renumber(now)

    def _rubs(self, state: Slots) -> bool:
        return self.settings.friction > 0.0 or state.most_friction > 0.0

    def end(
        self, state: Slots, before: State, lag: float, dt: float, gravity: tuple[float, float], *, marked: bool = False
    ) -> None:
        """At the end of a frame of dt seconds: note who was held by a contact, and let those fall asleep that are tired.

        before: how the frame began. lag: seconds the velocity is behind. marked: who touches another is known to rest already.
        """
        state.lean = state.drop - PUSHED / FED
        if not marked:
            self.wide.mark_resting(state)
        if self._lends:
            self._loans.let_fall(state)
        else:
            pick_falling(state, before.velocity, lag, dt)
        if self._sleep and self._sleep.end(state, self.broad_phase.list, dt, float(np.hypot(*gravity))):
            self.broad_phase.forget()  # it has no use for pairs among sleepers


def find_contacts(state: State, method: Fast | BruteForce) -> np.ndarray[Any, np.dtype[np.int64]]:
    """(k, 2) user's indices i < j of all overlapping pairs of a state, sorted; leaves the state alone."""
    slots, phase = _listed(state, method)
    pairs = phase.list.pairs()
    a, b = slots.position[pairs[:, 0]].astype(np.float64), slots.position[pairs[:, 1]].astype(np.float64)
    reach = slots.radius[pairs].astype(np.float64).sum(axis=1)
    touching = pairs[np.hypot(*state.seam.nearest(a - b).T) < reach]
    named = np.sort(slots.particle[touching].astype(np.int64), axis=1)
    return named[np.lexsort(named.T[::-1])]


def _listed(state: State, method: Fast | BruteForce) -> tuple[Slots, Any]:
    slots = Slots(state.dtype)
    slots.gather(state)
    phase = start(method, state.dtype)
    phase.update(slots)
    return slots, phase
