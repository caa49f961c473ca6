"""Nested grids over all particles, what stands in their cells, and how far the particles have moved against each other since."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground import memory
from pyverlet.ground.constants import (
    BLOCK_ROWS,
    CELLS_PER_PARTICLE,
    COLUMNS,
    GRID_SPREAD,
    LEVELS,
    ROUNDING,
    SPARSE,
    STRIP_PARTICLES,
    STRIPS,
)
from pyverlet.kernels import grid
from pyverlet.laws.contacts.crowd import Crowd

Array = NDArray[Any]

_ROUNDED = 1e-3
"""Rows by which kernels may see the seam lower than it is."""


class Grids:
    """Circles of these radii (n,) at these positions (n, 2), sorted by cell.

    Any two whose rims are nearer than `skin` stand in neighbouring cells of the level of the larger one.

    Args:
        worn: grids that nobody needs any more: their memory is taken over.
        crowd: whose these are; None: all are circles of their own.

    Attributes:
        levels: the grids, as kernels take them.
        start: (cells + 2,) circles in all cells before each, and all of them.
        order: (n,) the row of `position` of each circle, in the order of the cells.
        falls: how often `order` falls: 0 if the positions are in that order already, n / 2 if they are in none.
    """

    def __init__(
        self, position: Array, radius: Array, skin: float, worn: Grids | None = None, crowd: Crowd | None = None
    ) -> None:
        self.levels = _fit(position, radius, skin)
        cells, count = int((self.levels.width * self.levels.height).sum()), len(position)
        # Of a million circles these are 24 MB, and the system takes as long to give them anew as they take to be filled.
        none = np.empty(0, np.int32)
        old = (worn._start, worn._cell, worn._order, worn._sorted) if worn else (none, none, none, none)
        self._start: Array = memory.room(old[0], cells + 2)
        self._cell: Array = memory.room(old[1], count)
        self._order: Array = memory.room(old[2], count)
        self._sorted: Array = old[3]
        self.start, self.order = self._start[: cells + 2], self._order[:count]
        grid.count_level_cells(position, radius, self.levels, self._cell[:count], self.start)
        self.falls = int(grid.sort_by_cell(self._cell[:count], self.start, self.order))
        self._first: Any = None
        self._above, self._known = (crowd.above, crowd.known) if crowd else (np.inf, np.inf)
        if crowd and crowd.copies:
            self.falls = int(np.count_nonzero(np.diff(crowd.originals(self.order)) < 0))

    def renumber(self) -> None:
        """The rows of `position` are in the order of the cells now."""
        if len(self._sorted) != len(self.order):
            self._sorted = np.arange(len(self.order), dtype=np.int32)
        self.order, self.falls = self._sorted, 0

    def strips(self) -> tuple[Array, Array]:
        """(strips + 1,) first row of each strip, and how many circles stand in all before it."""
        row, held = np.empty(STRIPS + 1, np.int64), np.empty(STRIPS + 1, np.int64)
        strips = grid.cut_strips(self.levels, self.start, max(len(self.order) // STRIPS, STRIP_PARTICLES), row, held)
        row, held = row[: strips + 1], held[: strips + 1]
        if self._above < np.inf:
            # Across the seam the last strip writes to the first: it has all rows near the seam, and is an odd one or the only.
            top = (self._above - float(self.levels.y0)) * float(self.levels.along[0])
            kept = np.flatnonzero(row[:-1] <= max(top - 1.0 - _ROUNDED, 0.0))
            kept = kept[: len(kept) - len(kept) % 2] if len(kept) > 1 else kept
            row, held = np.append(row[kept], row[-1]), np.append(held[kept], held[-1])
        return row, held

    def slack(self, position: Array, built: Array, skin: float) -> float:
        """How much nearer any pair that was farther apart than `skin` may still come before it can touch, m; negative: too near.

        For displacements u_i, | |x_i - x_j| - |b_i - b_j| | <= |u_i - u_j|: all that counts is how differently two circles have
        moved that were near each other, and that is no more than the diagonal of the box of all displacements around them.
        Circles in blocks that are not neighbours have more than a block between them.
        """
        if self._first is None:
            count = [columns * rows for columns, rows in (grid.blocks(self.levels, k) for k in range(len(self.levels.base)))]
            self._first = np.cumsum(count) - count
            self._own = np.empty((sum(count), 4), position.dtype)
            self._smaller = np.empty_like(self._own)
            self._gap = min(float((BLOCK_ROWS / self.levels.along - 2 * self.levels.largest).min()), self._known)
        boxes = (self._first, self._own, self._smaller)
        grid.bound_displacements(position, built, self.order, self.levels, self.start, *boxes)
        near, far = grid.spreads(self.levels, *boxes)
        return min(skin - float(near), self._gap - float(far))


def _fit(position: Array, radius: Array, skin: float) -> grid.Levels:
    """Levels over all particles; over the bulk of them if a few are so far away that the cells would be too many."""
    real = position.dtype.type
    smallest, largest = float(radius.min()), float(radius.max())
    x0, y0, x1, y1 = map(float, grid.extent(position))
    most = CELLS_PER_PARTICLE * len(position) + 64
    cell = (2.0 * largest + skin) * ROUNDING

    def cells(cell: float, shift: int = 0) -> int:
        return ((int((x1 - x0) / cell) + 1) << shift) * ((int((y1 - y0) / cell) + 1) << shift) * COLUMNS

    def fits(shift: int) -> float:
        return min((cell / 2.0**shift / ROUNDING - skin) / 2.0, largest)

    if cells(cell) > most:
        mean, spread = position.mean(axis=0, dtype=np.float64), position.std(axis=0, dtype=np.float64) * GRID_SPREAD
        if np.isfinite(spread).all():
            (x0, y0), (x1, y1) = np.maximum(mean - spread, (x0, y0)), np.minimum(mean + spread, (x1, y1))
    while cells(cell) > most:
        cell *= 1.5
    shifts, total = [0], cells(cell)
    while len(shifts) < LEVELS and smallest <= fits(len(shifts)) and (total := total + cells(cell, len(shifts))) <= most:
        shifts.append(len(shifts))
    if len(shifts) > 1:
        held = np.empty(len(shifts), np.int64)
        grid.count_levels(radius, np.array([fits(k) for k in shifts], position.dtype), held)
        shifts = _worth(held)
    shift = np.array(shifts)
    width, height = (int((x1 - x0) / cell) + 1) * COLUMNS << shift, int((y1 - y0) / cell) + 1 << shift
    base = np.cumsum(width * height) - width * height
    along = (2.0**shift / cell).astype(position.dtype)
    fitting = np.array([fits(k) for k in shifts], position.dtype)
    return grid.Levels(real(x0), real(y0), fitting, base, width, height, shift, along * real(COLUMNS), along)


def _worth(held: Array) -> list[int]:
    """Which levels are worth having, given how many circles each holds: a few stand as well among those twice as large."""
    kept = [0]
    for level in np.flatnonzero(held[1:]) + 1:
        if kept[-1] == level - 1 and held[level] < SPARSE * held[level - 1]:
            continue
        kept.append(int(level))
    return kept
