"""The obstacles of one world as arrays, and the stage of a substep in which particles meet them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.constants import OBSTACLE_LINKS
from pyverlet.ground.errors import InputError
from pyverlet.kernels import obstacles as kernels
from pyverlet.laws.obstacles._base import Obstacles
from pyverlet.laws.obstacles._tables import Tables
from pyverlet.state.seam import NONE, Seam
from pyverlet.state.slots import Slots

Array = NDArray[Any]

_NO_CELLS = np.inf, np.inf, -np.inf, -np.inf, 1.0
_NOWHERE = np.full(1, -1, np.int32), np.zeros((0, 2), np.int32), np.zeros(7)


class Facing(NamedTuple):
    """Points and obstacles near them, sorted by both."""

    row: NDArray[np.int64]
    """(k,) which of the points."""
    obstacle: NDArray[np.int64]
    """(k,) index in the list."""
    gap: NDArray[np.float64]
    """(k,) distance of the point from its surface, m."""
    normal: NDArray[np.float64]
    """(k, 2) out of it."""


class Course(Tables):
    """Where the obstacles of a world are, and which are near; the obstacles themselves are the truth between frames.

    They live in a grid, which changes where an obstacle comes, changes or moves: those that stand still cost a frame nothing.
    """

    def __init__(self, obstacles: Obstacles, seam: Seam = NONE) -> None:
        super().__init__(obstacles, seam)
        self._reach = 0.0  # largest radius the grid was made for
        self._measured: tuple[Slots, int] | None = None  # of what radii `_largest` is the largest
        self._largest = 0.0
        self._cell, self._used, self._box = 1.0, 0, np.array(_NO_CELLS[:4])
        self._heads, self._links = _NOWHERE[:2]
        self._order: Array | None = None
        self._cells: tuple[Any, ...] = _NO_CELLS
        self._rest = self._along = np.empty((0, 2))  # what rounding has taken from places in the substep before; `Slots.along`

    def covering(self, position: Array) -> NDArray[np.int64]:
        """(n,) which obstacle has each of these (n, 2) points inside it, m, -1 for none."""
        by = np.full(len(position), -1)
        self.begin()
        if self._seen:
            self._place(0.0, 0.0)
            grid = self._cell, self._heads, self._links
            kernels.covered(self._segments, *grid, self.seam.wrapped(position.astype(np.float64)), by)
            by[by >= 0] %= len(self._seen)
        return by

    def facing(self, position: Array, beyond: Array | float = 0.0) -> Facing:
        """Of each of these points (n, 2) the nearest obstacle, and those up to `beyond` m, (n,), farther away.

        As they stood last; who is inside a polygon is as far from it as from its rim.
        """
        row, body, gap, normal = (np.empty(0, kind) for kind in (np.int64, np.int64, float, float))
        found, grid, reach = len(position), (self._cell, self._heads, self._links), self._reach + 0.5 * self._cell
        extra = np.broadcast_to(np.asarray(beyond, float), len(position)).copy()
        while found > len(row) and self._seen:
            row, body, gap = np.empty(2 * found, np.int64), np.empty(2 * found, np.int64), np.empty(2 * found)
            normal = np.empty((2 * found, 2))
            about = position.astype(np.float64), extra, row, body, gap, normal
            found = int(kernels.facing(self._segments, len(self._seen), reach, *grid, *about))
        order = np.lexsort((body[:found], row[:found])) if len(row) else np.zeros(0, np.int64)
        return Facing(row[order], body[order], gap[order], normal[order] if len(row) else np.zeros((0, 2)))

    def _place(self, time: float, h: float) -> None:
        """Place those that move or have changed, and list them in the grid where they are now."""
        if self._renumbered or not 0.5 * self._reach <= self._largest <= self._reach:
            self._make_grid(time, h)
        elif self._changed or len(self._moving):
            which = self._moving
            if self._changed:
                which, self._changed = np.array(sorted(self._moves | self._changed), np.int64), set()
            if not self._update(which, time, h):
                self._make_grid(time, h)

    def _update(self, which: Array, time: float, h: float) -> bool:
        """Place these and list them; False if the grid is too small."""
        images = len(self._bodies) // len(self._own_bodies.rows)
        reach = self._reach + 0.5 * self._cell  # half a cell, for the middle of a piece of the way stands for all of it
        about = which, images, time, h, reach, self._cell, self._box, self._heads, self._links, self._used
        self._used = int(kernels.update(self._segments, self._bodies, self._first, *about))
        self._cells = (*self._box.tolist(), float(self._cell))
        return self._used != kernels.NO_ROOM

    @np.errstate(over="ignore", invalid="ignore")
    def _make_grid(self, time: float, h: float) -> None:
        """List all segments in the cells near them, so that nobody looks at the others."""
        kernels.place(self._segments, self._bodies, time, h)
        s, self._reach, self._changed, self._renumbered = self._segments, self._largest, set(), False
        wide, high = np.abs(s["bc"] * s["length"]), np.abs(s["bs"] * s["length"])
        around = s["rounding"] + s["inner"] + s["sweep"] + self._largest
        farthest = np.maximum(np.abs(s["bx"]), np.abs(s["by"])) + wide + high + around
        if not np.isfinite(farthest).all():
            number = int(s["body"][np.nan_to_num(farthest, nan=np.inf).argmax()]) % len(self._seen)
            raise InputError(
                f"obstacles[{number}] is farther away than numbers reach; allowed are speeds that keep it at a place"
            )
        # As wide as the largest particle, for coarser cells hold segments out of reach; wider where links would be too many.
        cell = max(2 * self._largest, float(farthest.max()) / kernels.FARTHEST * 4, np.finfo(float).tiny)
        if self._largest == 0.0:
            cell = max(cell, float(np.median(around)))
        while True:
            across = 2 * around / cell + 3.0
            links = float(((wide + high) / cell * across + across * across).sum())
            if links <= OBSTACLE_LINKS + 64 * len(s):
                break
            cell *= 2
        room, self._cell = int(2 * links), cell
        while True:
            self._heads = np.full(1 << max(int(links).bit_length(), 6), -1, np.int32)
            if len(self._links) < room:
                self._links = np.empty((room, 2), np.int32)
            s["kept_x"], self._box, self._used = np.nan, np.array(_NO_CELLS[:4]), 0
            if self._update(np.arange(len(self._own_bodies.rows)), time, h):
                return
            room = 2 * len(self._links)

    def end(self, dt: float) -> None:
        """At the end of a frame that went well: the obstacles are where they moved to."""
        if not len(self._moving):
            return
        bodies, count = self._own_bodies.rows, len(self._own_bodies.rows)
        for name, speed in (("x", "vx"), ("y", "vy"), ("angle", "spin")):
            bodies[name][self._moving] += dt * bodies[speed][self._moving]
        place = self.seam.wrapped(np.column_stack((bodies["x"][self._moving], bodies["y"][self._moving])))
        bodies["x"][self._moving], bodies["y"][self._moving] = place.T
        for image, shift in enumerate(self.seam.images() if self.seam else ()):
            rows = image * count + self._moving
            self._bodies["x"][rows], self._bodies["y"][rows] = (place + shift).T
            self._bodies["angle"][rows] = bodies["angle"][self._moving]
        angles = bodies["angle"][self._moving].tolist()
        for k, (x, y), angle in zip(self._moving.tolist(), place.tolist(), angles, strict=True):
            self._seen[k].carry((x, y), angle)
