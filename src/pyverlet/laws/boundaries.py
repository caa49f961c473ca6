"""Boundaries: the room that particles live in.

To add one: a class here or anywhere with `confine`, `extent`, `outside` and `check`, and a parameter in the tests of bounds.
Walls that take part in contact solving, as those here do, are surfaces of the core (`world.materials.walls_of`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.checked import Checked, Value
from pyverlet.common.constants import STANDS_OUT
from pyverlet.common.errors import InputError
from pyverlet.common.renamed import Renamed
from pyverlet.laws.surface import Made, Surface
from pyverlet.state.periodicity import NONE, Periodicity
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import EVERYONE, may_collide

Extent = tuple[float, float, float, float]


class Boundary(ABC):
    """Base class of rooms.

    Attributes:
        periodic: the periodicity of the room; none by default.
    """

    periodic: Periodicity = NONE
    seam: Any = Renamed("periodic")

    @abstractmethod
    def confine(self, state: SortedState, h: float, lag: float, rest_speed: float) -> None:
        """After a substep of h seconds, bounce or hold every circle that reaches beyond a wall.

        The core handles the rooms of this module itself, unless a derived class has its own `confine`.

        Args:
            state: the circles, in the engine's order.
            h: s.
            lag: seconds by which velocities are behind positions.
            rest_speed: m/s; slower arrivals are held.
        """

    @property
    def moves(self) -> bool:
        """Whether its walls may do work."""
        return False

    @property
    def bounces(self) -> bool:
        """Whether its walls reflect circles, so that arrivals must be distinguished from resting weight."""
        return bool(getattr(self, "restitution", 0.0) > 0.0)

    def facing(self, position: Array) -> tuple[Array, Array] | None:
        """(k, w) distance of centres (k, 2) from each of its walls, m, and (k, w, 2) the unit normal of each into the room."""
        return None

    def holds(self, category: ArrayLike, mask: ArrayLike) -> NDArray[np.bool_]:
        """(n,) or one bool, whether its walls hold particles of this category and mask, (n,) or one each."""
        return np.ones(np.shape(category), bool)

    def perimeter(self) -> float | None:
        """Length of its walls, m; None if unknown."""
        return None

    @abstractmethod
    def extent(self) -> Extent | None:
        """(x0, y0, x1, y1) of the room, m; None without walls."""

    @abstractmethod
    def outside(self, position: Array) -> Array:
        """(n,) bool, which of these centres are outside."""

    def put_in(self, position: Array, radius: Array) -> Array:
        """(n, 2) these positions, moved to the wall where a rim would stick out by more than STANDS_OUT; for new particles."""
        return position

    @abstractmethod
    def check(self, radius: Array) -> None:
        """Raise InputError if one of these circles does not fit."""


class Open(Boundary):
    """No walls."""

    def confine(self, state: SortedState, h: float, lag: float, rest_speed: float) -> None:
        pass

    def extent(self) -> None:
        return None

    def outside(self, position: Array) -> Array:
        return np.zeros(len(position), bool)

    def check(self, radius: Array) -> None:
        pass

    def __repr__(self) -> str:
        return "Open()"


class _Walls(Surface, Boundary):
    """Base class of rooms with walls."""

    def holds(self, category: ArrayLike, mask: ArrayLike) -> NDArray[np.bool_]:
        return may_collide(category, mask, self.category, self.mask)

    def _bodies(self, state: SortedState) -> tuple[tuple[Array, ...], Array, Array]:
        """Arguments of `core.own_walls`; circles that the walls do not hold count as pinned."""
        moving = state.position, state.velocity, state.acceleration, state.spin
        about = state.radius, np.ascontiguousarray(state.restitution), np.ascontiguousarray(state.friction)
        return (*moving, *about), held_by(self, state), state.wall_hits

    def _surface(self, turns: str = "") -> str:
        """The surface arguments for `repr`."""
        rolling = f", rolling_resistance={self.rolling_resistance:g}" if self.rolling_resistance else ""
        made = f", material={self.material!r}" if self.material else ""
        marks = "" if self.category == self.mask == EVERYONE else f", category={self.category}, mask={self.mask}"
        return f"restitution={self.restitution:g}, friction={self.friction:g}{rolling}{made}{turns}{marks}"

    def _law(self, h: float, lag: float, rest_speed: float, belt: float = 0.0) -> tuple[float, ...]:
        """The law arguments of `core.own_walls`; belt: speed of the surface, m/s."""
        return h, lag, self.restitution, self.friction, belt, rest_speed


def held_by(room: Boundary, state: SortedState) -> Array:
    """(n,) inverse masses, 1/kg, 0 for particles that the walls of a room do not hold."""
    marks = (state.category, state.mask) if len(state.category) else (1, EVERYONE)
    return np.where(room.holds(*marks), state.inverse_mass, state.real(0))


class Circle(_Walls):
    """A circular cage.

    Args:
        center: (x, y), m.
        radius: of the cage, m.
        angular_velocity: rad/s about its centre, counter-clockwise: a drum, whose wall drags particles along by friction.
        walls: restitution, friction and any other argument of `Surface`.
    """

    center = Checked(checks.vector)
    radius = Checked(checks.number, above=0.0)
    angular_velocity = Checked(checks.number)

    def __init__(
        self,
        *,
        center: Sequence[float] = (0.0, 0.0),
        radius: float,
        angular_velocity: float = 0.0,
        **walls: Unpack[Made],
    ) -> None:
        super().__init__(**walls)
        self.center, self.radius, self.angular_velocity = center, radius, angular_velocity

    @property
    def moves(self) -> bool:
        return self.angular_velocity != 0.0 and self.friction > 0.0

    def confine(self, state: SortedState, h: float, lag: float, rest_speed: float) -> None:
        law = self._law(h, lag, rest_speed, self.angular_velocity * self.radius)
        state.motion.confine_to_circle(*self.center, self.radius, *self._bodies(state), law)

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
        return f"Circle(center={self.center}, radius={self.radius:g}, {self._surface(turns)})"


class _Side(Checked[Value]):
    """A corner of a rectangle, above and to the right of the lower one; fixed if the room is periodic."""

    def __set__(self, owner: Any, value: Any) -> None:
        if owner.periodic:
            room = "world.boundary = pyverlet.Periodic(...)"
            raise InputError(f"{self._name} of a periodic room cannot be set; allowed is another room, {room}")
        given = vars(owner) | {self._name: self._check(self._name, value, **self._how)}
        if {"lower", "upper"} <= given.keys() and not all(map(float.__lt__, given["lower"], given["upper"])):
            where, other = ("below and to the left", "upper") if self._name == "lower" else ("above and to the right", "lower")
            raise InputError(f"{self._name} is {given[self._name]}; allowed is a corner {where} of {other}, {given[other]}")
        super().__set__(owner, value)


class _Rectangle(_Walls):
    """Base class of rooms between two corners."""

    lower = _Side(checks.vector)
    upper = _Side(checks.vector)

    def __init__(self, lower: Sequence[float], upper: Sequence[float], **walls: Unpack[Made]) -> None:
        super().__init__(**walls)
        self.lower, self.upper = lower, upper

    @property
    def _box(self) -> Extent:
        """Its walls; infinitely far away where it has none."""
        return self.extent()

    def confine(self, state: SortedState, h: float, lag: float, rest_speed: float) -> None:
        state.motion.confine_to_box(*self._box, *self._bodies(state), self._law(h, lag, rest_speed))

    def facing(self, position: Array) -> tuple[Array, Array] | None:
        """Distances and normals of the left wall, the right one, the floor and the ceiling, in this order."""
        (x, y), (x0, y0, x1, y1) = position.astype(np.float64).T, self._box
        into = np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
        return np.column_stack((x - x0, x1 - x, y - y0, y1 - y)), np.broadcast_to(into, (len(position), 4, 2))

    def extent(self) -> Extent:
        return (*self.lower, *self.upper)

    def outside(self, position: Array) -> Array:
        """Along periodic axes no position is outside: each has an image inside."""
        inside = (position >= self._box[:2]) & (position <= self._box[2:])
        return np.asarray(~inside.all(axis=1))

    def put_in(self, position: Array, radius: Array) -> Array:
        low, high, where = self._box[:2], self._box[2:], self.periodic.wrapped(np.ascontiguousarray(position))
        inside = np.clip(where, low + radius[:, None], high - radius[:, None])
        out = np.abs(inside - where) > STANDS_OUT * radius[:, None]
        return np.where(out, inside.astype(position.dtype), where)


class Box(_Rectangle):
    """A rectangular room.

    Args:
        lower: (x0, y0), the lower left corner, m.
        upper: (x1, y1), the upper right corner, m.
        walls: restitution, friction and any other argument of `Surface`.
    """

    def perimeter(self) -> float:
        return 2 * (self.upper[0] - self.lower[0] + self.upper[1] - self.lower[1])

    def check(self, radius: Array) -> None:
        half = 0.5 * min(self.upper[0] - self.lower[0], self.upper[1] - self.lower[1])
        _fits(radius, half, f"half the shorter side of the box, {half:g} m")

    def __repr__(self) -> str:
        return f"Box({self.lower}, {self.upper}, {self._surface()})"


def _axes(name: str, value: Any) -> str:
    return checks.choice(name, value, ("xy", "x", "y"))


class Periodic(_Rectangle):
    """A periodic room: particles that leave on one side enter on the other, and circles collide across the boundary.

    Positions are those inside the room. Distances in contacts, links, forces between particles and to points, and queries are
    those to the nearest image.

    Args:
        lower: (x0, y0), the lower left corner, m.
        upper: (x1, y1), the upper right corner, m.
        axes: the periodic directions: "xy", or "x" or "y" alone, with walls in the other direction.
        walls: restitution, friction and any other argument of `Surface`, for walls if there are any.

    Raises:
        InputError: an argument is outside what is allowed; from `World.add`, a circle is larger than half a period.
    """

    axes = _Side(_axes)

    def __init__(
        self,
        lower: Sequence[float],
        upper: Sequence[float],
        *,
        axes: str = "xy",
        **walls: Unpack[Made],
    ) -> None:
        super().__init__(lower, upper, **walls)
        self.axes = axes
        (x0, y0), (x1, y1) = self.lower, self.upper
        self.periodic = Periodicity(x0, y0, x1 - x0 if "x" in axes else 0.0, y1 - y0 if "y" in axes else 0.0)

    @property
    def _box(self) -> Extent:
        (x0, y0, x1, y1), far, tall = self.extent(), "x" in self.axes, "y" in self.axes
        return -np.inf if far else x0, -np.inf if tall else y0, np.inf if far else x1, np.inf if tall else y1

    def facing(self, position: Array) -> tuple[Array, Array] | None:
        return None if self.axes == "xy" else super().facing(position)

    def perimeter(self) -> float | None:
        """Length of its walls, m; None without any."""
        return {"x": 2 * self.periodic.period_x, "y": 2 * self.periodic.period_y, "xy": None}[self.axes]

    def check(self, radius: Array) -> None:
        quarter = 0.25 * self.periodic.shortest
        _fits(radius, quarter, f"a quarter of the room's period, {quarter:g} m")
        if self.axes != "xy":
            half = 0.5 * (self.upper[1] - self.lower[1] if self.axes == "x" else self.upper[0] - self.lower[0])
            _fits(radius, half, f"half the distance of the walls, {half:g} m")

    def __repr__(self) -> str:
        walls = "" if self.axes == "xy" else f", axes={self.axes!r}, {self._surface()}"
        return f"Periodic({self.lower}, {self.upper}{walls})"


def _fits(radius: Array, room: float, room_is: str) -> None:
    # The tolerance covers the dtype's rounding of an exact fit.
    wrong = radius > room * (1 + 1e-6)
    if wrong.any():
        first = int(np.flatnonzero(wrong)[0])
        raise InputError(f"radius[{first}] is {radius[first]:g} m; allowed is at most {room_is}")
