"""The obstacles of one world as arrays, and the stage of a substep in which particles meet them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile.bundle import hold
from pyverlet.ground.constants import OBSTACLE_CELLS
from pyverlet.ground.errors import InputError
from pyverlet.kernels import meetings
from pyverlet.kernels import obstacles as kernels
from pyverlet.laws.obstacles._base import Obstacle, Obstacles
from pyverlet.laws.rooms import Boundary
from pyverlet.state.seam import NONE
from pyverlet.state.slots import Slots

Array = NDArray[Any]

_NO_CELLS = 0.0, 0.0, 1.0, 0, 0
_NOWHERE = np.zeros(1, np.int64), np.zeros(0, np.int32), np.zeros(7)


class Course:
    """Tables of all segments and of where their obstacles are; the obstacles themselves are the truth between frames.

    Args:
        obstacles: the world's list, looked at anew at the beginning of each frame.

    Attributes:
        seam: of the room. In a periodic one there are images of all obstacles beside it: circles run on beyond it within a frame.
    """

    def __init__(self, obstacles: Obstacles) -> None:
        self._obstacles = obstacles
        self._seen: list[Obstacle] = []
        self._revision = 0
        self.seam = self._imaged = NONE
        self._own_bodies = self._bodies = np.zeros(0, kernels.BODY)
        self._own_segments = self._segments = np.zeros(0, kernels.SEGMENT)
        self._moving: list[int] = []
        self._binned_for = -1.0  # largest radius the cells were filled for; negative: fill them anew
        self._measured: tuple[Slots, int] | None = None  # of what radii `_largest` is the largest
        self._largest = 0.0
        self._cells: tuple[Any, ...] = ()
        self._order: Array | None = None
        self._walls = np.zeros(7)
        self._bundle: Any = None
        self._nothing: Any = None
        self._rest = self._along = np.empty((0, 2))  # what rounding has taken from places in the substep before; `Slots.along`

    def __bool__(self) -> bool:
        return bool(self._obstacles)

    def begin(self) -> None:
        """At the beginning of a frame: look what has changed."""
        if self._seen != self._obstacles or self._imaged != self.seam:  # the same objects: they are equal to themselves alone
            self._build()
        if not self._seen:
            return
        newest = max(obstacle.revision for obstacle in self._seen)
        if newest <= self._revision:
            return
        if self._revision >= 0:
            for k, obstacle in enumerate(self._seen):
                if obstacle.revision > self._revision:
                    self._refresh(k)
        self._revision = newest
        self._moving = [k for k, obstacle in enumerate(self._seen) if obstacle.moves]
        self._imagine()

    def covering(self, position: Array) -> NDArray[np.int64]:
        """(n,) which obstacle has each of these (n, 2) points inside it, m, -1 for none."""
        by = np.full(len(position), -1)
        self.begin()
        if self._seen:
            kernels.place(self._segments, self._bodies, 0.0, 0.0)
            self._binned_for = -1.0  # cells are filled where segments are, and have been placed for another substep
            kernels.covered(self._segments, self.seam.wrapped(position.astype(np.float64)), by)
            by[by >= 0] %= len(self._seen)
        return by

    def seen(self) -> list[Obstacle]:
        """The obstacles of the last frame."""
        return list(self._seen)

    def surfaces(self) -> tuple[Array, ...]:
        """For each segment as it stood last: number of its obstacle, start (k, 2), direction (k, 2), length, rounding; metres."""
        s = self._segments
        return (
            s["body"] % max(len(self._seen), 1), np.column_stack((s["bx"], s["by"])), np.column_stack((s["bc"], s["bs"])),
            s["length"].copy(), s["rounding"].copy(),
        )  # fmt: skip

    def facing(self, position: Array) -> tuple[Array, Array]:
        """(k, w) distance of centres (k, 2) from each of the w obstacles, m, and (k, w, 2) the unit normal out of each."""
        return facing_of(position.astype(np.float64), self.surfaces(), len(self._seen))

    def before(self, state: Slots, h: float) -> None:
        """Before a substep: note where everybody comes from."""
        state.note_start()

    def collide(self, state: Slots, room: Boundary, time: float, h: float, lag: float, rest_speed: float) -> None:
        """Let everybody meet what was on the way, and stay in the room.

        time: seconds from the beginning of the frame to that of the substep.
        """
        self.set_up(state, time, h)
        collide: Any = meetings.collide
        course, cells = self.compiled(state, room)
        collide(state.circles(), course, time + h, *cells, *state.reals(h, lag, rest_speed), state.drop)

    @property
    def still(self) -> bool:
        """Whether obstacles stay where they are, so that a substep is like the one before."""
        return not self._moving

    @property
    def bounces(self) -> bool:
        """Whether any throws circles back."""
        return any(obstacle.restitution > 0.0 for obstacle in self._seen)

    def set_up(self, state: Slots, time: float, h: float) -> None:
        """Place the obstacles, and make room for what is noted of those they hold; arguments: as for `collide`."""
        if self._measured != (state, state.given):
            self._measured, self._largest = (state, state.given), float(state.radius.max(initial=0.0))
        if self._moving or self._binned_for != self._largest:
            kernels.place(self._segments, self._bodies, time, h)
            self._bin(self._largest)
        if self._rest.shape != state.position.shape or self._rest.dtype != state.dtype:
            self._rest, self._along = np.zeros_like(state.position), np.empty_like(state.position)
        state.along = self._along
        if time == 0.0 or self._order is not state.particle:  # every new order is a new array
            self._order = state.particle
            self._rest.fill(0)

    def compiled(self, state: Slots, room: Boundary) -> tuple[Any, tuple[Any, ...]]:
        """What `kernels.meetings.collide` takes of them, `Course`, and of their cells; empty without obstacles."""
        if not self:
            return self.nothing(state)
        self._walls[:] = room.walls()
        *cells, start, entries = self._cells
        arrays = self._segments, self._bodies, start, entries, self._walls, state.along, self._rest
        self._bundle = hold(meetings.Course, arrays, self._bundle)
        return self._bundle, tuple(cells)

    def nothing(self, state: Slots) -> tuple[Any, tuple[Any, ...]]:
        """The same if there were none."""
        if not self._nothing or self._nothing.arrays[-1].dtype != state.dtype:
            rows, tables = np.empty((0, 2), state.dtype), (np.zeros(0, kernels.SEGMENT), np.zeros(0, kernels.BODY))
            self._nothing = hold(meetings.Course, (*tables, *_NOWHERE, rows, rows))
        return self._nothing, _NO_CELLS

    def end(self, dt: float) -> None:
        """At the end of a frame that went well: the obstacles are where they moved to."""
        for k in self._moving:
            body = self._own_bodies[k]
            body["x"] += dt * body["vx"]
            body["y"] += dt * body["vy"]
            body["angle"] += dt * body["spin"]
            body["x"], body["y"] = self.seam.wrapped(np.array([[body["x"], body["y"]]]))[0]
            self._seen[k].carry((float(body["x"]), float(body["y"])), float(body["angle"]))
        if self._moving and self.seam:
            self._imagine()

    def _build(self) -> None:
        self._seen = list(self._obstacles)
        for obstacle in self._seen:
            if obstacle.table is None:  # shapes do not change: adding one to many costs little
                obstacle.table = _lowered(obstacle)
        # As bytes: putting hundreds of arrays of records together takes milliseconds.
        parts = [obstacle.table.view(np.uint8) for obstacle in self._seen]
        self._own_segments = np.concatenate([np.zeros(0, np.uint8), *parts]).view(kernels.SEGMENT)
        count = [len(obstacle.table) for obstacle in self._seen]
        self._first = np.concatenate(([0], np.cumsum(count, dtype=np.int64)))
        self._own_segments["body"] = np.repeat(np.arange(len(count)), count)
        self._own_segments["first"] = np.repeat(self._first[:-1], count)
        self._own_bodies = np.array([_body(obstacle) for obstacle in self._seen], kernels.BODY)
        surfaces = [(obstacle.restitution, obstacle.friction, obstacle.surface_speed) for obstacle in self._seen]
        for name, column in zip(("restitution", "friction", "belt"), zip(*surfaces, strict=True), strict=bool(surfaces)):
            self._own_segments[name] = np.repeat(column, count)
        self._revision, self._imaged = -1, self.seam
        self._moving = []
        if not self._seen:
            self._imagine()  # no revision tells of those that are gone

    def _refresh(self, k: int) -> None:
        obstacle = self._seen[k]
        self._own_bodies[k] = _body(obstacle)
        part = self._own_segments[self._first[k] : self._first[k + 1]]
        part["restitution"] = obstacle.restitution
        part["friction"] = obstacle.friction
        part["belt"] = obstacle.surface_speed

    def _imagine(self) -> None:
        """The obstacles and, in a periodic room, their images beside it; their cells are to be filled anew."""
        self._binned_for = -1.0
        self._bodies, self._segments = self._own_bodies, self._own_segments
        if not self.seam:
            return
        shift, count, sides = self.seam.images(), len(self._own_bodies), len(self._own_segments)
        self._bodies, self._segments = np.tile(self._bodies, len(shift)), np.tile(self._segments, len(shift))
        self._bodies["x"] += np.repeat(shift[:, 0], count)
        self._bodies["y"] += np.repeat(shift[:, 1], count)
        number = np.repeat(np.arange(len(shift)), sides)
        self._segments["body"] += count * number
        self._segments["first"] += sides * number

    @np.errstate(over="ignore", invalid="ignore")
    def _bin(self, largest: float) -> None:
        """Fill cells with the segments near them, so that nobody looks at the others."""
        s = self._segments
        ends = np.stack((s["bx"], s["by"], s["bx"] + s["bc"] * s["length"], s["by"] + s["bs"] * s["length"]), axis=1)
        low = np.minimum(ends[:, :2], ends[:, 2:]).min(axis=0, initial=np.inf)
        high = np.maximum(ends[:, :2], ends[:, 2:]).max(axis=0, initial=-np.inf)
        around = float((s["rounding"] + s["inner"] + s["sweep"]).max()) + largest
        sides = high - low + 2 * around
        # As wide as the largest particle, for coarser cells hold segments out of reach; wider where those would be too many.
        cell = max(2 * largest, float(sides.max()) / OBSTACLE_CELLS, float(np.sqrt(np.prod(sides) / OBSTACLE_CELLS)))
        low, high = low - around - 0.5 * cell, high + around + 0.5 * cell
        if not np.isfinite((high - low) / cell).all():
            reach = np.abs(np.column_stack((ends, s["rounding"], s["inner"], s["sweep"])))
            farthest = np.nan_to_num(reach, nan=np.inf, posinf=np.inf).max(axis=1).argmax()
            number = int(s["body"][farthest]) % len(self._seen)
            raise InputError(
                f"obstacles[{number}] is farther away than numbers reach; allowed are speeds that keep it at a place"
            )
        columns, rows = (int(n) + 1 for n in (high - low) / cell)
        start = np.empty(columns * rows + 1, np.int64)
        entries = np.empty(4 * columns * rows, np.int32)
        fill: Any = kernels.bin_segments
        while True:
            # Half a cell, for the middle of a piece of the way stands for all of it.
            found = fill(s, largest + 0.5 * cell, *map(float, low), cell, columns, rows, start, entries)
            if found <= len(entries):
                break
            entries = np.empty(found, np.int32)
        self._cells = (*map(float, low), cell, columns, rows, start, entries)
        self._binned_for = largest


def _body(obstacle: Obstacle) -> tuple[float, ...]:
    return (*obstacle.pivot, obstacle.angle, *obstacle.velocity, obstacle.angular_velocity)


def _lowered(obstacle: Obstacle) -> Array:
    """The segments of an obstacle, without its surface and place."""
    points, closed, rounding, convex, around = obstacle._parts()
    ends = np.roll(points, -1, axis=0) if closed else points[1:]
    starts = points if closed else points[:-1]
    if len(points) == 1:
        starts = ends = points
    table = np.zeros(len(starts), kernels.SEGMENT)
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
    for name, to in (("before", -np.roll(side, 1, axis=0)), ("after", np.roll(side, -1, axis=0))):
        table[f"{name}_x"] = (to * along).sum(axis=1)
        table[f"{name}_y"] = along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0]
    if not closed:
        table["before_x"][0] = table["before_y"][0] = table["after_x"][-1] = table["after_y"][-1] = 0.0
    return table


def facing_of(x: Array, surfaces: tuple[Array, ...], count: int) -> tuple[Array, Array]:
    """(k, count) distance of points x (k, 2) from each obstacle, m, and (k, count, 2) the unit normal out of it."""
    body, start, along, length, rounding = surfaces
    gap, normal = np.full((len(x), count), np.inf), np.zeros((len(x), count, 2))
    for k in range(count):
        mine = body == k
        way = x[:, None] - start[mine]
        t = np.clip((way * along[mine]).sum(axis=2), 0, length[mine])
        way = way - t[:, :, None] * along[mine]
        far = np.hypot(way[..., 0], way[..., 1])
        nearest = np.argmin(far - rounding[mine], axis=1)
        row = np.arange(len(x))
        gap[:, k] = (far - rounding[mine])[row, nearest]
        normal[:, k] = way[row, nearest] / np.maximum(far[row, nearest], 1e-300)[:, None]
    return gap, normal
