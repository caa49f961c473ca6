"""The obstacles of one world under the contact law in Python: the stage of a substep in which particles meet them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile.bundle import hold
from pyverlet.ground.constants import OBSTACLE_LINKS
from pyverlet.ground.errors import InputError
from pyverlet.kernels import meetings
from pyverlet.kernels import obstacles as kernels
from pyverlet.laws.contacts._held import circles
from pyverlet.laws.contacts._held_rooms import walls as walls_of
from pyverlet.laws.obstacles import Course
from pyverlet.laws.rooms import Boundary
from pyverlet.state.slots import Slots

Array = NDArray[Any]

_NO_CELLS = np.inf, np.inf, -np.inf, -np.inf, 1.0
_NOWHERE = np.full(1, -1, np.int32), np.zeros((0, 2), np.int32), np.zeros(7)


class HeldCourse:
    """They live in a grid, which changes where an obstacle moves: those that stand still cost a frame nothing."""

    def __init__(self, course: Course) -> None:
        self.course = course
        self._seen: Any = None
        self._segments = np.zeros(0, kernels.SEGMENT)
        self._reach = 0.0  # largest radius the grid was made for
        self._measured: tuple[Slots, int] | None = None  # of what radii `_largest` is the largest
        self._largest = 0.0
        self._cell, self._used, self._box = 1.0, 0, np.array(_NO_CELLS[:4])
        self._heads, self._links = _NOWHERE[:2]
        self._order: Array | None = None
        self._cells: tuple[Any, ...] = _NO_CELLS
        self._walls, self._walled = np.zeros(7), cast("Sequence[float]", ())
        self._bundle: Any = None
        self._nothing: Any = None
        self._rest = self._along = np.empty((0, 2))  # what rounding has taken from places in the substep before; `Slots.along`

    @property
    def still(self) -> bool:
        """Whether obstacles stay where they are, so that a substep is like the one before."""
        return not len(self.course._moving)

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
        collide(circles(state), course, time + h, *cells, *state.reals(h, lag, rest_speed), state.drop)

    def set_up(self, state: Slots, time: float, h: float) -> None:
        """Place the obstacles, and make room for what is noted of those they hold; arguments: as for `collide`."""
        if self._measured != (state, state.given):
            self._measured, self._largest = (state, state.given), float(state.radius.max(initial=0.0))
        self._place(time, h)
        if self._rest.shape != state.position.shape or self._rest.dtype != state.dtype:
            self._rest, self._along = np.zeros_like(state.position), np.empty_like(state.position)
        state.along = self._along
        if time == 0.0 or self._order is not state.particle:  # every new order is a new array
            self._order = state.particle
            self._rest.fill(0)

    def _place(self, time: float, h: float) -> None:
        """Place those that move or have changed, and list them in the grid where they are now."""
        course = self.course
        if self._seen != (course.version, course.seam) or not 0.5 * self._reach <= self._largest <= self._reach:
            self._take()
            self._make_grid(time, h)
        elif len(course._moving) and not self._update(course._moving, time, h):
            self._make_grid(time, h)

    def _take(self) -> None:
        """Take up the segments of now."""
        course = self.course
        self._seen, rows = (course.version, course.seam), course.segments
        self._segments = np.zeros(len(rows), kernels.SEGMENT)
        for name in rows.dtype.names or ():
            self._segments[name] = rows[name]

    def _update(self, which: Array, time: float, h: float) -> bool:
        """Place these and list them; False if the grid is too small."""
        images = len(self.course._bodies) // len(self.course._own_bodies.rows)
        reach = self._reach + 0.5 * self._cell  # half a cell, for the middle of a piece of the way stands for all of it
        about = which, images, time, h, reach, self._cell, self._box, self._heads, self._links, self._used
        self._used = int(kernels.update(self._segments, self.course._bodies, self.course._first, *about))
        self._cells = (*self._box.tolist(), float(self._cell))
        return self._used != kernels.NO_ROOM

    @np.errstate(over="ignore", invalid="ignore")
    def _make_grid(self, time: float, h: float) -> None:
        """List all segments in the cells near them, so that nobody looks at the others."""
        kernels.place(self._segments, self.course._bodies, time, h)
        s, self._reach = self._segments, self._largest
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
            if self._update(np.arange(len(self.course._own_bodies.rows)), time, h):
                return
            room = 2 * len(self._links)

    def compiled(self, state: Slots, room: Boundary) -> tuple[Any, tuple[Any, ...]]:
        """What `kernels.meetings.collide` takes of them, `Course`, and of their grid; empty without obstacles."""
        if not self.course:
            return self.nothing(state)
        if (walls := walls_of(room)) != self._walled:
            self._walled, self._walls[:] = walls, walls
        arrays = self._segments, self.course._bodies, self._heads, self._links, self._walls, state.along, self._rest
        self._bundle = hold(meetings.Course, arrays, self._bundle)
        return self._bundle, self._cells

    def nothing(self, state: Slots) -> tuple[Any, tuple[Any, ...]]:
        """The same if there were none."""
        if not self._nothing or self._nothing.arrays[-1].dtype != state.dtype:
            rows, tables = np.empty((0, 2), state.dtype), (np.zeros(0, kernels.SEGMENT), np.zeros(0, kernels.BODY))
            self._nothing = hold(meetings.Course, (*tables, *_NOWHERE, rows, rows))
        return self._nothing, _NO_CELLS
