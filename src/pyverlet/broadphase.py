"""Broad phases keep a list of the pairs that may touch. `Fast` is the default, `BruteForce` the readable reference."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet import checks
from pyverlet.constants import (
    CELLS_PER_PARTICLE,
    COLOUR_SLOTS,
    GRID_SPREAD,
    LIST_OLD,
    LIST_YOUNG,
    SKIN,
    SKIN_LEAST,
    SKIN_MOST,
    STRIP_PARTICLES,
    STRIPS,
)
from pyverlet.kernels import grid
from pyverlet.state import Slots, farthest

Array = NDArray[Any]


class PairList:
    """Candidate pairs by strip: slots pair_i[k], pair_j[k] for k in first[s] to first[s] + count[s].

    `meeting`, `touching` and `impulse` are where the contact solver notes, by strip too, how each stands, which of them touch and
    how hard; `spent` (strips, 2) what energy impacts and friction have taken, J. `closing` is where events are noted, and empty
    unless somebody listens to them. `slip`, `slipped` and `held` are for friction, and empty without: how far a pair has slipped,
    m, and by touching pair how far it had before this substep, and the impulse that answered it, N s.
    """

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.listening = False
        self.first = np.zeros(0, np.int64)
        self.count = np.zeros(0, np.int64)
        self.touches = np.zeros(0, np.int64)
        self.spent = np.zeros((0, 2))
        self.slip = self.slipped = self.held = np.empty(0, dtype)
        self.make_room(0)

    def make_room(self, pairs: int) -> None:
        """Room for at least this many pairs."""
        self.pair_i = np.empty(pairs, np.uint32)
        self.pair_j = np.empty(pairs, np.uint32)
        self.meeting = np.empty(pairs, np.uint8)
        self.touching = np.empty(pairs, np.uint32)
        self.impulse = np.empty(pairs, self._dtype)
        self.closing = np.full(pairs if self.listening else 0, -1, self._dtype)

    def listen(self) -> None:
        """Note events from now on."""
        self.listening = True
        self.closing = np.full(len(self.pair_i), -1, self._dtype)

    def hold_slips(self) -> None:
        """Room for what friction notes; the values are anything."""
        if len(self.slip) != len(self.pair_i):
            self.slip, self.slipped, self.held = (np.empty(len(self.pair_i), self._dtype) for _ in range(3))

    def set_strips(self, strips: int) -> None:
        """Begin a new list of this many strips."""
        self.first, self.count, self.touches = (np.zeros(strips, np.int64) for _ in range(3))
        spent = self.spent.sum(axis=0)
        self.spent = np.zeros((strips, 2))
        self.spent[0] = spent

    def pairs(self) -> Array:
        """(k, 2) slots of all candidate pairs; a copy, for tests and measurements."""
        parts = [slice(a, a + n) for a, n in zip(self.first, self.count, strict=True)]
        rows = [np.column_stack((self.pair_i[part], self.pair_j[part])) for part in parts]
        return np.concatenate([np.empty((0, 2), np.uint32), *rows]).astype(np.int64)


class BroadPhase(ABC):
    """Keeps `list` good for the current positions."""

    list: PairList
    rebuilds: int = 0
    renewing: Callable[[Slots, PairList], None] | None = None
    """Called when the list is about to be made anew."""
    replacing: Callable[[PairList], None] | None = None
    """The same, but also when the list was no longer valid: slots may hold other particles by now."""

    @abstractmethod
    def update(self, state: Slots) -> None:
        """Make the list good again if anyone may have moved too far since it was built. May reorder the slots."""

    @abstractmethod
    def forget(self) -> None:
        """The list is no longer valid (particles, radii or masses changed)."""

    def save(self) -> Any:
        """What `restore` needs to bring the same list back."""
        return None

    def restore(self, saved: Any, state: Slots) -> None:
        """Bring back the list of the time of `save`; `state` already has the order and radii of then."""
        self.forget()


@dataclass(frozen=True)
class BruteForce:
    """All pairs against all, every substep: O(n^2). The reference the fast way is tested against; natural order, one thread."""

    def start(self, dtype: np.dtype[Any]) -> BroadPhase:
        """The working part of one world."""
        return _AllPairs(dtype)


class _AllPairs(BroadPhase):
    def __init__(self, dtype: np.dtype[Any]) -> None:
        self.list = PairList(dtype)

    def update(self, state: Slots) -> None:
        if self.replacing:
            self.replacing(self.list)
        if self.renewing:
            self.renewing(state, self.list)
        found = self._fill(state)
        if found > len(self.list.pair_i):
            self.list.make_room(2 * found)
            self._fill(state)
        self.rebuilds += 1

    def _fill(self, state: Slots) -> int:
        pairs = self.list
        found = int(
            grid.list_all_pairs(
                state.position, state.radius, state.inverse_mass, state.category, state.mask, pairs.pair_i, pairs.pair_j
            )
        )
        pairs.set_strips(1)
        pairs.count[0] = found
        return found

    def forget(self) -> None:
        pass


@dataclass(frozen=True)
class Fast:
    """Sorted cells, coloured pairs in strips, kept until somebody has moved half the skin (Verlet 1967).

    Args:
        skin: extra distance, in mean diameters, within which pairs are listed. None adapts it to the motion.
    """

    skin: float | None = None

    def __post_init__(self) -> None:
        if self.skin is not None:
            checks.number("skin", self.skin, least=0.0)

    def start(self, dtype: np.dtype[Any]) -> BroadPhase:
        """The working part of one world."""
        return _SortedCells(dtype, self.skin)


@dataclass
class _Layout:
    """A grid of `rows` x `columns` square cells of side `cell`, its corner at (x0, y0)."""

    x0: float
    y0: float
    cell: float
    columns: int
    rows: int

    @classmethod
    def fit(cls, position: Array, cell: float) -> _Layout:
        """The grid over all particles; over the bulk of them if a few are so far away that it would grow too large."""
        x0, y0, x1, y1 = map(float, grid.extent(position))
        most = CELLS_PER_PARTICLE * len(position) + 64
        layout = cls._over(x0, y0, x1, y1, cell)
        if layout.columns * layout.rows > most:
            mean, spread = position.mean(axis=0, dtype=np.float64), position.std(axis=0, dtype=np.float64) * GRID_SPREAD
            if np.isfinite(spread).all():
                (x0, y0), (x1, y1) = np.maximum(mean - spread, (x0, y0)), np.minimum(mean + spread, (x1, y1))
            layout = cls._over(x0, y0, x1, y1, cell)
        while layout.columns * layout.rows > most:
            cell *= 1.5
            layout = cls._over(x0, y0, x1, y1, cell)
        return layout

    @classmethod
    def _over(cls, x0: float, y0: float, x1: float, y1: float, cell: float) -> _Layout:
        return cls(x0, y0, cell, int((x1 - x0) / cell) + 1, int((y1 - y0) / cell) + 1)


class _SortedCells(BroadPhase):
    def __init__(self, dtype: np.dtype[Any], skin: float | None) -> None:
        self.list = PairList(dtype)
        self.skin_diameters = SKIN if skin is None else skin
        self._adapts = skin is None
        self._room = 4  # pairs kept free for each particle; six neighbours make three pairs
        self._age = 0
        self._allowed = -1.0  # distance anyone may move before the list is rebuilt, m; negative: rebuild now
        self.built = np.empty((0, 2), dtype)
        self._reserve(0)

    def update(self, state: Slots) -> None:
        self._age += 1
        if self._allowed >= 0:
            if farthest(state.position, self.built) <= self._allowed:
                return
            if self._adapts:
                self._adapt()
            if self.renewing:
                self.renewing(state, self.list)
        self.rebuild(state)

    def forget(self) -> None:
        self._allowed = -1.0

    def save(self) -> tuple[Array | None, float, int]:
        return (self.built.copy() if self._allowed >= 0 else None, self.skin_diameters, self._age)

    def restore(self, saved: tuple[Array | None, float, int], state: Slots) -> None:
        self.forget()
        built, self.skin_diameters, age = saved
        if built is not None and len(built) == len(state):  # or particles had been added that it had not met yet
            # The list is a function of the positions it was built from, and sorting what is sorted changes nothing.
            state.position[:] = built
            self.rebuild(state)
        self._age = age

    def _adapt(self) -> None:
        if self._age <= LIST_YOUNG:
            self.skin_diameters = min(self.skin_diameters * 1.25, SKIN_MOST)
        elif self._age > LIST_OLD:
            self.skin_diameters = max(self.skin_diameters * 0.9, SKIN_LEAST)

    def rebuild(self, state: Slots) -> None:
        """Sort the particles by cell and list the pairs."""
        if self.replacing:
            self.replacing(self.list)
        self.rebuilds += 1
        self._age = 0
        skin = self.skin_diameters * 2.0 * float(state.radius.mean(dtype=np.float64))
        layout = _Layout.fit(state.position, 2.0 * float(state.radius.max()) + skin)
        start = self._sort(state, layout)
        strip_row = np.empty(STRIPS + 1, np.int64)
        least = max(len(state) // STRIPS, STRIP_PARTICLES)
        strips = grid.cut_strips(start, layout.columns, layout.rows, least, strip_row)
        self.list.set_strips(strips)
        self._fill(state, layout, start, strip_row[: strips + 1], state.real(skin))
        self.built = state.position.copy()
        self._allowed = 0.5 * skin

    def _sort(self, state: Slots, layout: _Layout) -> Array:
        real = state.real
        cell = np.empty(len(state), np.int32)
        start = np.empty(layout.columns * layout.rows + 1, np.int64)
        grid.count_cells(
            state.position, real(layout.x0), real(layout.y0), real(1 / layout.cell), layout.columns, layout.rows, cell, start
        )
        order = np.empty(len(state), np.int32)
        grid.sort_by_cell(cell, start, order)
        state.reorder(order)
        return start

    def _fill(self, state: Slots, layout: _Layout, start: Array, strip_row: Array, skin: Any) -> None:
        pairs = self.list
        if len(pairs.pair_i) != self._room * len(state):
            self._reserve(len(state))
        while True:
            grid.list_pairs(
                state.position, state.radius, state.inverse_mass, state.category, state.mask, start, layout.columns,
                layout.rows, strip_row, skin, self._room, COLOUR_SLOTS, self._raw_i, self._raw_j, self._colour,
                pairs.pair_i, pairs.pair_j, pairs.first, pairs.count,
            )  # fmt: skip
            held = np.diff(start[strip_row * layout.columns])
            if (pairs.count <= held * self._room).all():
                return
            self._room = int(np.ceil(1.25 * (pairs.count / np.maximum(held, 1)).max()))
            self._reserve(len(state))

    def _reserve(self, particles: int) -> None:
        pairs = self._room * particles
        self.list.make_room(pairs)
        self._raw_i = np.empty(pairs, np.uint32)
        self._raw_j = np.empty(pairs, np.uint32)
        self._colour = np.empty(pairs, np.uint16)
