"""The obstacles of a world as the compiled core takes them, frame by frame: only what has changed is listed anew."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.ground import memory
from pyverlet.ground.arrays import Array
from pyverlet.ground.constants import OBSTACLE_LINKS
from pyverlet.ground.errors import InputError
from pyverlet.laws.obstacles import Course
from pyverlet.laws.obstacles import columns as at
from pyverlet.world.materials import number_of

SIDES = 4
"""Surfaces below are sides of the room, as the core numbers them; from there on they are segments."""

SPARE_FRAMES = 4.0
"""Frames for which a segment that moves is listed ahead; as in `core.obstacles`."""

FARTHEST = 1e100
"""m from the origin to where an obstacle can still be listed."""

_SPARE_LINKS = 1024
"""Room in the grid for what moves."""


class ObstacleRows:
    """Segments and bodies of the obstacles of one world, in the core's form.

    Attributes:
        friction, rolling: the largest of all.
    """

    def __init__(self) -> None:
        self.friction = self.rolling = 0.0
        self._segments = np.zeros((0, at.WIDTH))  # of the course; the core writes to what is its own of each
        self._kinds = [np.zeros(0)] * 4  # friction and rolling resistance, of sensors 0; number of the sensor; whether one-way
        self._totals = 0, 0, False  # segments that are no sensors; sensors; whether any is one-way
        self._bodies, self._moving, self._count = np.zeros((0, 6)), np.zeros(0, np.int32), 0
        self._owners = np.zeros((0, 2), np.int64)  # of each segment the id of its obstacle, and which of its segments it is
        self._seen: Any = None
        self._seen_version = -1

    def begin(self, course: Course, engine: Any, radius: float, dt: float, names: list[str]) -> Array | None:
        """Give the engine the obstacles of now, as a frame of dt seconds begins; radius: of the largest particle, m;
        names: of materials.

        Returns of each surface of before its number now, or -1; None: they are the same.
        """
        course.begin()
        seen = course.version, course.seam, engine, names
        if seen == self._seen:
            if len(self._moving) and not engine.place_obstacles(self._moving, dt, False):
                self._build(engine, len(course.seen), radius, dt)
            return None
        same = self._seen is not None and self._seen[1:] == seen[1:]
        changed = course.changed_since(self._seen_version) if same and len(self._owners) else None
        self._seen, self._seen_version = seen, course.version
        self._segments, self._bodies = course.segments, course.bodies
        if changed is None:
            owners = course.owners()
            renamed = _renamed(self._owners, owners)
            self._owners, self._moving = owners, np.zeros(0, np.int32)
            self._kinds = [np.zeros(len(owners)) for _ in range(4)]
            self._fill(course, names, np.arange(len(owners)))
            self._note_moving(np.arange(len(owners)))
            self._build(engine, len(course.seen), radius, dt)
            return renamed
        rows, resurfaced = map(course.rows_of, changed)
        if len(course.seen) > self._count:
            self._owners = memory.extended(self._owners, course.owners(self._count))
            self._kinds = [memory.resized(column, len(self._owners)) for column in self._kinds]
        if len(resurfaced):
            self._fill(course, names, resurfaced)
        self._note_moving(rows)
        self._reach(len(course.seen), dt, rows)
        self._give(engine, keep=True)
        if not (engine.place_obstacles(rows.astype(np.int32), dt, True) and engine.place_obstacles(self._moving, dt, False)):
            self._build(engine, len(course.seen), radius, dt)
        return None

    def name_after(self, course: Course) -> None:
        """Surfaces are numbered after the obstacles of now; the engine has not seen these."""
        course.begin()
        self._owners, self._seen, self._seen_version = course.owners(), None, course.version

    def renamed(self, course: Course) -> Array | None:
        """As `begin` returns, of what the engine has seen last."""
        course.begin()
        return None if course.version == self._seen_version else _renamed(self._owners, course.owners())

    def _fill(self, course: Course, names: list[str], rows: Array) -> None:
        """These rows of the segments."""
        self._count, fresh = len(course.seen), self._segments[rows]
        body = fresh[:, at.OF].astype(np.int64) % self._count
        place, which = np.zeros(self._count), body[np.diff(body, prepend=-1) != 0].tolist()
        made = [course.seen[k].material for k in which]
        for k, material in zip(which, made, strict=True) if any(made) else ():
            place[k] = number_of(material, names, f"obstacles[{k}]")
        self._segments[rows, at.MATERIAL] = place[body]
        solid = fresh[:, at.SENSOR] == 0
        if not solid.all():
            rank = np.zeros(len(course.seen))
            rank[course.sensors] = np.arange(1, len(course.sensors) + 1)
            self._segments[rows, at.SENSOR] = rank[body]
        one_way = (fresh[:, at.WAY] != 0.0).any(axis=1)
        kinds = solid * fresh[:, at.FRICTION], solid * fresh[:, at.ROLLING], self._segments[rows, at.SENSOR], one_way
        for column, kind in zip(self._kinds, kinds, strict=True):
            column[rows] = kind
        self.friction, self.rolling, sensors, any_one_way = (float(column.max(initial=0.0)) for column in self._kinds)
        self._totals = len(self._segments) - int(np.count_nonzero(self._kinds[2])), int(sensors), any_one_way > 0.0

    def _note_moving(self, rows: Array) -> None:
        """Which of these segments move."""
        moves = (self._bodies[self._segments[rows, at.OF].astype(np.int64), at.VX :] != 0.0).any(axis=1)
        if len(self._moving) or moves.any():
            self._moving = np.union1d(np.setdiff1d(self._moving, rows), rows[moves]).astype(np.int32)

    def _build(self, engine: Any, count: int, radius: float, dt: float) -> None:
        """Make the grid of `count` obstacles, with cells as wide as the largest particle, or wider: not too many."""
        solid = self._segments[:, at.SENSOR] == 0  # sensors are not in it, so that it is the same without them
        s, (around, farthest) = self._segments[solid], self._reach(count, dt, np.flatnonzero(solid))
        cell, links = max(2.0 * radius, 4.0 * float(farthest.max(initial=0.0)) / 2.0**50, float(np.finfo(float).tiny)), 0.0
        if radius == 0.0 and len(s):
            cell = max(float(np.median(around + s[:, at.LENGTH])), cell)
        while True:
            across = 2.0 * around / cell + 3.0
            links = float((s[:, at.LENGTH] / cell * 2.0 * across + across * across).sum())
            if links <= OBSTACLE_LINKS + 64 * len(s):
                break
            cell *= 2.0
        room = int(links) + _SPARE_LINKS
        self._cell, self._links = cell, np.zeros((room, 2), np.int32)
        self._heads = np.full(1 << max(int(links).bit_length(), 6), -1, np.int32)
        while True:
            self._give(engine, keep=False)
            if engine.place_obstacles(np.arange(len(self._segments), dtype=np.int32), dt, True):
                return
            self._links = np.zeros((2 * len(self._links), 2), np.int32)

    def _reach(self, count: int, dt: float, rows: Array) -> tuple[Array, Array]:
        """How far from each of these segments it is listed, and how far from the origin that is, m. count: of obstacles.

        Raises:
            InputError: one is farther away than numbers reach.
        """
        s = self._segments[rows]
        body = self._bodies[s[:, at.OF].astype(np.int64)]
        start = np.hypot(*s[:, at.START].T)
        speed = np.hypot(body[:, at.VX], body[:, at.VY]) + np.abs(body[:, at.SPIN]) * (start + s[:, at.LENGTH])
        with np.errstate(over="ignore", invalid="ignore"):
            around = s[:, at.ROUNDING] + s[:, at.INNER] + SPARE_FRAMES * dt * speed
            farthest = np.abs(body[:, : at.ANGLE]).max(axis=1) + s[:, at.LENGTH] + start + around
        if not (farthest < FARTHEST).all():
            number = int(s[np.nan_to_num(farthest, nan=np.inf).argmax(), 0]) % count
            raise InputError(
                f"obstacles[{number}] is farther away than numbers reach; allowed are speeds that keep it at a place"
            )
        return around, farthest

    def _give(self, engine: Any, *, keep: bool) -> None:
        engine.set_obstacles(
            self._segments, self._bodies, self._moving, self._cell, self._heads, self._links, keep, *self._totals
        )


def _renamed(before: Array, after: Array) -> Array:
    """Of each surface of before its number after, or -1."""
    found = np.full(len(before), -SIDES - 1, np.int64)
    if len(before) and len(after):
        both = np.concatenate((after, before))
        key = np.unique(both[:, 0], return_inverse=True)[1] * (both[:, 1].max() + 1) + both[:, 1]
        now, then = np.split(key, [len(after)])
        order = np.argsort(now, kind="stable")
        last = order[np.searchsorted(now, then, "right", sorter=order) - 1]  # of an obstacle that is listed twice
        same = now[last] == then
        found[same] = last[same]
    return np.concatenate((np.arange(SIDES), found + SIDES))
