"""Candidate pairs of a list in packs of eight, and the contact solver for circles that neither bounce nor rub."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile import jit
from pyverlet.compile.lanes import LANES
from pyverlet.ground import memory
from pyverlet.ground.constants import COLOURS, FED_SMOOTH, LARGEST_PUSH, PUSHED
from pyverlet.kernels import grips, packs
from pyverlet.laws.contacts.broadphase import PairList, rows_of
from pyverlet.state.state import Slots

Array = NDArray[Any]


class Packs:
    """The pairs of one list, packed each time the list is made anew.

    `lane_i`, `lane_j` slots, those of strip s from begin[s] to begin[s] + lanes[s], the first apart[s] unlikely to touch soon;
    `gap` (2, room) from i to j when the list was made, m; `moved` (n, 2) how far circles have moved since; `reach`, `share` one
    for each lane, or (LANES,) if they are the same for all; `normal` (2, room) of touching pairs, if noted here.
    """

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.begin = np.zeros(1, np.int64)
        self.lanes = self.apart = np.zeros(0, np.int64)
        self._make_room(0)
        self._cut = np.zeros((2, 2), np.int64)
        self.origin = self.moved = np.empty((0, 2), dtype)
        self._spare = COLOURS * LANES  # lanes of a strip beyond its pairs: twice as many as any needed in the last list
        self._size: Array | None = None
        self._varied = 0
        self._deeps = np.zeros(0, np.int64)  # packs of each strip that overlap deeply
        self._fresh = np.ones(1, np.uint8)  # 1: they are to be noted, once a frame; a kernel says when it has

    def _make_room(self, lanes: int) -> None:
        self.lane_i, self.lane_j = (memory.empty(lanes, np.uint32) for _ in range(2))
        self.gap, self.normal = memory.empty((2, lanes), self._dtype), np.empty((2, 0), self._dtype)
        self._deep = np.empty(lanes // LANES, np.int64)
        self._hold(0)

    def _hold(self, lanes: int) -> None:
        """Room for the notes of friction; the values are anything."""
        self.slip, self._depths, self._held = (np.empty(lanes, self._dtype) for _ in range(3))

    def take(self, pairs: PairList, origin: Array, radius: Array) -> None:
        """Pack a new list; origin: (n, 2) positions it was made from; radius: (n,) m."""
        need = pairs.count + self._spare
        self.lanes, self.apart = (np.empty(len(pairs.count), np.int64) for _ in range(2))
        which = pairs.listed()
        while True:
            self.begin = np.concatenate(([0], np.cumsum(need)))
            if not self.begin[-1] <= len(self.lane_i) <= 1.1 * self.begin[-1]:
                self._make_room(int(self.begin[-1]))
            used = np.full(len(origin), -1, np.int64)
            packs.pack(origin, radius, *which, used, self.begin, self.lanes, self.apart, self.lane_i, self.lane_j, self.gap)
            if (self.lanes <= need).all():
                break
            need = np.maximum(need, self.lanes)
        self._spare = 2 * max(int((self.lanes - pairs.count).max(initial=0)), LANES)
        self._cut = np.empty((2, 0), np.int64)
        self.origin = origin
        self.moved = memory.empty(origin.shape, origin.dtype)
        self._size = None
        self._deeps, self._fresh[0] = np.zeros(len(pairs.count), np.int64), 1

    def _parts(self) -> Array:
        """(2, threads + 1): even and odd strips, each cut into as many parts of as nearly the same number of lanes as can be.

        By their number alone a round room's would not be: the short rows of strips at its ends hold fewer.
        """
        threads = jit.threads_in_use()
        if self._cut.shape[1] != threads + 1:
            self._cut = np.empty((2, threads + 1), np.int64)
            for parity in range(2):
                before = np.concatenate(([0], np.cumsum(self.lanes[parity::2])))
                middle = 0.5 * (before[1:] + before[:-1])
                self._cut[parity] = np.searchsorted(middle, np.linspace(0, before[-1], threads + 1))
        return self._cut

    def pairs(self) -> Array:
        """(k, 2) slots of the pairs in all lanes; a copy, for tests and measurements. The last pair of a pack may come twice."""
        return rows_of(*self.listed())

    def fits(self, state: Slots) -> bool:
        """Whether nothing is left to be prepared before `project`."""
        return self._size is state.size

    def _share_out(self, state: Slots) -> None:
        """Bring reach and share up to date with the sizes of now."""
        self._size = state.size
        size, inverse_mass = state.size, state.inverse_mass
        self._varied = int(any((values != values[0]).any() for values in (size, state.radius, inverse_mass)))
        self._body = np.empty((6, 0), self._dtype)
        if self._varied:
            self.reach, self.share = (memory.empty(len(self.lane_i), self._dtype) for _ in range(2))
            packs.share_out(self.begin, self.lanes, self.lane_i, self.lane_j, size, inverse_mass, self.reach, self.share)
        else:
            self.reach, self.share = np.full(LANES, size[0] + size[0]), np.full(LANES, self._dtype.type(0.5))

    def project(self, state: Slots, h: float, fed: float = FED_SMOOTH, *, sets_out: bool = True, arrives: bool = True) -> None:
        """Move overlapping circles apart and feed their velocities: all of it, or but what has `moved` to do with pairs."""
        if self._size is not state.size:
            self._share_out(state)
        if self.normal.shape != self.gap.shape:
            self.normal = memory.empty(self.gap.shape, self._dtype)
        where = (self._parts(), self.begin, self.lanes, self.apart, self.lane_i, self.lane_j, self.gap)
        settings = (self.reach, self.share, self._varied, *self.feed(state, h, fed))
        notes = (self.normal, self._depths, self._deep, self._deeps, self._fresh, int(sets_out), int(arrives), state.claims())
        packs.project(state.position, state.velocity, self.origin, self.moved, *where, *settings, *notes)

    def still(self, state: Slots, *, marks: bool = False) -> None:
        """Take from touching circles the velocity that projection has put in; mark them as resting, too."""
        where = (self._cut, self.begin, self.lanes, self.apart, self.lane_i, self.lane_j)
        packs.still(
            state.velocity, *where, self.share, self._varied, self.normal, state.resting, self._fresh, int(marks), state.claims()
        )

    def for_fused(self, state: Slots, *, marks: bool) -> tuple[tuple[Any, ...], bool]:
        """The pairs as `kernels.fused` takes them, up to `deeps`, and whether it is to note the deep ones.

        marks: it marks who rests, too.
        """
        if self._size is not state.size:
            self._share_out(state)
        looks, self._fresh[0] = bool(self._fresh[0]), marks
        where = (self.begin, self.lanes, self.apart, self.lane_i, self.lane_j, self.gap)
        return (*where, self.reach, self.share, self._varied, self._deep, self._deeps), looks

    def feed(self, state: Slots, h: float, fed: float = FED_SMOOTH) -> tuple[Any, Any]:
        """What of a move velocities are fed, 1/s, and the largest move, of the contact distance."""
        return state.reals(fed / PUSHED / h, LARGEST_PUSH)

    # ---- friction ------------------------------------------------------------------------------------------------------

    def listed(self) -> tuple[Array, Array, Array, Array]:
        """Where the pairs are whose `slip` is held: first, count, pair_i, pair_j. Some come twice, and slip alike."""
        return self.begin[:-1], self.lanes, self.lane_i, self.lane_j

    def hold_slips(self) -> None:
        """Room for what friction notes; the values are anything."""
        if len(self.slip) != len(self.lane_i):
            self._hold(len(self.lane_i))

    def drop_slips(self) -> None:
        """Nobody rubs any more."""
        if len(self.slip):
            self._hold(0)

    def grip(self, state: Slots, h: float, mu: float, leaning: float, spent: Array) -> None:
        """Answer what touching pairs have slipped."""
        state.note_turn(h)
        around = (state.position, state.velocity, state.spin, state.turn, state.lift, self._own(state))
        before = (self.moved, np.empty_like(state.spin))
        real = state.real
        grips.grip(*around, *before, *self._rubbing(state), real(h), real(mu), real(leaning), spent)

    def rub(self, state: Slots, h: float, mu: float, spent: Array) -> None:
        """Stop the slip and the approach of touching pairs, and note what they have slipped."""
        around = (state.start, self.moved, state.position, state.velocity, state.spin, state.turn, self._own(state))
        grips.rub(*around, *self._rubbing(state), state.real(h), state.real(mu), spent)

    def _own(self, state: Slots) -> Array:
        return state.friction if state.most_friction >= 0 else state.friction[:0]

    def _rubbing(self, state: Slots) -> tuple[Any, ...]:
        if not self._body.shape[1]:
            self._body = np.empty((6, len(self.lane_i) if self._varied else LANES), self._dtype)
            lane = np.zeros(LANES, np.uint32)
            begin, lanes, i, j = self.listed() if self._varied else (np.zeros(1, np.int64), np.full(1, LANES), lane, lane)
            grips.weigh(begin, lanes, i, j, state.radius, state.inverse_mass, self._body)
        where = (self._parts(), self.begin, self.lanes, self.lane_i, self.lane_j, self._body, self._varied)
        return (*where, self.normal, self._depths, self.slip, self._held)

    def mark_resting(self, state: Slots) -> None:
        """Note in `state.resting` who touches another."""
        where = (self._parts(), self.begin, self.lanes, self.lane_i, self.lane_j)
        packs.mark_touching(*where, self.normal, state.resting, self._fresh)
