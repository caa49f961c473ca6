"""The obstacles of one world as arrays that follow the world's list: only what has changed is written anew."""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np

from pyverlet.ground import memory
from pyverlet.ground.arrays import Array
from pyverlet.laws.obstacles import columns as at
from pyverlet.laws.obstacles._base import Obstacle, Obstacles, journal
from pyverlet.state.seam import NONE, Seam

_HERE = ((0.0, 0.0),)


class Tables:
    """Bodies and segments of all obstacles.

    Args:
        obstacles: the world's list; what has changed in it is looked for at the beginning of each frame.
        seam: of the room.

    Attributes:
        seam: of the room. In a periodic one there are images of all obstacles beside it: circles run on beyond it within a frame.
        seen: the obstacles of the last frame, as looked at by `begin`.
        segments: (k, WIDTH) of all of them, those of images behind the others.
        bodies: (n, 6) pivots, m, angles, rad, and their velocities; those of images behind the others.
        version: another number whenever an obstacle has come, gone or been changed by others than its own motion.
        solid_version: the same of those that are no sensors.
    """

    def __init__(self, obstacles: Obstacles, seam: Seam = NONE) -> None:
        self._obstacles, self.seam, self.version, self.solid_version = obstacles, seam, 0, 0
        self.seen: list[Obstacle] = []
        self._listed = self._revision = -1
        self._imaged = seam
        self._own_bodies, self._own_segments = np.zeros((0, 6)), np.zeros((0, at.WIDTH))
        self.bodies, self.segments = self._own_bodies, self._own_segments
        self._first = np.zeros(1, np.int64)  # of each its first segment, and one more
        self._number: dict[int, int] | None = {}  # of each by its id
        self._moves, self._drives, self._sensors = set[int](), set[int](), set[int]()
        self._moving = np.zeros(0, np.int64)
        # Versions, which obstacle each has changed or added, and whether more than where it is, and how it moves.
        self._changes: deque[tuple[int, int, bool]] = deque(maxlen=4096)
        self._renumbered = 0  # the last version in which others have other numbers

    def __reduce__(self) -> Any:
        """A copy finds out by itself."""
        return type(self), (self._obstacles, self.seam)

    def __bool__(self) -> bool:
        return bool(self._obstacles)

    @property
    def drives(self) -> bool:
        """Whether any that is no sensor moves, or has a surface that does."""
        return bool(self._drives)

    @property
    def moving(self) -> bool:
        """Whether any moves."""
        return bool(self._moves)

    @property
    def solid(self) -> bool:
        """Whether any is no sensor."""
        return len(self.seen) > len(self._sensors)

    @property
    def sensors(self) -> list[int]:
        """Which are."""
        return sorted(self._sensors)

    @property
    def sensors_move(self) -> bool:
        """Whether any of them does."""
        return not self._sensors.isdisjoint(self._moves)

    def begin(self) -> None:
        """At the beginning of a frame: look what has changed."""
        fresh: list[Obstacle] = []
        if self._listed != self._obstacles.version or self._imaged != self.seam:
            fresh = self._take()
        if self._revision == journal.latest:
            return
        before = self._revision
        self._revision, changed = journal.since(before)
        if changed is None:
            which: Iterable[int] = range(len(self.seen))
        elif changed := changed - set(map(id, fresh)):
            number = self._numbers()
            if len(number) < len(self.seen):  # some are listed twice
                which = [k for k, obstacle in enumerate(self.seen) if id(obstacle) in changed]
            else:
                which = [number[each] for each in changed if each in number]
        else:
            return
        for k in which:
            self._refresh(k, resurfaced=self.seen[k].resurfaced > before)

    def changed_since(self, version: int) -> tuple[list[int], list[int]] | None:
        """Which obstacles have come or been changed after that version, and which of these not only in where they are and how
        they move; None: others have other numbers now, or none is known.
        """
        oldest = self._changes[0][0] if len(self._changes) == self._changes.maxlen else 0
        if version < max(self._renumbered, oldest):
            return None
        later = list(itertools.takewhile(lambda change: change[0] > version, reversed(self._changes)))
        return sorted({k for _, k, _ in later}), sorted({k for _, k, resurfaced in later if resurfaced})

    def rows_of(self, which: list[int]) -> Array:
        """Numbers of the segments of these obstacles, those of images behind the others."""
        own = np.concatenate([np.arange(self._first[k], self._first[k + 1]) for k in which] or [self._first[:0]])
        sides = len(self._own_segments)
        return (own + sides * np.arange(len(self.segments) // max(sides, 1))[:, None]).ravel()

    def owners(self, start: int = 0) -> Array:
        """(n, 2) of each segment the id of its obstacle, and which of its segments it is, images counted on.

        start: without those of the obstacles before it, where there are no images.
        """
        first, seen = self._first[start:], self.seen[start:]
        sides, count = len(self._own_segments), np.diff(first)
        images = len(self.segments) // max(sides, 1)
        who = np.repeat(np.fromiter(map(id, seen), np.int64, len(seen)), count)
        number = np.arange(first[0], sides) - np.repeat(first[:-1], count)
        step = int(count.max(initial=0))
        return np.column_stack((np.tile(who, images), (number + step * np.arange(images)[:, None]).ravel()))

    def _numbers(self) -> dict[int, int]:
        """The index of each obstacle by its id."""
        if self._number is None:
            self._number = {id(obstacle): k for k, obstacle in enumerate(self.seen)}
        return self._number

    def _take(self) -> list[Obstacle]:
        """The list has changed: returns those that are new."""
        now, seen, before = list(self._obstacles), self.seen, len(self.seen)
        if self._revision < 0:
            self._revision = journal.latest  # before any is read
        grown, order, fresh = self._listed >= self._obstacles.kept, None, now[before:]
        self._listed = self._obstacles.version
        if not grown and now[:before] != seen:  # the same objects: they are equal to themselves alone
            number = self._numbers()
            order = np.array([number.get(id(obstacle), -1) for obstacle in now], np.int64)
            new = np.flatnonzero(order < 0)
            order[new], fresh = before + np.arange(len(new)), [now[k] for k in new]
        if order is None and not fresh and self._imaged == self.seam:
            return fresh
        if self._solids_differ(fresh, None if order is None else order[order < before]):
            self.solid_version += 1
        self.seen, self.version = now, self.version + 1
        self._append(fresh, before)
        if order is not None:
            self._put_in_order(order)
        self._imagine()
        if order is not None or self.seam:
            self._start_anew()
            self._renumbered = self.version
        else:
            for k in range(before, len(now)):
                self._sort_in(k)
                self._changes.append((self.version, k, True))
                if self._number is not None:
                    self._number[id(now[k])] = k
        return fresh

    def _solids_differ(self, fresh: list[Obstacle], kept: Array | None) -> bool:
        """Whether of those that are no sensors any is new, is not kept, or comes in another order. kept: numbers; None: all."""
        if kept is None:
            return any(not obstacle.sensor for obstacle in fresh)
        gone = np.ones(len(self.seen), bool)
        gone[kept] = False
        return (
            any(not obstacle.sensor for obstacle in fresh)
            or not self._sensors.issuperset(np.flatnonzero(gone).tolist())
            or bool((np.diff(kept) < 0).any())
        )

    def _append(self, fresh: list[Obstacle], before: int) -> None:
        """Add these to the tables, in which there are so many."""
        for obstacle in fresh:
            if obstacle.table is None:  # shapes do not change: adding one to many costs little
                obstacle.table = _lowered(obstacle)
        count = [len(obstacle.table) for obstacle in fresh]
        rows = np.concatenate([self._own_segments[:0], *(obstacle.table for obstacle in fresh)])
        first = self._first[-1] + np.cumsum([0, *count])
        rows[:, at.OF], rows[:, at.FIRST] = np.repeat(before + np.arange(len(fresh)), count), np.repeat(first[:-1], count)
        for obstacle, start, size in zip(fresh, (first[:-1] - first[0]).tolist(), count, strict=True):
            self._set_surface(rows[start : start + size], obstacle)
        self._own_segments = memory.extended(self._own_segments, rows)
        bodies = np.array([_body(obstacle) for obstacle in fresh], float).reshape(-1, 6)
        self._own_bodies = memory.extended(self._own_bodies, bodies)
        self._first = np.concatenate((self._first, first[1:]))

    def _put_in_order(self, order: Array) -> None:
        """The bodies become those of these numbers."""
        count, start = np.diff(self._first)[order], self._first[:-1][order]
        self._first = np.concatenate(([0], np.cumsum(count)))
        body = np.repeat(np.arange(len(order)), count)
        self._own_bodies = self._own_bodies[order]
        self._own_segments = self._own_segments[start[body] + np.arange(len(body)) - self._first[:-1][body]]
        self._own_segments[:, at.OF], self._own_segments[:, at.FIRST] = body, self._first[:-1][body]

    def _refresh(self, k: int, *, resurfaced: bool) -> None:
        """An obstacle has been changed, and its surface or only its motion."""
        obstacle, count, sides = self.seen[k], len(self._own_bodies), len(self._own_segments)
        body = _body(obstacle)
        for image, (x, y) in enumerate(self.seam.images() if self.seam else _HERE):
            self.bodies[image * count + k] = (body[0] + x, body[1] + y, *body[2:])
            if resurfaced:
                part = self.segments[image * sides + self._first[k] : image * sides + self._first[k + 1]]
                self._set_surface(part, obstacle)
        self._own_bodies[k] = body
        was = k in self._sensors
        self._sort_in(k)
        self.version += 1
        self.solid_version += not (was and obstacle.sensor)
        self._changes.append((self.version, k, resurfaced))
        if was != obstacle.sensor:
            self._renumbered = self.version  # sensors have numbers of their own

    def _set_surface(self, rows: Array, obstacle: Obstacle) -> None:
        """What all segments of an obstacle have alike, and the way through them as each sees it."""
        rows[:, at.RESTITUTION : at.MASK + 1] = (
            obstacle.restitution, obstacle.friction, obstacle.surface_speed, obstacle.category, obstacle.mask,
        )  # fmt: skip
        rows[:, at.SENSOR], rows[:, at.ROLLING] = obstacle.sensor, obstacle.rolling_resistance
        x, y = obstacle.one_way or (0.0, 0.0)
        size = math.hypot(x, y) or 1.0
        (c, d), way = rows[:, at.ALONG].T, rows[:, at.WAY]
        way[:, 0], way[:, 1] = (c * x + d * y) / size, (c * y - d * x) / size

    def _sort_in(self, k: int) -> None:
        """Note what an obstacle does that only few do."""
        obstacle, moves = self.seen[k], self.seen[k].moves
        (self._sensors.add if obstacle.sensor else self._sensors.discard)(k)
        drives = (moves or obstacle.surface_speed != 0.0) and not obstacle.sensor
        (self._drives.add if drives else self._drives.discard)(k)
        if moves != (k in self._moves):
            (self._moves.add if moves else self._moves.discard)(k)
            self._moving = np.array(sorted(self._moves), np.int64)

    def _start_anew(self) -> None:
        """Numbers are others: who does what is to be found anew."""
        self._number = None
        body = self._own_segments[:, at.OF].astype(np.int64)
        self._moving = np.flatnonzero((self._own_bodies[:, at.VX :] != 0.0).any(axis=1))
        self._moves = set(self._moving.tolist())
        self._sensors = set(body[self._own_segments[:, at.SENSOR] != 0].tolist())
        self._drives = (self._moves | set(body[self._own_segments[:, at.BELT] != 0.0].tolist())) - self._sensors

    def _imagine(self) -> None:
        """The obstacles and, in a periodic room, their images beside it."""
        self.bodies, self.segments, self._imaged = self._own_bodies, self._own_segments, self.seam
        if not self.seam:
            return
        shift, count, sides = self.seam.images(), len(self.bodies), len(self.segments)
        self.bodies, self.segments = np.tile(self.bodies, (len(shift), 1)), np.tile(self.segments, (len(shift), 1))
        self.bodies[:, at.X] += np.repeat(shift[:, 0], count)
        self.bodies[:, at.Y] += np.repeat(shift[:, 1], count)
        number = np.repeat(np.arange(len(shift)), sides)
        self.segments[:, at.OF] += count * number
        self.segments[:, at.FIRST] += sides * number


def _body(obstacle: Obstacle) -> tuple[float, ...]:
    return (*obstacle.pivot, obstacle.angle, *obstacle.velocity, obstacle.angular_velocity)


def _lowered(obstacle: Obstacle) -> Array:
    """The segments of an obstacle, without its surface and place."""
    points, closed, rounding, convex, around = obstacle._parts()
    ends = np.roll(points, -1, axis=0) if closed else points[1:]
    starts = points if closed else points[:-1]
    if len(points) == 1:
        starts = ends = points
    table = np.zeros((len(starts), at.WIDTH))
    side = ends - starts
    length = np.hypot(*side.T)
    along = np.divide(side, length[:, None], out=np.tile((1.0, 0.0), (len(side), 1)), where=length[:, None] > 0)
    table[:, at.START], table[:, at.ALONG] = starts, along
    table[:, at.LENGTH], table[:, at.ROUNDING], table[:, at.AROUND] = length, rounding, around
    if convex:
        # Twice the area over the perimeter is at least the largest distance of anything inside from its nearest face.
        area = 0.5 * abs(np.sum(starts[:, 0] * ends[:, 1] - starts[:, 1] * ends[:, 0]))
        table[:, at.FACES], table[:, at.INNER] = len(starts), 2 * area / length.sum()
    if len(side) == 1:
        return table
    for to, neighbour in ((at.BEFORE, -np.roll(side, 1, axis=0)), (at.AFTER, np.roll(side, -1, axis=0))):
        ahead = (neighbour * along).sum(axis=1)
        table[:, to] = np.column_stack((ahead, along[:, 0] * neighbour[:, 1] - along[:, 1] * neighbour[:, 0]))
    if not closed:
        table[0, at.BEFORE] = table[-1, at.AFTER] = 0.0
    return table
