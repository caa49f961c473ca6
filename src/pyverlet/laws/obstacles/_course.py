"""The obstacles of one world as arrays, and what lies near them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.core import unit
from pyverlet.ground.arrays import Array
from pyverlet.ground.constants import OBSTACLE_LINKS
from pyverlet.ground.errors import InputError
from pyverlet.laws.obstacles import columns as at
from pyverlet.laws.obstacles._base import Obstacles
from pyverlet.laws.obstacles._tables import Tables
from pyverlet.state.seam import NONE, Seam
from pyverlet.state.state import EVERYONE

_STANDING = 12
"""Numbers of a segment in `core.obstacle_queries`."""

_TOO_FAR = 2.0**48
"""Cells from the origin to where a segment may stand: beyond, numbers do not tell neighbouring cells apart."""


class Near(NamedTuple):
    """Points and obstacles near them, sorted by both."""

    row: NDArray[np.int64]
    """(k,) which of the points."""
    obstacle: NDArray[np.int64]
    """(k,) index in the list."""
    gap: NDArray[np.float64]
    """(k,) distance of the point from its surface, m; -inf in a polygon."""


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
        self._extent: Array | None = None  # of these, m: lowest x and y, highest x and y
        self._heads, self._links = np.full(1, -1, np.int32), np.zeros((0, 2), np.int32)

    def covering(self, position: Array, category: ArrayLike = 1, mask: ArrayLike = EVERYONE) -> NDArray[np.int64]:
        """(n,) which obstacle has each of these (n, 2) points inside it, m, -1 for none.

        Only those that particles of this category and mask, (n,) or one for all, collide with and cannot pass.
        """
        found, s = self.near(position, 0.0, category, mask), self.segments
        solid = ~np.isin(found.obstacle, s[(s[:, at.WAY] != 0).any(axis=1), at.OF])
        inside, by = np.flatnonzero((found.gap < 0) & solid)[::-1], np.full(len(position), -1)
        by[found.row[inside]] = found.obstacle[inside]  # of several the first
        return by

    def near(self, position: Array, radius: Array | float, category: ArrayLike, mask: ArrayLike) -> Near:
        """The obstacles that circles about these points (n, 2) touch.

        radius: (n,) or one for all, m; category, mask: (n,) or one for all, of the circles.
        """
        self.begin()
        count, room, found = len(position), 64 + len(position) // 4, 0
        answer: list[Array] = [np.empty(room, np.int64), np.empty(room, np.int64), np.empty(room)]
        if self.seen and count:
            points = self.seam.wrapped(np.ascontiguousarray(position, np.float64))
            limit = np.broadcast_to(np.asarray(radius, float), count).copy()
            self._place(0.0, 1.01 * float(limit.max()))
            about = self._standing, len(self.seen), self._cell, self._heads, self._links, points, limit
            marks = [np.broadcast_to(np.asarray(each, np.uint32), count).copy() for each in (category, mask)]
            while (found := _tools().bodies_near(*about, *marks, *answer)) > len(answer[0]):
                answer = [np.empty(found, column.dtype) for column in answer]
        order = np.lexsort((answer[1][:found], answer[0][:found]))
        return Near(*(column[order] for column in answer))

    def facing(self, position: Array, obstacle: Array, *, within: float = 0.0, ahead: float = 0.0) -> tuple[Array, Array]:
        """(n,) m, the distance of each of these points (n, 2) from the rim of an obstacle, (n,), and (n, 2) the normal out of it.

        NaN where there is no such obstacle.

        Args:
            position: m.
            obstacle: index in the list.
            within: m, about as far as they are; looking farther takes longer.
            ahead: s since obstacles were where the world has them, as at the end of a frame that is not accepted yet.
        """
        gap, normal = np.full(len(position), np.inf), np.full((len(position), 2), np.nan)
        if self.seen and len(position):
            self._place(ahead, within)
            about = self._standing, len(self.seen), self._within, self._cell, self._heads, self._links
            points, which = np.ascontiguousarray(position, np.float64), np.ascontiguousarray(obstacle, np.int64)
            _tools().gaps_to(*about, points, which, gap, normal)
        return np.where(np.isinf(gap), np.nan, gap), normal

    def standing(self, within: float) -> tuple[Any, ...] | None:
        """Segments, their grid, which reaches `within` m about them, its extent, and how many obstacles; None without any."""
        self.begin()
        if not self.seen:
            return None
        self._place(0.0, within)
        if self._extent is None:
            start, along, length, rounding = np.hsplit(self._standing[:, :6], (2, 4, 5))
            ends = np.stack((start, start + length * along))
            self._extent = np.concatenate(((ends - rounding).min(axis=(0, 1)), (ends + rounding).max(axis=(0, 1))))
        return self._standing, self._cell, self._heads, self._links, self._extent, len(self.seen)

    def _place(self, ahead: float, within: float) -> None:
        """Have the grid be about where obstacles are in `ahead` seconds."""
        placed = self.version, self.seam, self._frames, ahead if len(self._moving) else 0.0
        if placed != self._placed or within > self._within:
            self._standing, self._extent = self._stand(ahead), None
            self._make_grid(max(within, self._within))
            self._placed = placed

    def _stand(self, ahead: float) -> Array:
        """Segments as `core.obstacle_queries` has them, `ahead` seconds from now."""
        s = self.segments
        x, y, angle, vx, vy, spin = self.bodies[s[:, at.OF].astype(np.int64)].T
        (lx, ly), (lc, ls), solid = s[:, at.START].T, s[:, at.ALONG].T, s[:, [at.SENSOR]] == 0
        with np.errstate(over="ignore", invalid="ignore"):
            c, d = np.cos(angle + ahead * spin), np.sin(angle + ahead * spin)
            place = x + ahead * vx + c * lx - d * ly, y + ahead * vy + d * lx + c * ly, c * lc - d * ls, d * lc + c * ls
        parts = s[:, [at.LENGTH, at.ROUNDING, at.INNER, at.OF, at.FIRST, at.FACES]], solid * s[:, at.CATEGORY : at.MASK + 1]
        return np.ascontiguousarray(np.column_stack((*place, *parts)))

    def _make_grid(self, within: float) -> None:
        """List segments in the cells near them, so that nobody looks at the others."""
        x, y, _, _, length, rounding, inner = self._standing.T[:7]
        around = rounding + inner
        with np.errstate(over="ignore", invalid="ignore"):
            farthest = np.maximum(np.abs(x), np.abs(y)) + length + around
        if not np.isfinite(farthest).all():
            number = int(self._standing[np.nan_to_num(farthest, nan=np.inf).argmax(), 7]) % len(self.seen)
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
        bodies, count = self._own_bodies, len(self._own_bodies)
        bodies[self._moving, at.X : at.VX] += dt * bodies[self._moving, at.VX :]
        place, angles = self.seam.wrapped(bodies[self._moving, : at.ANGLE]), bodies[self._moving, at.ANGLE]
        bodies[self._moving, : at.ANGLE] = place
        for image, shift in enumerate(self.seam.images() if self.seam else ()):
            self.bodies[image * count + self._moving, : at.VX] = np.column_stack((place + shift, angles))
        for k, (x, y), angle in zip(self._moving.tolist(), place.tolist(), angles.tolist(), strict=True):
            self.seen[k].carry((x, y), angle)


def _tools() -> Any:
    return unit("tools", np.float64)
