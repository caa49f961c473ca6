"""The memory of friction: what each touching pair has slipped, kept while lists of pairs come and go."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.broadphase import PairList
from pyverlet.kernels import friction

Array = NDArray[Any]


class Kept(NamedTuple):
    """Slips (m) of pairs of particles low < high, the user's indices, sorted by `low`."""

    low: Array
    high: Array
    slip: Array


class Slips:
    """Moves slips from one list of pairs to the next, by way of the particles. Does nothing until `start`."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.forget()

    def forget(self) -> None:
        """Nobody has slipped."""
        self._owner: Array | None = None  # (n,) the particle in each slot of the list, as long as that holds the slips
        self._kept = Kept(np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0, self._dtype))

    def start(self, pairs: PairList, particle: Array) -> None:
        """Have the list hold the slips, if it is a new one."""
        if self._owner is None:
            pairs.hold_slips()
            self._owner = particle.copy()
            low, high, slip = self._kept
            begin = np.concatenate((np.zeros(1, np.int64), np.cumsum(np.bincount(low, minlength=len(particle)))))
            which = (pairs.first, pairs.count, pairs.pair_i, pairs.pair_j)
            friction.give_slips(*which, pairs.slip, self._owner, begin, high, slip)

    def stop(self, pairs: PairList) -> None:
        """The list is about to be made anew: keep its slips."""
        if self._owner is not None:
            self._kept = self._taken(pairs, self._owner)
            self._owner = None

    def _taken(self, pairs: PairList, owner: Array) -> Kept:
        room = int(pairs.count.sum())
        kept = Kept(np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room, self._dtype))
        begin = np.empty(int(owner.max(initial=-1)) + 2, np.int64)
        found = friction.take_slips(pairs.first, pairs.count, pairs.pair_i, pairs.pair_j, pairs.slip, owner, begin, *kept)
        return Kept(*(array[:found] for array in kept))

    def renumber(self, now: Array) -> None:
        """The particles are now at `now` (n,), or no more (-1)."""
        if self._owner is not None:
            self._owner = now[self._owner].astype(np.int32)
        low, high = now[self._kept.low].astype(np.int32), now[self._kept.high].astype(np.int32)
        alive = (low >= 0) & (high >= 0)
        self._kept = Kept(low[alive], high[alive], self._kept.slip[alive])

    def save(self, pairs: PairList) -> Kept:
        """What `restore` needs."""
        return self._kept if self._owner is None else self._taken(pairs, self._owner)

    def restore(self, saved: Kept) -> None:
        """Back to what was saved; what the list holds no longer counts."""
        self._owner, self._kept = None, saved
