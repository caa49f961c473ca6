"""Candidate pairs of a list in packs of eight, as kernels.packs works on them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet._lanes import LANES
from pyverlet.broadphase import PairList
from pyverlet.constants import FED, LARGEST_PUSH, PUSHED
from pyverlet.kernels import packs
from pyverlet.state import Slots

Array = NDArray[Any]


class Packs:
    """The pairs of one list, packed once each time the list is made anew; and the solver of contacts that works on them.

    `lane_i`, `lane_j` (lanes,) slots, strip s from begin[s] to begin[s + 1]; `gap` (2, lanes) from i to j when the list was
    made, m; `reach`, `share` (lanes,), or (LANES,) if they are the same for all; `normal` (2, lanes) of touching pairs.
    """

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self._colour = np.empty(0, np.int32)
        self._room(0)
        self.begin = np.zeros(1, np.int64)
        self.origin = self._moved = np.empty((0, 2), dtype)
        self._size: Array | None = None
        self._varied = 0

    def _room(self, lanes: int) -> None:
        self.lane_i, self.lane_j = np.empty(lanes, np.uint32), np.empty(lanes, np.uint32)
        self.gap, self.normal = np.empty((2, lanes), self._dtype), np.empty((2, lanes), self._dtype)

    def take(self, pairs: PairList, origin: Array) -> None:
        """Pack a new list; origin: (n, 2) positions it was made from."""
        which = (pairs.first, pairs.count, pairs.pair_i, pairs.pair_j)
        if len(self._colour) != len(pairs.pair_i):
            self._colour = np.empty(len(pairs.pair_i), np.int32)
        lanes = np.empty(len(pairs.first), np.int64)
        packs.colour_pairs(*which, self._colour, lanes)
        self.begin = np.concatenate(([0], np.cumsum(lanes)))
        total = int(self.begin[-1])
        if not total <= self.gap.shape[1] <= 2 * total:
            self._room(total + total // 8)
        packs.fill(*which, self._colour, self.begin, origin, self.lane_i, self.lane_j, self.gap)
        self.origin = origin
        self._moved = np.empty_like(origin)
        self._size = None

    def _share_out(self, state: Slots) -> None:
        """Bring reach and share up to date with the sizes of now."""
        self._size = state.size
        size, inverse_mass = state.size, state.inverse_mass
        self._varied = int((size != size[0]).any() or (inverse_mass != inverse_mass[0]).any())
        lanes = int(self.begin[-1])
        self.reach, self.share = (np.empty(lanes if self._varied else min(lanes, LANES), self._dtype) for _ in range(2))
        packs.share_out(self.lane_i, self.lane_j, size, inverse_mass, self.reach, self.share)

    def project(self, state: Slots, h: float) -> None:
        """Move overlapping circles apart and feed their velocities."""
        if self._size is not state.size:
            self._share_out(state)
        where = (self.begin, self.lane_i, self.lane_j, self.gap, self.reach, self.share, self._varied)
        settings = (state.real(FED / PUSHED / h), state.real(LARGEST_PUSH))
        packs.project(state.position, state.velocity, self.origin, self._moved, *where, *settings, self.normal)

    def still(self, state: Slots) -> None:
        """Take from touching circles the velocity that projection has put in."""
        packs.still(state.velocity, self.begin, self.lane_i, self.lane_j, self.share, self._varied, self.normal)

    def mark_resting(self, state: Slots) -> None:
        """Set `state.resting` for particles that touch another."""
        lanes = int(self.begin[-1])
        packs.mark_touching(self.lane_i[:lanes], self.lane_j[:lanes], self.normal, state.resting)
