"""Textbook boundaries, shown in comparison with the real ones; not for use in worlds.

`Box` and `Circle` find the time of impact and reflect there: with e = 1 a bounce conserves energy up to rounding. The two here
look only at the end of the step, at a depth d beyond the wall.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.laws.boundaries import Boundary, Box, Circle, Extent, held_by
from pyverlet.state.sorted_state import SortedState


class TextbookBoundary(Boundary):
    """Base class of the textbook boundaries: a room with the shape of another one.

    Args:
        room: Box or Circle without friction.
    """

    _flip: bool

    def __init__(self, room: Box | Circle) -> None:
        if not isinstance(room, Box | Circle):
            raise InputError(f"room is {room!r}; allowed are pyverlet.Box(...) and pyverlet.Circle(...)")
        if room.friction:
            raise InputError(f"friction of the room is {room.friction:g}; allowed is 0, since {type(self).__name__} has none")
        self.room = room

    @property
    def restitution(self) -> float:
        """e of the walls."""
        return self.room.restitution

    def confine(self, state: SortedState, h: float, lag: float, rest_speed: float) -> None:
        room, x, r = self.room, state.position, state.radius
        held, real = held_by(room, state) > 0, state.real
        if isinstance(room, Circle):
            way = np.asarray(room.center, x.dtype) - x
            far, inside = np.sqrt((way * way).sum(axis=1)), real(room.radius) - r
            out = np.flatnonzero(held & (far > np.maximum(inside, 0)))
            self._put_back(state, out, way[out] / far[out, None], (far - inside)[out], h)
            return
        x0, y0, x1, y1 = map(real, room.extent())
        depths = x0 + r - x[:, 0], x[:, 0] + r - x1, y0 + r - x[:, 1], x[:, 1] + r - y1
        for depth, normal in zip(depths, np.array([(1, 0), (-1, 0), (0, 1), (0, -1)], x.dtype), strict=True):
            out = np.flatnonzero(held & (depth > 0))
            self._put_back(state, out, np.broadcast_to(normal, (len(out), 2)), depth[out], h)

    def _put_back(self, state: SortedState, which: Array, normal: Array, depth: Array, h: float) -> None:
        """Put back circles that are `depth` (k,) m beyond a wall of `normal` (k, 2) into the room."""
        state.position[which] += depth[:, None] * normal
        towards = (state.velocity[which] * normal).sum(axis=1)
        change = -(state.real(self.room.restitution) * towards + towards) if self._flip else depth / state.real(h)
        state.velocity[which] += change[:, None] * normal

    def extent(self) -> Extent:
        return self.room.extent()

    def outside(self, position: Array) -> Array:
        return self.room.outside(position)

    def holds(self, category: ArrayLike, mask: ArrayLike) -> NDArray[np.bool_]:
        return self.room.holds(category, mask)

    def check(self, radius: Array) -> None:
        self.room.check(radius)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.room!r})"


class ClampAndFlip(TextbookBoundary):
    """Put the circle back on the wall and reverse the normal velocity, times e. For demonstration.

    Under gravity g even e = 1 does not conserve energy. A method whose velocity belongs to the time of the position gains m g d
    at each bounce: the circle was lifted by d and keeps its speed from below the wall. Semi-implicit Euler and position Verlet
    reverse w = (x_prev - x) / h, as sketches do, and lose m g (w h - d). See `pyverlet truth`.

    Args:
        room: Box or Circle, with its restitution; without friction.
    """

    _flip = True


class ProjectOnly(TextbookBoundary):
    """Put the circle back on the wall and nothing else, as if x - x_prev were its whole state. For demonstration.

    The shift d enters the velocity as d / h. An arriving circle ends at rest on the wall, whatever its speed: its restitution is
    0, and that of `room` must be.

    Args:
        room: Box or Circle, without restitution and friction.
    """

    _flip = False

    def __init__(self, room: Box | Circle) -> None:
        super().__init__(room)
        if room.restitution:
            raise InputError(
                f"restitution of the room is {room.restitution:g}; allowed is 0, since projection alone never bounces"
            )
