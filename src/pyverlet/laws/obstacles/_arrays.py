"""The obstacles of one world as arrays that follow the world's list, and what lies near them."""

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
"""Numbers of a segment in `core.obstacle_queries`: how many, its body, its category and mask."""

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


class ObstacleArrays:
    """Bodies and segments of the obstacles of a world, and which are near; the obstacles themselves are the truth between frames.

    Only what has changed is written anew. For questions obstacles stand in a grid, which is made when it is asked for and they
    are no longer where they were.

    Args:
        obstacles: the world's list; what has changed in it is looked for at the beginning of each frame.
        periodic: of the boundary.

    Attributes:
        periodic: of the boundary. If it is, there are images of all obstacles beside it: circles run on beyond it within a frame.
        seen: the obstacles of the last frame, as looked at by `begin`; others that are added come to the same list.
        first: of each its first segment, and one more.
        segments: (k, WIDTH) of all of them, those of images behind the others.
        bodies: (n, 6) pivots, m, angles, rad, and their velocities; those of images behind the others.
        version: another number whenever an obstacle has come, gone or been changed by others than its own motion.
        solid_version: the same of those that are no sensors.
        changes: of each obstacle that has come or been changed since this was set to {}, whether more than where it is and how it
            moves; None: others have other numbers since.
        places: of each obstacle of when this was set to None its number now, or -1; None: the same.
        moving: whether any moves. Of those that are no sensors: drives: whether any moves, or has a surface that does; rough,
            rolls, one_way: whether any has friction, has rolling resistance, is passable in one direction. named: has a material.
        sensors, sensors_move: which are sensors, and whether any of them moves.
    """

    def __init__(self, obstacles: Obstacles, periodic: Periodicity = NONE) -> None:
        self._obstacles, self.periodic, self.version, self.solid_version = obstacles, periodic, 0, 0
        self.seen: list[Obstacle] = []
        self._listed = self._revision = -1
        self._own_bodies, self._own_segments = np.zeros((0, 6)), np.zeros((0, at.WIDTH))
        self._does = np.zeros(0, np.uint8)  # of each what it does, see `doing_of`
        self.first = np.zeros(1, np.int64)
        self._numbers: dict[int, list[int]] | None = {}  # of each by its id; more than one if it is listed twice
        self.changes: dict[int, bool] | None = None
        self.places: Array | None = None
        self._imagine()
        self._sort()
        self._frames = 0  # in which any has moved
        self._placed: Any = None  # what the grid is about
        self._cell = 0.0  # m, of the grid, which reaches as far from segments
        self._standing = np.zeros((0, _STANDING))
        self._extent: Array | None = None  # of these, m: lowest x and y, highest x and y
        self._heads, self._links = np.full(1, -1, np.int32), np.zeros((0, 2), np.int32)

    def __reduce__(self) -> Any:
        """A copy finds out by itself."""
        return type(self), (self._obstacles, self.periodic)

    def __bool__(self) -> bool:
        return bool(self._obstacles)

    @property
    def solid(self) -> bool:
        """Whether any is no sensor."""
        return len(self.sensors) < len(self.seen)

    # ---- the arrays ------------------------------------------------------------------------------------------------------

    def begin(self) -> None:
        """At the beginning of a frame: look what has changed."""
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
        """The index of an obstacle in the list of now, its first, or None."""
        self.begin()
        return self._numbered().get(id(obstacle), (None,))[0]

    def rows_of(self, which: Sequence[int]) -> Array:
        """Numbers of the segments of these obstacles, those of images behind the others."""
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
        """The list has changed: returns those that are new."""
        seen, before = self.seen, len(self.seen)
        if self._revision < 0:
            self._revision = journal.latest  # before any is read
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
            seen.extend(fresh)  # a copy of a long list takes longer than all else
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
        """Which number each in the list had when it was looked at last, -1: it is new; None: all are where they were."""
        now, seen = self._obstacles, self.seen
        if now.reordered <= self._listed:
            if not (gone := [index for version, index in now.removed if version > self._listed]):
                return None
            left = np.arange(len(seen))
            for index in gone:
                left = np.delete(left, index) if index < len(left) else left  # else it is new, and gone again
            return np.append(left, np.full(len(now) - len(left), -1))
        if now[: len(seen)] == seen:  # the same objects: they equal themselves alone
            return None
        numbers = self._numbered()
        return np.array([numbers.get(id(obstacle), (-1,))[-1] for obstacle in now], np.int64)

    def _append(self, fresh: list[Obstacle], before: int) -> None:
        """Add these to the tables, in which there are so many."""
        for obstacle in fresh:
            if obstacle.table is None:  # shapes do not change: adding one to many costs little
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
        """The bodies become those of these numbers."""
        count, start = np.diff(self.first)[order], self.first[:-1][order]
        self.first = np.concatenate(([0], np.cumsum(count)))
        body = np.repeat(np.arange(len(order)), count)
        self._own_bodies, self._does = self._own_bodies[order], self._does[order]
        self._own_segments = self._own_segments.take(start[body] + np.arange(len(body)) - self.first[:-1][body], axis=0)
        self._own_segments[:, at.OF], self._own_segments[:, at.FIRST] = body, self.first[:-1][body]

    def _refresh(self, k: int, *, resurfaced: bool) -> None:
        """An obstacle has been changed, and its surface or only its motion."""
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
            self.changes = None  # sensors have numbers of their own
        elif self.changes is not None:
            self.changes[k] = resurfaced or self.changes.get(k, False)
        if did != does:
            self._does[k] = does
            self._sort()

    def _sort(self) -> None:
        """See which do what only few do."""
        every = self._every = int(np.bitwise_or.reduce(self._does, initial=0))
        self._moving = np.flatnonzero(self._does & at.MOVES) if every & at.MOVES else np.zeros(0, np.int64)
        self.sensors = np.flatnonzero(self._does & at.SENSES).tolist() if every & at.SENSES else []
        bits = at.MOVES, at.DRIVES, at.SENSOR_MOVES, at.ROUGH, at.ROLLS, at.ONE_WAY, at.NAMED
        does = (bool(every & bit) for bit in bits)
        self.moving, self.drives, self.sensors_move, self.rough, self.rolls, self.one_way, self.named = does

    def _imagine(self) -> None:
        """The obstacles and, in a periodic room, their images beside it."""
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
        """At the end of a frame that went well: the obstacles are where they moved to."""
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
        row, gap = np.zeros(0, np.int64), np.zeros(0)
        if self.seen and len(position):
            limit = np.broadcast_to(np.asarray(radius, float), len(position)).copy()
            self._place(0.0, 1.01 * float(limit.max()))
            points = self.periodic.wrapped(np.ascontiguousarray(position, np.float64))
            row, segment, gap, _, inside = self._query((self._cell, self._heads, self._links), points, limit, row)
        if not len(row):  # of few points, none is near to any
            return Near(row, row, gap)
        marks = (np.broadcast_to(np.asarray(each, np.uint32), len(position))[row] for each in (category, mask))
        body, gap = self._standing[segment, _BODY].astype(np.int64) % len(self.seen), np.where(inside, -np.inf, gap)
        seen = np.flatnonzero(may_collide(*marks, *self._standing[segment, _MARKS].T))
        best = seen[_least(gap[seen], row[seen], body[seen])]
        return Near(row[best], body[best], gap[best])

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
            grid: tuple[Any, ...] = self._cell, self._heads, self._links
            while len(left := np.flatnonzero(~(gap <= self._cell))):
                about = np.ascontiguousarray(position[left], np.float64), np.full(len(left), grid[0]), obstacle[left]
                row, _, away, way, _ = self._query(grid, *about)
                gap[left[row]], normal[left[row]] = away, way
                if grid[0] == np.inf:
                    break
                each = np.arange(len(self._standing), dtype=np.int32)  # for those farther away than a cell all are in one
                grid = np.inf, np.zeros(1, np.int32), np.column_stack((each, np.append(each[1:], np.int32(-1))))
        return np.where(np.isinf(gap), np.nan, gap), normal

    def _query(self, grid: tuple[Any, ...], points: Array, limit: Array, wanted: Array) -> list[Array]:
        """What `core.obstacle_queries.segments_near` finds in a grid: row, segment, gap, normal, whether inside."""
        answer: list[Array] = []
        size, about = 64 + len(points) // 4, (self._standing, len(self.seen), *grid, points, limit, wanted.astype(np.int64))
        while not answer or size > len(answer[0]):
            answer = [*np.empty((2, size), np.int64), np.empty(size), np.empty((size, 2)), np.empty(size, np.int64)]
            size = _tools().segments_near(*about, *answer)
        return [column[:size] for column in answer]

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
        placed = self.version, self.periodic, self._frames, ahead if len(self._moving) else 0.0
        if placed != self._placed or within > self._cell:
            self._standing, self._extent = self._stand(ahead), None
            self._make_grid(max(within, self._cell))
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
        """List segments in the cells near them, so that the others are not looked at."""
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
    """Which have the least gap of all with the same keys, sorted by the keys; the first of equal ones."""
    order = np.lexsort((gap, *keys[::-1]))
    again = np.all([np.diff(key[order], prepend=-1) == 0 for key in keys], axis=0)
    return np.asarray(order[~again])
