"""The obstacles of one world as arrays that follow the world's list, and queries on them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import memory
from pyverlet.common.arrays import Array
from pyverlet.core import unit
from pyverlet.laws.obstacles import rows as at
from pyverlet.laws.obstacles._base import Obstacle, Obstacles, journal
from pyverlet.laws.obstacles._grid import cells_for, check_distance
from pyverlet.state.periodicity import NONE, Periodicity
from pyverlet.state.state import EVERYONE, may_collide

_STANDING, _BODY, _MARKS = 12, 7, slice(10, 12)
"""Columns of a segment in `core.obstacle_queries`: their number, the body, category and mask."""

_TOO_FAR = 2.0**48
"""Largest distance from the origin in cells: beyond, neighbouring cells cannot be distinguished."""


class Near(NamedTuple):
    """Points and obstacles near them, sorted by both."""

    row: NDArray[np.int64]
    """(k,) index of the point."""
    obstacle: NDArray[np.int64]
    """(k,) index in the list of obstacles."""
    gap: NDArray[np.float64]
    """(k,) distance of the point from its surface, m; -inf inside a polygon."""


class ObstacleArrays:
    """Bodies and segments of the obstacles of a world; between frames the obstacle objects themselves are valid.

    Only changes are written. For queries obstacles are listed in a grid, which is made on demand after they have moved.

    Args:
        obstacles: the world's list, whose changes are read at the start of each frame.
        periodic: periodicity of the room.

    Attributes:
        periodic: that of the room. A periodic room is surrounded by images of all obstacles, because circles move beyond it
            within a frame.
        seen: the obstacles of the last frame, as read by `begin`; later ones are added to the same list.
        first: first segment of each, and one more.
        segments: (k, WIDTH) of all of them, those of images last.
        bodies: (n, 6) pivots, m, angles, rad, and their velocities; those of images last.
        version: changes whenever an obstacle is added, removed or changed other than by its own motion.
        solid_version: the same without sensors.
        changes: for each obstacle added or changed since this was set to {}, whether more than its place and motion changed;
            None: the numbering has changed since.
        places: new number, or -1, of each obstacle since this was set to None; None: unchanged.
        moving: whether any moves. Without sensors: drives: whether any moves, or has a moving surface; rough, rolls, one_way:
            whether any has friction, has rolling resistance, is passable in one direction. named: has a material.
        sensors, sensors_move: indices of sensors, and whether any of them moves.
    """

    def __init__(self, obstacles: Obstacles, periodic: Periodicity = NONE) -> None:
        self._obstacles, self.periodic, self.version, self.solid_version = obstacles, periodic, 0, 0
        self.seen: list[Obstacle] = []
        self._listed = self._revision = -1
        self._own_bodies, self._own_segments = np.zeros((0, 6)), np.zeros((0, at.WIDTH))
        self._does = np.zeros(0, np.uint8)  # bits of each, see `doing_of`
        self.first = np.zeros(1, np.int64)
        self._numbers: dict[int, list[int]] | None = {}  # indices of each by its id; several if it is listed twice
        self.changes: dict[int, bool] | None = None
        self.places: Array | None = None
        self._imagine()
        self._sort()
        self._frames = 0  # number of frames in which any has moved
        self._placed: Any = None  # state for which the grid was made
        self._cell = 0.0  # m, of the grid, and its reach from segments
        self._standing = np.zeros((0, _STANDING))
        self._extent: Array | None = None  # bounds of the segments, m: lowest x and y, highest x and y
        self._heads, self._links = np.full(1, -1, np.int32), np.zeros((0, 2), np.int32)

    def __reduce__(self) -> Any:
        """Copies are built anew."""
        return type(self), (self._obstacles, self.periodic)

    def __bool__(self) -> bool:
        return bool(self._obstacles)

    @property
    def solid(self) -> bool:
        """Whether any obstacle is not a sensor."""
        return len(self.sensors) < len(self.seen)

    # ---- the arrays ------------------------------------------------------------------------------------------------------

    def begin(self) -> None:
        """At the start of a frame: read what has changed."""
        fresh: set[int] = set()
        if self._listed != self._obstacles.version or self._imaged != self.periodic:
            fresh = set(map(id, self._take()))
        if self._revision == journal.latest:
            return
        before = self._revision
        self._revision, noted = journal.since(before)
        if which := set(map(id, self.seen)) if noted is None else noted - fresh:
            numbers = self._numbered()
            for k in [k for each in which for k in numbers.get(each, ())]:
                self._refresh(k, resurfaced=self.seen[k].resurfaced > before)

    def number_of(self, obstacle: Any) -> int | None:
        """The first index of an obstacle in the current list, or None."""
        self.begin()
        return self._numbered().get(id(obstacle), (None,))[0]

    def rows_of(self, which: Sequence[int]) -> Array:
        """Row numbers of the segments of these obstacles, those of images last."""
        each = [np.arange(self.first[k], self.first[k + 1]) for k in which] or [self.first[:0]]
        own = each[0] if len(each) == 1 else np.concatenate(each)
        if not self.periodic:
            return own
        sides = len(self._own_segments)
        return (own + sides * np.arange(len(self.segments) // max(sides, 1))[:, None]).ravel()

    def _numbered(self) -> dict[int, list[int]]:
        """The indices of each obstacle by its id."""
        if self._numbers is None:
            self._numbers = {}
            for k, obstacle in enumerate(self.seen):
                self._numbers.setdefault(id(obstacle), []).append(k)
        return self._numbers

    def _take(self) -> list[Obstacle]:
        """Read a changed list; returns the new obstacles."""
        seen, before = self.seen, len(self.seen)
        if self._revision < 0:
            self._revision = journal.latest  # before reading any
        order, fresh = self._order(), self._obstacles[before:]
        self._listed = self._obstacles.version
        if order is not None:
            now: list[Obstacle] = self._obstacles[:]
            new = np.flatnonzero(order < 0)
            order[new], fresh = before + np.arange(len(new)), [now[k] for k in new.tolist()]
            solid, kept = self._does & at.SENSES == 0, order[order < before]
            self.solid_version += not np.array_equal(kept[solid[kept]], np.flatnonzero(solid))
            place = np.full(before, -1)
            place[kept] = np.flatnonzero(order < before)
            self.places = place if self.places is None else np.where(self.places < 0, -1, place[self.places])
        if order is None and not fresh and self._imaged == self.periodic:
            return fresh
        self.solid_version += any(not obstacle.sensor for obstacle in fresh)
        self._append(fresh, before)
        self.version += 1
        if order is None:
            seen.extend(fresh)  # in place, as copying a long list would take the most time
        else:
            self.seen = now
            self._put_in_order(order)
        self._imagine()
        if order is not None or self.periodic:
            self._numbers = self.changes = None
        else:
            for k, obstacle in enumerate(fresh, before):
                if self._numbers is not None:
                    self._numbers.setdefault(id(obstacle), []).append(k)
                if self.changes is not None:
                    self.changes[k] = True
        if order is not None or any(does & (~self._every | at.MOVES | at.SENSES) for does in self._does[before:].tolist()):
            self._sort()
        return fresh

    def _order(self) -> Array | None:
        """The previous number of each obstacle in the list, -1 if new; None: all are unchanged."""
        now, seen = self._obstacles, self.seen
        if now.reordered <= self._listed:
            if not (gone := [index for version, index in now.removed if version > self._listed]):
                return None
            left = np.arange(len(seen))
            for index in gone:
                left = np.delete(left, index) if index < len(left) else left  # otherwise it was added and removed again
            return np.append(left, np.full(len(now) - len(left), -1))
        if now[: len(seen)] == seen:  # identity is equality here
            return None
        numbers = self._numbered()
        return np.array([numbers.get(id(obstacle), (-1,))[-1] for obstacle in now], np.int64)

    def _append(self, fresh: list[Obstacle], before: int) -> None:
        """Append these to the tables, which have `before` rows."""
        for obstacle in fresh:
            if obstacle.table is None:  # shapes never change, so adding one to many is cheap
                obstacle.table = at.segments_of(obstacle)
        first = [*accumulate((len(obstacle.table) for obstacle in fresh), initial=int(self.first[-1]))]
        self.first = memory.resized(self.first, before + len(first))
        self._own_segments = memory.resized(self._own_segments, first[-1])
        self._own_bodies = memory.resized(self._own_bodies, before + len(fresh))
        self._does = memory.resized(self._does, before + len(fresh))
        for k, (obstacle, (begin, end)) in enumerate(zip(fresh, pairwise(first), strict=True), before):
            rows = self._own_segments[begin:end]
            rows[:] = obstacle.table
            rows[:, at.OF : at.FIRST + 1] = k, begin
            self.first[k + 1] = end
            at.set_surface(rows, obstacle)
            self._own_bodies[k], self._does[k] = at.body_of(obstacle), at.doing_of(obstacle)

    def _put_in_order(self, order: Array) -> None:
        """Reorder the bodies by these previous numbers."""
        count, start = np.diff(self.first)[order], self.first[:-1][order]
        self.first = np.concatenate(([0], np.cumsum(count)))
        body = np.repeat(np.arange(len(order)), count)
        self._own_bodies, self._does = self._own_bodies[order], self._does[order]
        self._own_segments = self._own_segments.take(start[body] + np.arange(len(body)) - self.first[:-1][body], axis=0)
        self._own_segments[:, at.OF], self._own_segments[:, at.FIRST] = body, self.first[:-1][body]

    def _refresh(self, k: int, *, resurfaced: bool) -> None:
        """Read a changed obstacle: its surface, or only its motion."""
        obstacle, count, sides = self.seen[k], len(self._own_bodies), len(self._own_segments)
        body, did, does = at.body_of(obstacle), int(self._does[k]), at.doing_of(obstacle)
        for image, (x, y) in enumerate(self.periodic.images().tolist()):
            self.bodies[image * count + k] = (body[0] + x, body[1] + y, *body[2:])
            if resurfaced:
                at.set_surface(self.segments[image * sides + self.first[k] : image * sides + self.first[k + 1]], obstacle)
        self._own_bodies[k] = body
        if resurfaced:
            at.set_surface(self._own_segments[self.first[k] : self.first[k + 1]], obstacle)
        self.version += 1
        self.solid_version += not did & does & at.SENSES
        if (did ^ does) & at.SENSES:
            self.changes = None  # sensors have their own numbering
        elif self.changes is not None:
            self.changes[k] = resurfaced or self.changes.get(k, False)
        if did != does:
            self._does[k] = does
            self._sort()

    def _sort(self) -> None:
        """Update the facts of which only few obstacles have any."""
        every = self._every = int(np.bitwise_or.reduce(self._does, initial=0))
        self._moving = np.flatnonzero(self._does & at.MOVES) if every & at.MOVES else np.zeros(0, np.int64)
        self.sensors = np.flatnonzero(self._does & at.SENSES).tolist() if every & at.SENSES else []
        bits = at.MOVES, at.DRIVES, at.SENSOR_MOVES, at.ROUGH, at.ROLLS, at.ONE_WAY, at.NAMED
        does = (bool(every & bit) for bit in bits)
        self.moving, self.drives, self.sensors_move, self.rough, self.rolls, self.one_way, self.named = does

    def _imagine(self) -> None:
        """Write the obstacles and, in a periodic room, their images around it."""
        self.bodies, self.segments, self._imaged = self._own_bodies, self._own_segments, self.periodic
        if not self.periodic:
            return
        shift, count, sides = self.periodic.images(), len(self.bodies), len(self.segments)
        self.bodies, self.segments = np.tile(self.bodies, (len(shift), 1)), np.tile(self.segments, (len(shift), 1))
        self.bodies[:, at.X] += np.repeat(shift[:, 0], count)
        self.bodies[:, at.Y] += np.repeat(shift[:, 1], count)
        number = np.repeat(np.arange(len(shift)), sides)
        self.segments[:, at.OF] += count * number
        self.segments[:, at.FIRST] += sides * number

    def end(self, dt: float) -> None:
        """At the end of a successful frame: move the obstacles."""
        if not len(self._moving):
            return
        self._frames += 1
        _tools().carry(self._own_bodies, self._moving, dt)
        moved = self._own_bodies[self._moving]
        if self.periodic:
            moved[:, : at.ANGLE] = self.periodic.wrapped(moved[:, : at.ANGLE].copy())
            self._own_bodies[self._moving] = moved
            for image, shift in enumerate(self.periodic.images()):
                self.bodies[image * len(self._own_bodies) + self._moving, : at.VX] = moved[:, : at.VX] + (*shift, 0.0)
        for k, (x, y, angle, *_) in zip(self._moving.tolist(), moved.tolist(), strict=True):
            self.seen[k].carry((x, y), angle)

    # ---- questions -------------------------------------------------------------------------------------------------------

    def covering(self, position: Array, category: ArrayLike = 1, mask: ArrayLike = EVERYONE) -> NDArray[np.int64]:
        """(n,) the obstacle that contains each of these points (n, 2), m, -1 for none.

        Only obstacles that hold particles of this category and mask, (n,) or one for all, and are not passable.
        """
        found, s = self.near(position, 0.0, category, mask), self.segments
        solid = ~np.isin(found.obstacle, s[(s[:, at.WAY] != 0).any(axis=1), at.OF])
        inside, by = np.flatnonzero((found.gap < 0) & solid)[::-1], np.full(len(position), -1)
        by[found.row[inside]] = found.obstacle[inside]  # the first of several
        return by

    def near(self, position: Array, radius: Array | float, category: ArrayLike, mask: ArrayLike) -> Near:
        """The obstacles that circles about these points (n, 2) touch.

        radius: (n,) or one for all, m; category, mask: (n,) or one for all, of the circles.
        """
        self.begin()
        row, gap = np.zeros(0, np.int64), np.zeros(0)
        if self.seen and len(position):
            limit = np.broadcast_to(np.asarray(radius, float), len(position)).copy()
            self._place(0.0, 1.01 * float(limit.max()))
            points = self.periodic.wrapped(np.ascontiguousarray(position, np.float64))
            row, segment, gap, _, inside = self._query((self._cell, self._heads, self._links), points, limit, row)
        if not len(row):  # fast path: no obstacle is near
            return Near(row, row, gap)
        marks = (np.broadcast_to(np.asarray(each, np.uint32), len(position))[row] for each in (category, mask))
        body, gap = self._standing[segment, _BODY].astype(np.int64) % len(self.seen), np.where(inside, -np.inf, gap)
        seen = np.flatnonzero(may_collide(*marks, *self._standing[segment, _MARKS].T))
        best = seen[_least(gap[seen], row[seen], body[seen])]
        return Near(row[best], body[best], gap[best])

    def facing(self, position: Array, obstacle: Array, *, within: float = 0.0, ahead: float = 0.0) -> tuple[Array, Array]:
        """(n,) m, distance of each of these points (n, 2) from the rim of an obstacle, (n,), and (n, 2) the normal out of it.

        NaN where there is no such obstacle.

        Args:
            position: m.
            obstacle: index in the list.
            within: m, approximate distance; searching farther takes longer.
            ahead: s by which obstacles have moved, such as at the end of a frame that is not accepted yet.
        """
        gap, normal = np.full(len(position), np.inf), np.full((len(position), 2), np.nan)
        if self.seen and len(position):
            self._place(ahead, within)
            grid: tuple[Any, ...] = self._cell, self._heads, self._links
            while len(left := np.flatnonzero(~(gap <= self._cell))):
                about = np.ascontiguousarray(position[left], np.float64), np.full(len(left), grid[0]), obstacle[left]
                row, _, away, way, _ = self._query(grid, *about)
                gap[left[row]], normal[left[row]] = away, way
                if grid[0] == np.inf:
                    break
                each = np.arange(len(self._standing), dtype=np.int32)  # one list for distant ones
                grid = np.inf, np.zeros(1, np.int32), np.column_stack((each, np.append(each[1:], np.int32(-1))))
        return np.where(np.isinf(gap), np.nan, gap), normal

    def _query(self, grid: tuple[Any, ...], points: Array, limit: Array, wanted: Array) -> list[Array]:
        """Results of `core.obstacle_queries.segments_near` in a grid: row, segment, gap, normal, whether inside."""
        answer: list[Array] = []
        size, about = 64 + len(points) // 4, (self._standing, len(self.seen), *grid, points, limit, wanted.astype(np.int64))
        while not answer or size > len(answer[0]):
            answer = [*np.empty((2, size), np.int64), np.empty(size), np.empty((size, 2)), np.empty(size, np.int64)]
            size = _tools().segments_near(*about, *answer)
        return [column[:size] for column in answer]

    def standing(self, within: float) -> tuple[Any, ...] | None:
        """Segments, their grid, which reaches `within` m about them, its bounds, and the number of obstacles; None if empty."""
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
        """Update the grid to the places of obstacles in `ahead` seconds."""
        placed = self.version, self.periodic, self._frames, ahead if len(self._moving) else 0.0
        if placed != self._placed or within > self._cell:
            self._standing, self._extent = self._stand(ahead), None
            self._make_grid(max(within, self._cell))
            self._placed = placed

    def _stand(self, ahead: float) -> Array:
        """Segments as `core.obstacle_queries` takes them, `ahead` seconds from now."""
        s = self.segments
        x, y, angle, vx, vy, spin = self.bodies[s[:, at.OF].astype(np.int64)].T
        (lx, ly), (lc, ls), solid = s[:, at.START].T, s[:, at.ALONG].T, s[:, [at.SENSOR]] == 0
        with np.errstate(over="ignore", invalid="ignore"):
            c, d = np.cos(angle + ahead * spin), np.sin(angle + ahead * spin)
            place = x + ahead * vx + c * lx - d * ly, y + ahead * vy + d * lx + c * ly, c * lc - d * ls, d * lc + c * ls
        parts = s[:, [at.LENGTH, at.ROUNDING, at.INNER, at.OF, at.FIRST, at.FACES]], solid * s[:, at.CATEGORY : at.MASK + 1]
        return np.ascontiguousarray(np.column_stack((*place, *parts)))

    def _make_grid(self, within: float) -> None:
        """List segments in the cells near them, so that queries skip the others."""
        x, y, _, _, length, rounding, inner = self._standing.T[:7]
        around = rounding + inner
        with np.errstate(over="ignore", invalid="ignore"):
            farthest = np.maximum(np.abs(x), np.abs(y)) + length + around
        check_distance(farthest, np.inf, self._standing[:, 7], len(self.seen))
        cell = max(within, float(np.median(around + length)), float(farthest.max()) / _TOO_FAR, float(np.finfo(float).tiny))
        self._cell, self._heads, size = cells_for(cell, length, around, 1.0)
        used = -1
        while used < 0:
            if len(self._links) < size:
                self._links = np.empty((size, 2), np.int32)
            used = _tools().list_segments(self._standing, self._cell, self._cell, self._heads, self._links)
            size *= 2


def _tools() -> Any:
    return unit("tools", np.float64)


def _least(gap: Array, *keys: Array) -> Array:
    """Indices of the least gap for each combination of keys, sorted by keys; the first of equal ones."""
    order = np.lexsort((gap, *keys[::-1]))
    again = np.all([np.diff(key[order], prepend=-1) == 0 for key in keys], axis=0)
    return np.asarray(order[~again])
