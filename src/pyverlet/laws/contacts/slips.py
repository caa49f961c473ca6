"""The memory of friction: what each touching pair has slipped, kept while lists of pairs come and go."""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pyverlet.kernels import slips

Array = NDArray[Any]


class Kept(NamedTuple):
    """Slips (m) of pairs of particles low < high, the user's indices, sorted by `low`."""

    low: Array
    high: Array
    slip: Array


class Holder(Protocol):
    """A list of pairs that can hold their slips."""

    slip: Array

    def hold_slips(self) -> None:
        """Room for them."""

    def listed(self) -> tuple[Array, Array, Array, Array]:
        """first, count, pair_i, pair_j."""


class Slips:
    """Moves slips from one list of pairs to the next, by way of the particles. Does nothing until `start`."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self._none = Kept(np.empty(0, np.int32), np.empty(0, np.int32), np.empty(0, dtype))
        self.forget()

    def forget(self) -> None:
        """Nobody has slipped."""
        self._holder: Holder | None = None
        self._owner = self._none.low  # (n,) the particle in each slot of the list, as long as that holds the slips
        self._kept = self._none

    def start(self, holder: Holder, particle: Array) -> None:
        """Have this list hold the slips, if it does not."""
        if self._holder is not holder:
            self.stop()
            holder.hold_slips()
            self._holder, self._owner = holder, particle.copy()
            low, high, slip = self._kept
            begin = np.concatenate((np.zeros(1, np.int64), np.cumsum(np.bincount(low, minlength=len(particle)))))
            slips.give_slips(*holder.listed(), holder.slip, self._owner, begin, high, slip)

    def stop(self) -> None:
        """The list is about to be made anew, or another is to hold the slips: keep them."""
        if self._holder is not None:
            self._kept = self._taken(self._holder)
            self._holder = None

    def _taken(self, holder: Holder) -> Kept:
        first, count, pair_i, pair_j = holder.listed()
        room = int(count.sum())
        kept = Kept(np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room, self._dtype))
        begin = np.empty(int(self._owner.max(initial=-1)) + 2, np.int64)
        found = slips.take_slips(first, count, pair_i, pair_j, holder.slip, self._owner, begin, *kept)
        return Kept(*(array[:found] for array in kept))

    def renumber(self, now: Array) -> None:
        """The particles are now at `now` (n,), or no more (-1)."""
        if self._holder is not None:
            self._owner = np.where(self._owner >= 0, now[self._owner], -1).astype(np.int32)  # some may be no more already
        low, high = now[self._kept.low].astype(np.int32), now[self._kept.high].astype(np.int32)
        alive = (low >= 0) & (high >= 0)
        self._kept = Kept(low[alive], high[alive], self._kept.slip[alive])

    def save(self) -> Kept:
        """What `restore` needs."""
        return self._kept if self._holder is None else self._taken(self._holder)

    def restore(self, saved: Kept) -> None:
        """Back to what was saved; what the list holds no longer counts."""
        self._holder, self._kept = None, saved
