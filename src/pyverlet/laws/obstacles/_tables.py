"""The obstacles of one world as arrays that follow the world's list: only what has changed is written anew."""

from __future__ import annotations

import itertools
import math
from collections import deque
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground import memory
from pyverlet.laws.obstacles._base import Obstacle, Obstacles, journal
from pyverlet.state.seam import NONE, Seam

Array = NDArray[Any]

_HERE = ((0.0, 0.0),)

_SURFACE = (
    ("restitution", "restitution"), ("friction", "friction"), ("belt", "surface_speed"),
    ("rolling", "rolling_resistance"), ("category", "category"), ("mask", "mask"), ("sensor", "sensor"),
)  # fmt: skip
"""Columns of all segments of an obstacle, and the attributes that they are."""

BODY = np.dtype([(name, np.float64) for name in ("x", "y", "angle", "vx", "vy", "spin")])
"""Where an obstacle's pivot is at the beginning of a frame, m and rad, and how it moves, m/s and rad/s."""

SEGMENT = np.dtype(
    [
        ("body", np.int64),
        ("first", np.int64), ("faces", np.int64),  # the faces of its polygon; none if it is no part of one
        ("around", np.int64),  # 1: its surface runs counter-clockwise around it; 0: along it, on both sides
        ("lx", np.float64), ("ly", np.float64), ("lc", np.float64), ("ls", np.float64),  # start and direction, as built
        ("length", np.float64), ("rounding", np.float64), ("inner", np.float64),  # inner: who is inside is as near as this, m
        ("before_x", np.float64), ("before_y", np.float64),  # from its start to the neighbour's start, in its own frame; or 0
        ("after_x", np.float64), ("after_y", np.float64),  # from its end to the neighbour's end
        ("restitution", np.float64), ("friction", np.float64), ("belt", np.float64), ("rolling", np.float64),
        ("material", np.int64),  # which of `Tables.names`
        ("category", np.int64), ("mask", np.int64),
        ("way_x", np.float64), ("way_y", np.float64),  # in which it is passable, in its own frame; 0: in no direction
        ("sensor", np.int64),  # 1: it is one
    ]
)  # fmt: skip
"""A rounded segment of an obstacle. Metres."""


class _Rows:
    """Records with room for more: adding some to many costs little."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._bytes = np.zeros((0, dtype.itemsize), np.uint8)
        self.rows = np.zeros(0, dtype)

    def extend(self, fresh: Array) -> None:
        """Add these. As bytes: records are copied field by field."""
        size = self.rows.dtype.itemsize
        self._bytes = memory.extended(self._bytes, np.ascontiguousarray(fresh).view(np.uint8).reshape(len(fresh), size))
        self.rows = self._bytes.reshape(-1).view(self.rows.dtype)

    def take(self, index: Array) -> None:
        """Rows become those of these numbers."""
        self._bytes = self._bytes[index]
        self.rows = self._bytes.reshape(-1).view(self.rows.dtype)


class Tables:
    """Bodies and segments of all obstacles, `BODY` and `SEGMENT`.

    Args:
        obstacles: the world's list; what has changed in it is looked for at the beginning of each frame.
        seam: of the room.

    Attributes:
        seam: of the room. In a periodic one there are images of all obstacles beside it: circles run on beyond it within a frame.
        names: of materials that there have been, and their numbers in the table.
        version: another number whenever an obstacle has come, gone or been changed by others than its own motion.
        solid_version: the same of those that are no sensors.
    """

    def __init__(self, obstacles: Obstacles, seam: Seam = NONE) -> None:
        self._obstacles, self.seam, self.version, self.solid_version = obstacles, seam, 0, 0
        self.names = {"": 0}
        self._seen: list[Obstacle] = []
        self._listed = self._revision = -1
        self._imaged = seam
        self._own_bodies, self._own_segments = _Rows(BODY), _Rows(SEGMENT)
        self._bodies, self._segments = self._own_bodies.rows, self._own_segments.rows
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
        return len(self._seen) > len(self._sensors)

    @property
    def sensors(self) -> list[int]:
        """Which are."""
        return sorted(self._sensors)

    @property
    def sensors_move(self) -> bool:
        """Whether any of them does."""
        return not self._sensors.isdisjoint(self._moves)

    def seen(self) -> list[Obstacle]:
        """The obstacles of the last frame."""
        return self._seen

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
            which: Iterable[int] = range(len(self._seen))
        elif changed := changed - set(map(id, fresh)):
            number = self._numbers()
            if len(number) < len(self._seen):  # some are listed twice
                which = [k for k, obstacle in enumerate(self._seen) if id(obstacle) in changed]
            else:
                which = [number[each] for each in changed if each in number]
        else:
            return
        for k in which:
            self._refresh(k, resurfaced=self._seen[k].resurfaced > before)

    @property
    def segments(self) -> Array:
        """Records `SEGMENT`, those of images behind the others."""
        return self._segments

    @property
    def bodies(self) -> Array:
        """(n, 6) pivots, m, angles, rad, and their velocities; those of images behind the others."""
        return self._bodies.view(np.float64).reshape(-1, 6)

    @property
    def count(self) -> int:
        """Of obstacles, without images."""
        return len(self._seen)

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
        sides = len(self._own_segments.rows)
        return (own + sides * np.arange(len(self._segments) // max(sides, 1))[:, None]).ravel()

    def owners(self, start: int = 0) -> Array:
        """(n, 2) of each segment the id of its obstacle, and which of its segments it is, images counted on.

        start: without those of the obstacles before it, where there are no images.
        """
        first, seen = self._first[start:], self._seen[start:]
        sides, count = len(self._own_segments.rows), np.diff(first)
        images = len(self._segments) // max(sides, 1)
        who = np.repeat(np.fromiter(map(id, seen), np.int64, len(seen)), count)
        number = np.arange(first[0], sides) - np.repeat(first[:-1], count)
        step = int(count.max(initial=0))
        return np.column_stack((np.tile(who, images), (number + step * np.arange(images)[:, None]).ravel()))

    def _numbers(self) -> dict[int, int]:
        """The index of each obstacle by its id."""
        if self._number is None:
            self._number = {id(obstacle): k for k, obstacle in enumerate(self._seen)}
        return self._number

    def _take(self) -> list[Obstacle]:
        """The list has changed: returns those that are new."""
        now, seen, before = list(self._obstacles), self._seen, len(self._seen)
        if self._revision < 0:
            self._revision = journal.latest  # before any is read
        self._listed, order = self._obstacles.version, None
        fresh = now[before:]
        if now[:before] != seen:  # the same objects: they are equal to themselves alone
            number = self._numbers()
            order = np.array([number.get(id(obstacle), -1) for obstacle in now], np.int64)
            new = np.flatnonzero(order < 0)
            order[new], fresh = before + np.arange(len(new)), [now[k] for k in new]
        if order is None and not fresh and self._imaged == self.seam:
            return fresh
        if self._solids_differ(fresh, None if order is None else order[order < before]):
            self.solid_version += 1
        self._seen, self.version = now, self.version + 1
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
        gone = np.ones(len(self._seen), bool)
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
        # As bytes: putting hundreds of arrays of records together takes milliseconds.
        parts = [np.zeros(0, np.uint8), *(obstacle.table.view(np.uint8) for obstacle in fresh)]
        rows = np.concatenate(parts).view(SEGMENT)
        first = self._first[-1] + np.cumsum([0, *count])
        rows["body"], rows["first"] = np.repeat(before + np.arange(len(fresh)), count), np.repeat(first[:-1], count)
        for obstacle, start, size in zip(fresh, (first[:-1] - first[0]).tolist(), count, strict=True):
            self._set_surface(rows[start : start + size], obstacle)
        self._own_segments.extend(rows)
        self._own_bodies.extend(np.array([_body(obstacle) for obstacle in fresh], BODY))
        self._first = np.concatenate((self._first, first[1:]))

    def _put_in_order(self, order: Array) -> None:
        """The bodies become those of these numbers."""
        count, start = np.diff(self._first)[order], self._first[:-1][order]
        self._first = np.concatenate(([0], np.cumsum(count)))
        body = np.repeat(np.arange(len(order)), count)
        self._own_bodies.take(order)
        self._own_segments.take(start[body] + np.arange(len(body)) - self._first[:-1][body])
        rows = self._own_segments.rows
        rows["body"], rows["first"] = body, self._first[:-1][body]

    def _refresh(self, k: int, *, resurfaced: bool) -> None:
        """An obstacle has been changed, and its surface or only its motion."""
        obstacle, count, sides = self._seen[k], len(self._own_bodies.rows), len(self._own_segments.rows)
        body = _body(obstacle)
        for image, (x, y) in enumerate(self.seam.images() if self.seam else _HERE):
            self._bodies[image * count + k] = (body[0] + x, body[1] + y, *body[2:])
            if resurfaced:
                part = self._segments[image * sides + self._first[k] : image * sides + self._first[k + 1]]
                self._set_surface(part, obstacle)
        self._own_bodies.rows[k] = body
        was = k in self._sensors
        self._sort_in(k)
        self.version += 1
        self.solid_version += not (was and obstacle.sensor)
        self._changes.append((self.version, k, resurfaced))
        if was != obstacle.sensor:
            self._renumbered = self.version  # sensors have numbers of their own

    def _set_surface(self, rows: Array, obstacle: Obstacle) -> None:
        """What all segments of an obstacle have alike, and the way through them as each sees it."""
        for name, attribute in _SURFACE:
            rows[name] = getattr(obstacle, attribute)
        rows["material"] = self.names.setdefault(obstacle.material, len(self.names))
        x, y = obstacle.one_way or (0.0, 0.0)
        size = math.hypot(x, y) or 1.0
        rows["way_x"] = (rows["lc"] * x + rows["ls"] * y) / size
        rows["way_y"] = (rows["lc"] * y - rows["ls"] * x) / size

    def _sort_in(self, k: int) -> None:
        """Note what an obstacle does that only few do."""
        obstacle, moves = self._seen[k], self._seen[k].moves
        (self._sensors.add if obstacle.sensor else self._sensors.discard)(k)
        drives = (moves or obstacle.surface_speed != 0.0) and not obstacle.sensor
        (self._drives.add if drives else self._drives.discard)(k)
        if moves != (k in self._moves):
            (self._moves.add if moves else self._moves.discard)(k)
            self._moving = np.array(sorted(self._moves), np.int64)

    def _start_anew(self) -> None:
        """Numbers are others: who does what is to be found anew."""
        self._number = None
        s, b = self._own_segments.rows, self._own_bodies.rows
        self._moving = np.flatnonzero((b["vx"] != 0.0) | (b["vy"] != 0.0) | (b["spin"] != 0.0))
        self._moves = set(self._moving.tolist())
        self._sensors = set(s["body"][s["sensor"] != 0].tolist())
        self._drives = (self._moves | set(s["body"][s["belt"] != 0.0].tolist())) - self._sensors

    def _imagine(self) -> None:
        """The obstacles and, in a periodic room, their images beside it."""
        self._bodies, self._segments, self._imaged = self._own_bodies.rows, self._own_segments.rows, self.seam
        if not self.seam:
            return
        shift, count, sides = self.seam.images(), len(self._bodies), len(self._segments)
        self._bodies, self._segments = np.tile(self._bodies, len(shift)), np.tile(self._segments, len(shift))
        self._bodies["x"] += np.repeat(shift[:, 0], count)
        self._bodies["y"] += np.repeat(shift[:, 1], count)
        number = np.repeat(np.arange(len(shift)), sides)
        self._segments["body"] += count * number
        self._segments["first"] += sides * number


def _body(obstacle: Obstacle) -> tuple[float, ...]:
    return (*obstacle.pivot, obstacle.angle, *obstacle.velocity, obstacle.angular_velocity)


def _lowered(obstacle: Obstacle) -> Array:
    """The segments of an obstacle, without its surface and place."""
    points, closed, rounding, convex, around = obstacle._parts()
    ends = np.roll(points, -1, axis=0) if closed else points[1:]
    starts = points if closed else points[:-1]
    if len(points) == 1:
        starts = ends = points
    table = np.zeros(len(starts), SEGMENT)
    side = ends - starts
    length = np.hypot(*side.T)
    along = np.divide(side, length[:, None], out=np.tile((1.0, 0.0), (len(side), 1)), where=length[:, None] > 0)
    table["lx"], table["ly"] = starts.T
    table["lc"], table["ls"] = along.T
    table["length"], table["rounding"], table["around"] = length, rounding, around
    table["faces"] = len(starts) if convex else 0
    if convex:
        # Twice the area over the perimeter is at least the largest distance of anything inside from its nearest face.
        area = 0.5 * abs(np.sum(starts[:, 0] * ends[:, 1] - starts[:, 1] * ends[:, 0]))
        table["inner"] = 2 * area / length.sum()
    if len(side) == 1:
        return table
    for name, to in (("before", -np.roll(side, 1, axis=0)), ("after", np.roll(side, -1, axis=0))):
        table[f"{name}_x"] = (to * along).sum(axis=1)
        table[f"{name}_y"] = along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]
    if not closed:
        table["before_x"][0] = table["before_y"][0] = table["after_x"][-1] = table["after_y"][-1] = 0.0
    return table
