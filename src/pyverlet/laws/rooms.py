"""Bounds: the room the particles live in.

To add one: a class here or anywhere with `confine`, `extent`, `outside` and `check`, a kernel that calls `kernels.bounds.meet`
for each wall, and a parameter in the tests of bounds.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from contextlib import nullcontext
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground import checks
from pyverlet.ground.constants import STANDS_OUT
from pyverlet.ground.errors import InputError
from pyverlet.kernels import bounds, frame, meetings
from pyverlet.laws.turning import surface
from pyverlet.state.state import Slots

Array = NDArray[Any]
Extent = tuple[float, float, float, float]


class Boundary(ABC):
    """What the world asks of its bounds."""

    @abstractmethod
    def confine(self, state: Slots, h: float, lag: float, rest_speed: float) -> None:
        """Bounce or hold every circle that reaches beyond a wall. `lag`: seconds the velocity is behind the position."""

    @property
    def moves(self) -> bool:
        """Whether its walls may do work."""
        return False

    def compiled(self, state: Slots) -> tuple[Any, tuple[float, ...]] | None:
        """What `confine` does as a driver of `kernels.frame`, and the numbers it takes; None: Python has to call it."""
        return None

    def walls(self) -> Sequence[float]:
        """Its shape as seven numbers (`kernels.meetings`), so that obstacles push nobody through it; none, if it cannot say."""
        return (meetings.OPEN, 0, 0, 0, 0, 0, 0)

    def facing(self, position: Array) -> tuple[Array, Array] | None:
        """(k, w) distance of centres (k, 2) from each of its walls, m, and (k, w, 2) the unit normal of each into the room."""
        return None

    def perimeter(self) -> float | None:
        """Length of its walls, m; None if that is not known."""
        return None

    @abstractmethod
    def extent(self) -> Extent | None:
        """(x0, y0, x1, y1) of the room, m; None if it has no walls."""

    @abstractmethod
    def outside(self, position: Array) -> Array:
        """(n,) bool, which of these centres are outside."""

    def put_in(self, position: Array, radius: Array) -> Array:
        """(n, 2) these places, but at the wall where a rim would stand out of it by more than STANDS_OUT; for who is added."""
        return position

    @abstractmethod
    def check(self, radius: Array) -> None:
        """Raise InputError if one of these circles does not fit."""


class Open(Boundary):
    """No walls."""

    def compiled(self, state: Slots) -> tuple[Any, tuple[float, ...]] | None:
        return (frame.open_space, ()) if type(self) is Open else None

    def confine(self, state: Slots, h: float, lag: float, rest_speed: float) -> None:
        state.resting[:] = 0

    def extent(self) -> None:
        return None

    def outside(self, position: Array) -> Array:
        return np.zeros(len(position), bool)

    def check(self, radius: Array) -> None:
        pass

    def __repr__(self) -> str:
        return "Open()"


class _Walls(Boundary):
    """Restitution and friction of walls."""

    def __init__(self, restitution: float, friction: float) -> None:
        self.restitution = checks.fraction("restitution", restitution)
        self.friction = checks.number("friction", friction, least=0.0)
        self._given: tuple[Any, ...] = ()
        self._shape: list[Any] = []
        self._laws: list[Any] = []

    def _confine(self, kernel: Any, shape: Sequence[float], state: Slots, h: float, lag: float, rest_speed: float) -> None:
        shape, laws = self._rounded(shape, state, h, lag, rest_speed)
        kernel(*shape, *state.bodies(), *laws)

    def _rounded(self, shape: Sequence[float], state: Slots, h: float, lag: float, rest_speed: float) -> tuple[Any, Any]:
        """The numbers of `shape`, and h, lag, e, mu and rest_speed, in the dtype of the state."""
        given = (state.real, shape, h, lag, self.restitution, self.friction, rest_speed)
        if given != self._given:  # the same in all substeps of a frame, and rounding takes longer than the walls of a small world
            self._given, self._shape, self._laws = given, [*map(state.real, shape)], [*map(state.real, given[2:])]
        return self._shape, self._laws


class Circle(_Walls):
    """A circular cage: particles stay inside.

    Args:
        center: (x, y), m.
        radius: of the cage, m.
        restitution: e of the wall, 0 to 1.
        friction: mu of the wall, 0 or more.
        angular_velocity: rad/s it turns with about its centre, counter-clockwise: a drum, whose wall takes along what rubs on it.
    """

    def __init__(
        self,
        *,
        center: Sequence[float] = (0.0, 0.0),
        radius: float,
        restitution: float = 0.0,
        friction: float = 0.0,
        angular_velocity: float = 0.0,
    ) -> None:
        super().__init__(restitution, friction)
        self.center = checks.vector("center", center)
        self.radius = checks.number("radius", radius, above=0.0)
        self.angular_velocity = checks.number("angular_velocity", angular_velocity)

    @property
    def moves(self) -> bool:
        return self.angular_velocity != 0.0 and self.friction > 0.0

    def walls(self) -> Sequence[float]:
        # Whom an obstacle pushes to a wall that turns is held there, and rubbed where the wall itself is met.
        return (meetings.ROUND, *self.center, self.radius, 0.0, self.restitution, 0.0 if self.moves else self.friction)

    def compiled(self, state: Slots) -> tuple[Any, tuple[float, ...]] | None:
        if type(self) is not Circle or self.moves:
            return None
        if self.restitution == 0.0 == self.friction and state.smooth:
            return frame.smooth_cage, (*self.center, self.radius)
        return frame.cage, (*self.center, self.radius, self.restitution, self.friction)

    def confine(self, state: Slots, h: float, lag: float, rest_speed: float) -> None:
        speed = self.angular_velocity * self.radius
        with surface(state, speed, h) if self.moves else nullcontext():
            self._confine(bounds.circle, (*self.center, self.radius), state, h, lag, rest_speed)

    def facing(self, position: Array) -> tuple[Array, Array]:
        way = self.center - position.astype(np.float64)
        far = np.hypot(*way.T)
        return (self.radius - far)[:, None], (way / np.maximum(far, 1e-300)[:, None])[:, None, :]

    def perimeter(self) -> float:
        return float(2 * np.pi * self.radius)

    def extent(self) -> Extent:
        (x, y), r = self.center, self.radius
        return (x - r, y - r, x + r, y + r)

    def outside(self, position: Array) -> Array:
        x, y = (position.astype(np.float64) - self.center).T
        return np.asarray(np.hypot(x, y) > self.radius)

    def put_in(self, position: Array, radius: Array) -> Array:
        away = position - np.asarray(self.center, position.dtype)
        distance, room = np.hypot(*away.T), np.maximum(self.radius - radius, 0)
        out = distance > room + STANDS_OUT * radius
        part = np.divide(room, distance, out=np.ones_like(distance), where=out)
        return np.where(out[:, None], (self.center + part[:, None] * away).astype(position.dtype), position)

    def check(self, radius: Array) -> None:
        _fits(radius, self.radius, f"the radius of the cage, {self.radius:g} m")

    def __repr__(self) -> str:
        turns = f", angular_velocity={self.angular_velocity:g}" if self.angular_velocity else ""
        walls = f"restitution={self.restitution:g}, friction={self.friction:g}{turns}"
        return f"Circle(center={self.center}, radius={self.radius:g}, {walls})"


class Box(_Walls):
    """A rectangle: particles stay inside.

    Args:
        lower: (x0, y0), the lower left corner, m.
        upper: (x1, y1), the upper right corner, m.
        restitution: e of the walls, 0 to 1.
        friction: mu of the walls, 0 or more.
    """

    def __init__(
        self, lower: Sequence[float], upper: Sequence[float], *, restitution: float = 0.0, friction: float = 0.0
    ) -> None:
        super().__init__(restitution, friction)
        self.lower = checks.vector("lower", lower)
        self.upper = checks.vector("upper", upper)
        if not (self.lower[0] < self.upper[0] and self.lower[1] < self.upper[1]):
            raise InputError(f"upper is {self.upper}; allowed is a corner above and to the right of lower, {self.lower}")

    def walls(self) -> Sequence[float]:
        return (meetings.RECTANGLE, *self.lower, *self.upper, self.restitution, self.friction)

    def compiled(self, state: Slots) -> tuple[Any, tuple[float, ...]] | None:
        shape = (*self.lower, *self.upper, self.restitution, self.friction)
        return (frame.four_walls, shape) if type(self) is Box else None

    def confine(self, state: Slots, h: float, lag: float, rest_speed: float) -> None:
        self._confine(bounds.box, (*self.lower, *self.upper), state, h, lag, rest_speed)

    def facing(self, position: Array) -> tuple[Array, Array]:
        """Its walls are, in this order, the left, the right, the floor and the ceiling."""
        (x, y), (x0, y0), (x1, y1) = position.astype(np.float64).T, self.lower, self.upper
        into = np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
        return np.column_stack((x - x0, x1 - x, y - y0, y1 - y)), np.broadcast_to(into, (len(position), 4, 2))

    def perimeter(self) -> float:
        return 2 * (self.upper[0] - self.lower[0] + self.upper[1] - self.lower[1])

    def extent(self) -> Extent:
        return (*self.lower, *self.upper)

    def outside(self, position: Array) -> Array:
        inside = (position >= self.lower) & (position <= self.upper)
        return np.asarray(~inside.all(axis=1))

    def put_in(self, position: Array, radius: Array) -> Array:
        inside = np.clip(position, self.lower + radius[:, None], self.upper - radius[:, None])
        out = np.abs(inside - position) > STANDS_OUT * radius[:, None]
        return np.where(out, inside.astype(position.dtype), position)

    def check(self, radius: Array) -> None:
        half = 0.5 * min(self.upper[0] - self.lower[0], self.upper[1] - self.lower[1])
        _fits(radius, half, f"half the shorter side of the box, {half:g} m")

    def __repr__(self) -> str:
        return f"Box({self.lower}, {self.upper}, restitution={self.restitution:g}, friction={self.friction:g})"


def _fits(radius: Array, room: float, room_is: str) -> None:
    # At this width the dtype's own rounding of an exact fit is forgiven.
    wrong = radius > room * (1 + 1e-6)
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        raise InputError(f"radius[{first}] is {radius[first]:g} m; allowed is at most {room_is}")
