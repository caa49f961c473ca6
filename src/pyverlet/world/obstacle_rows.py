"""Obstacles in the form that the compiled core takes; in each frame only changes are listed anew."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.laws.obstacles import Obstacle, ObstacleArrays, journal
from pyverlet.laws.obstacles import rows as at
from pyverlet.laws.obstacles._grid import cells_for, check_distance
from pyverlet.world.materials import number_of

SIDES = 4
"""Surface numbers below are sides of the room, as the core numbers them; higher ones are segments."""

SPARE_FRAMES = 4.0
"""Frames for which a moving segment is listed ahead; the same as in `core.obstacles`."""

FARTHEST = 1e100
"""m from the origin: obstacles farther away cannot be listed."""

_SPARE_LINKS = 1024
"""Spare entries in the grid for moving segments."""


class ObstacleRows:
    """Segments and bodies of the obstacles of one world, in the core's form.

    Attributes:
        refiltered: (surfaces,) bool, those that `begin` found to collide with other categories than before, if numbers are
            unchanged; or None.
    """

    def __init__(self) -> None:
        self._segments = np.zeros((0, at.WIDTH))  # of `ObstacleArrays`; the core writes its own columns
        self._totals = 0, 0, False  # segments without sensors; sensors; whether any is one-way
        self._bodies, self._moving = np.zeros((0, 6)), np.zeros(0, np.int32)
        self._named: _Names = [], np.zeros(1, np.int64), 1  # the obstacles that number the surfaces
        self._seen: Any = -1, None
        self.refiltered: Array | None = None
        self._latest = -1  # of the journal of obstacles

    def begin(self, arrays: ObstacleArrays, engine: Any, radius: float, dt: float, names: list[str]) -> Array | None:
        """Pass the current obstacles to the engine at the start of a frame of dt seconds. radius: of the largest particle, m.
        names: of materials.

        Returns the new number of each previous surface, or -1; None if numbers are unchanged.
        """
        arrays.begin()
        self.refiltered, seen = None, (arrays.version, (arrays.periodic, engine, names))
        if seen == self._seen:
            if len(self._moving) and not engine.place_obstacles(self._moving, dt, False):
                self._build(engine, len(arrays.seen), radius, dt)
            return None
        same = seen[1] == self._seen[1]
        changes, arrays.changes = arrays.changes if same and len(self._segments) else None, {}
        places, arrays.places = arrays.places if same else None, None
        self._seen = -1, None  # until the engine has all of them
        self._segments, self._bodies = arrays.segments, arrays.bodies
        which: Sequence[int] = range(len(arrays.seen)) if changes is None else sorted(changes)
        rows = np.arange(len(self._segments)) if changes is None else arrays.rows_of(which)
        if changes is None:
            self._moving = np.zeros(0, np.int32)
            self._fill(arrays, names, which, rows)
        elif resurfaced := [k for k in which if changes[k]]:
            self.refiltered = self._refiltered(arrays, resurfaced)
            self._fill(arrays, names, resurfaced, rows if len(resurfaced) == len(which) else arrays.rows_of(resurfaced))
        if arrays.moving or len(self._moving):
            moves = (self._bodies[self._segments[rows, at.OF].astype(np.int64), at.VX :] != 0.0).any(axis=1)
            self._moving = np.union1d(np.setdiff1d(self._moving, rows), rows[moves]).astype(np.int32)
        placed = False
        if changes is not None:
            self._give(engine, keep=True)
            placed = engine.place_obstacles(rows.astype(np.int32), dt, True) and engine.place_obstacles(self._moving, dt, False)
        if not placed:
            self._build(engine, len(arrays.seen), radius, dt)
        before, self._named, self._seen, self._latest = self._named, _named(arrays), seen, journal.latest
        return _renamed(before, self._named, places) if changes is None else None

    def name_after(self, arrays: ObstacleArrays) -> None:
        """Number the surfaces after the current obstacles, which the engine has not received."""
        arrays.begin()
        self._named, self._seen, self._latest = _named(arrays), (arrays.version, None), journal.latest

    def others(self, arrays: ObstacleArrays) -> Array | None:
        """(surfaces,) bool: which surfaces of the engine are gone or have changed; None: no obstacle has."""
        if (now := self.renamed(arrays)) is None or arrays.changes is None:
            return None if now is None else now < 0
        return self._refiltered(arrays, [*arrays.changes])

    def _refiltered(self, arrays: ObstacleArrays, which: list[int]) -> Array | None:
        """(surfaces,) bool: which of these obstacles collide with other categories than those the engine has; None: none."""
        which = [k for k in which if k < self.count and arrays.seen[k].refiltered > self._latest]
        own = np.zeros(SIDES + len(arrays.segments) if which else 0, bool)
        own[SIDES + arrays.rows_of(which)] = True
        return own if which else None

    def renamed(self, arrays: ObstacleArrays) -> Array | None:
        """The return value of `begin`, relative to the obstacles that the engine received last."""
        arrays.begin()
        return None if arrays.version == self._seen[0] else _renamed(self._named, _named(arrays))

    @property
    def count(self) -> int:
        """Number of obstacles that the engine received last."""
        return len(self._named[1]) - 1

    def number_then(self, obstacle: Obstacle, now: int) -> int:
        """The engine's number of an obstacle whose number is now `now`; `count` if the engine does not know it."""
        known = self._named[0]
        if now < self.count and known[now] is obstacle:
            return now
        return next((k for k in range(self.count) if known[k] is obstacle), self.count)

    def _fill(self, arrays: ObstacleArrays, names: list[str], which: Sequence[int], rows: Array) -> None:
        """Fill these rows of the segments, which belong to these obstacles."""
        self._segments[rows, at.MATERIAL], sensors = 0, 0
        if arrays.sensors or arrays.named:
            body, place = self._segments[rows, at.OF].astype(np.int64) % len(arrays.seen), np.zeros((2, len(arrays.seen)))
            for k in which:
                place[0, k] = number_of(arrays.seen[k].material, names, f"obstacles[{k}]")
            place[1, arrays.sensors] = np.arange(1, len(arrays.sensors) + 1)
            self._segments[rows, at.MATERIAL], self._segments[rows, at.SENSOR] = place[:, body]
            sensors = int(np.count_nonzero(self._segments[:, at.SENSOR]))
        self._totals = len(self._segments) - sensors, len(arrays.sensors), arrays.one_way

    def _build(self, engine: Any, count: int, radius: float, dt: float) -> None:
        """Build the grid of `count` obstacles. Cells are at least as wide as the largest particle; their number is limited.

        Raises:
            InputError: an obstacle is too far away.
        """
        s, sensors = self._segments, self._totals[1]
        if sensors:  # sensors stay out of the grid, so that it is the same without them
            s = s[s[:, at.SENSOR] == 0]
        body = self._bodies[s[:, at.OF].astype(np.int64)]
        start = np.hypot(*s[:, at.START].T)
        around = s[:, at.ROUNDING] + s[:, at.INNER]
        with np.errstate(over="ignore", invalid="ignore"):
            if len(self._moving):
                speed = np.hypot(body[:, at.VX], body[:, at.VY]) + np.abs(body[:, at.SPIN]) * (start + s[:, at.LENGTH])
                around += SPARE_FRAMES * dt * speed
            farthest = np.abs(body[:, : at.ANGLE]).max(axis=1) + s[:, at.LENGTH] + start + around
        check_distance(farthest, FARTHEST, s[:, at.OF], count)
        cell = max(2.0 * radius, 4.0 * float(farthest.max(initial=0.0)) / 2.0**50, float(np.finfo(float).tiny))
        if radius == 0.0 and len(s):
            cell = max(float(np.median(around + s[:, at.LENGTH])), cell)
        self._cell, self._heads, links = cells_for(cell, s[:, at.LENGTH], around, 0.0)
        self._links = np.zeros((links + _SPARE_LINKS, 2), np.int32)
        while True:
            self._give(engine, keep=False)
            if engine.place_obstacles(np.arange(len(self._segments), dtype=np.int32), dt, True):
                return
            self._links = np.zeros((2 * len(self._links), 2), np.int32)

    def _give(self, engine: Any, *, keep: bool) -> None:
        engine.set_obstacles(
            self._segments, self._bodies, self._moving, self._cell, self._heads, self._links, keep, *self._totals
        )


_Names = tuple[list[Obstacle], Array, int]


def _named(arrays: ObstacleArrays) -> _Names:
    """The obstacles, the first segment of each, and the number of periodic images of all."""
    return arrays.seen, arrays.first, len(arrays.periodic.images())


def _renamed(before: _Names, after: _Names, places: Array | None = None) -> Array:
    """The new number of each previous surface, or -1; places: the new number of each obstacle, if known."""
    if places is None:
        number = {id(obstacle): k for k, obstacle in enumerate(after[0])}  # an obstacle that is listed twice has its last number
        known = before[0][: len(before[1]) - 1]  # the list may have grown since
        places = np.array([number.get(id(obstacle), -1) for obstacle in known], np.int64)
    whose = places[: len(before[1]) - 1]
    first = np.where(whose >= 0, after[1][whose], -after[1][-1] * after[2] - before[1][-1])
    own = np.arange(before[1][-1]) + np.repeat(first - before[1][:-1], np.diff(before[1]))
    found = own + after[1][-1] * np.arange(before[2])[:, None]
    found[after[2] :] = -1
    return np.concatenate((np.arange(SIDES), np.where(found.ravel() >= 0, found.ravel() + SIDES, -1)))
