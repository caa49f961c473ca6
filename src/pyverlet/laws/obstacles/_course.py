"""The obstacles of one world as arrays, and what lies near them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.core import unit
from pyverlet.ground.constants import OBSTACLE_LINKS
from pyverlet.ground.errors import InputError
from pyverlet.laws.obstacles._base import Obstacles
from pyverlet.laws.obstacles._tables import Tables
from pyverlet.state.seam import NONE, Seam
from pyverlet.state.state import EVERYONE

Array = NDArray[Any]

_STANDING = 13
"""Numbers of a segment in `core.obstacle_queries`."""

_TOO_FAR = 2.0**48
"""Cells from the origin to where a segment may stand: beyond, numbers do not tell neighbouring cells apart."""


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

    For questions they stand in a grid, which is made when somebody asks and they are no longer where they were.
    """

    def __init__(self, obstacles: Obstacles, seam: Seam = NONE) -> None:
        super().__init__(obstacles, seam)
        self._frames = 0  # in which any has moved
        self._placed: Any = None  # what the grid is about
        self._within = 0.0  # m from a segment up to which its cells reach
        self._cell = 1.0
        self._standing = np.zeros((0, _STANDING))
        self._heads, self._links = np.full(1, -1, np.int32), np.zeros((0, 2), np.int32)

    def covering(self, position: Array, category: ArrayLike = 1, mask: ArrayLike = EVERYONE) -> NDArray[np.int64]:
        """(n,) which obstacle has each of these (n, 2) points inside it, m, -1 for none.

        Only those that particles of this category and mask, (n,) or one for all, collide with and cannot pass.
        """
        by = np.full(len(position), -1)
        self.begin()
        if self._seen:
            self._place(0.0, 0.0)
            where = self.seam.wrapped(np.ascontiguousarray(position, np.float64))
            filters = _bits(category, len(where)), _bits(mask, len(where))
            _tools().covered_by(self._standing, self._cell, self._heads, self._links, where, *filters, by)
            by[by >= 0] %= len(self._seen)
        return by

    def facing(
        self, position: Array, beyond: Array | float = 0.0, *, within: float = 0.0, ahead: float = 0.0,
        marks: tuple[ArrayLike, ArrayLike] | None = None,
    ) -> Facing:  # fmt: skip
        """Of each of these points (n, 2) the nearest obstacle, and those up to `beyond` m, (n,), farther away.

        Who is inside a polygon is as far from it as from its rim.

        Args:
            position: m.
            beyond: m.
            within: m; who is farther from all is compared with each, which takes longer.
            ahead: s since obstacles were where the world has them, as at the end of a frame that is not accepted yet.
            marks: category and mask, (n,) or one for all: only what particles with these collide with. None: all, sensors too.
        """
        row, body, gap, normal = (np.empty(0, kind) for kind in (np.int64, np.int64, float, float))
        found, where = len(position), np.ascontiguousarray(position, np.float64)
        extra = np.broadcast_to(np.asarray(beyond, float), len(position)).copy()
        filters = [_bits(each, found if marks else 0) for each in marks or (0, 0)]
        while found > len(row) and self._seen:
            self._place(ahead, within)
            row, body, gap = np.empty(2 * found, np.int64), np.empty(2 * found, np.int64), np.empty(2 * found)
            normal = np.empty((2 * found, 2))
            grid = self._within, self._cell, self._heads, self._links
            answer = row, body, gap, normal
            found = _tools().nearest_bodies(self._standing, len(self._seen), *grid, where, extra, *filters, *answer)
        order = np.lexsort((body[:found], row[:found])) if len(row) else np.zeros(0, np.int64)
        return Facing(row[order], body[order], gap[order], normal[order] if len(row) else np.zeros((0, 2)))

    def standing(self, within: float) -> tuple[Any, ...] | None:
        """Segments, their grid, which reaches `within` m about them, and how many obstacles they are of; None without any."""
        self.begin()
        if not self._seen:
            return None
        self._place(0.0, within)
        return self._standing, self._cell, self._heads, self._links, len(self._seen)

    def at(self, position: Array, radius: Array) -> NDArray[np.int64]:
        """(k, 2) rows of circle and obstacle that touch, ascending; position (n, 2) and radius (n,), m, of the circles."""
        grid, where = self.standing(1.01 * float(radius.max(initial=0.0))), self.seam.wrapped(position)
        row, body, found = np.empty(0, np.int64), np.empty(0, np.int64), len(position) if grid else 0
        while found > len(row) and grid:
            row, body = np.empty(2 * found, np.int64), np.empty(2 * found, np.int64)
            found = _tools().bodies_at(grid[0], grid[4], *grid[1:4], where, radius, row, body)
        return np.unique(np.column_stack((row[:found], body[:found])), axis=0)

    def _place(self, ahead: float, within: float) -> None:
        """Have the grid be about where obstacles are in `ahead` seconds."""
        placed = self.version, self.seam, self._frames, ahead if len(self._moving) else 0.0
        if placed != self._placed or within > self._within:
            self._standing = self._stand(ahead)
            self._make_grid(max(within, self._within))
            self._placed = placed

    def _stand(self, ahead: float) -> Array:
        """Segments as `core.obstacle_queries` has them, `ahead` seconds from now."""
        s, standing = self._segments, np.empty((len(self._segments), _STANDING))
        x, y, angle, vx, vy, spin = self.bodies[s["body"]].T
        with np.errstate(over="ignore", invalid="ignore"):
            c, d = np.cos(angle + ahead * spin), np.sin(angle + ahead * spin)
            columns = (
                x + ahead * vx + c * s["lx"] - d * s["ly"], y + ahead * vy + d * s["lx"] + c * s["ly"],
                c * s["lc"] - d * s["ls"], d * s["lc"] + c * s["ls"],
            )  # fmt: skip
        names = ("length", "rounding", "inner", "body", "first", "faces")
        solid = s["sensor"] == 0
        filters = solid * s["category"], solid * s["mask"], (s["way_x"] != 0) | (s["way_y"] != 0)
        for k, column in enumerate((*columns, *(s[name] for name in names), *filters)):
            standing[:, k] = column
        return standing

    def _make_grid(self, within: float) -> None:
        """List segments in the cells near them, so that nobody looks at the others."""
        x, y, _, _, length, rounding, inner = self._standing.T[:7]
        around = rounding + inner
        with np.errstate(over="ignore", invalid="ignore"):
            farthest = np.maximum(np.abs(x), np.abs(y)) + length + around
        if not np.isfinite(farthest).all():
            number = int(self._standing[np.nan_to_num(farthest, nan=np.inf).argmax(), 7]) % len(self._seen)
            raise InputError(
                f"obstacles[{number}] is farther away than numbers reach; allowed are speeds that keep it at a place"
            )
        cell = max(within, float(np.median(around + length)), float(farthest.max()) / _TOO_FAR, float(np.finfo(float).tiny))
        while True:
            across = 2 * (around / cell + 1) + 3
            room = int((length / cell * 2 * across + across * across).sum())
            if room <= OBSTACLE_LINKS + 64 * len(length):
                break
            cell *= 2
        self._cell = self._within = cell
        self._heads, used = np.full(1 << max(room.bit_length(), 6), -1, np.int32), -1
        while used < 0:
            if len(self._links) < room:
                self._links = np.empty((room, 2), np.int32)
            used = _tools().list_segments(self._standing, self._within, cell, self._heads, self._links)
            room *= 2

    def end(self, dt: float) -> None:
        """At the end of a frame that went well: the obstacles are where they moved to."""
        if not len(self._moving):
            return
        self._frames += 1
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


def _bits(value: ArrayLike, count: int) -> NDArray[np.uint32]:
    """(count,) as kernels take them."""
    return np.ascontiguousarray(np.broadcast_to(np.asarray(value, np.uint32), (count,)))


def _tools() -> Any:
    return unit("tools", np.float64)
