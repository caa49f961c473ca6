"""The base class of obstacles: a surface, and a motion that nothing can stop."""

from __future__ import annotations

import functools
import itertools
import threading
import weakref
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, SupportsIndex, TypeVar

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.errors import InputError
from pyverlet.common.lists import CheckedList
from pyverlet.common.shown import listed
from pyverlet.laws.surface import Surface

_DASHES = 12
"""Number of dashes of a sensor's outline."""

_MOTION = ("pivot", "angle", "velocity", "angular_velocity")
"""Attributes of place and motion; all others belong to the surface."""

_FILTERS = ("category", "mask", "one_way", "sensor")
"""Attributes that decide which particles it holds."""

_ARROW = 0.03
"""Half width of the arrow at a one-way line, over the line's length."""

Points = NDArray[np.float64]


class _Journal:
    """A journal of recent changes of obstacles, so that worlds need not check thousands of them in each frame.

    Attributes:
        latest: number of the last change.
    """

    def __init__(self) -> None:
        self.latest = 0
        self._entries: deque[int] = deque(maxlen=4096)
        self._lock = threading.Lock()

    def note(self, obstacle: object) -> int:
        """Record a change of an obstacle; returns its number."""
        with self._lock:
            self.latest += 1
            self._entries.append(id(obstacle))
            return self.latest

    def since(self, number: int) -> tuple[int, set[int] | None]:
        """The latest change number, and the ids of obstacles changed after `number`; None: too long ago."""
        with self._lock:
            fresh = self.latest - number
            known = fresh <= len(self._entries)
            return self.latest, set(itertools.islice(reversed(self._entries), fresh)) if known else None


journal = _Journal()
"""The journal of all obstacles of this process."""


class Outline(NamedTuple):
    """A line to draw, in metres."""

    points: Points
    """(n, 2)"""
    filled: bool
    """Whether the line is closed and filled."""


class Parts(NamedTuple):
    """The rounded segments of a shape: a line through points with a thickness of `rounding` about it."""

    points: Points
    closed: bool
    rounding: float
    convex: bool
    """Whether it is a closed line, counter-clockwise, with a solid inside."""
    around: bool
    """Whether a moving surface runs counter-clockwise around the shape instead of along the line."""


class Obstacle(Surface, ABC):
    """Base class of obstacles, which hold particles.

    Args:
        points: (n, 2) corners, m.
        surface_speed: of a conveyor belt, m/s, never along a normal. Segments and chains carry along their points, on both sides;
            discs, capsules and polygons counter-clockwise around themselves.
        velocity: (x, y), m/s; nothing stops it.
        angular_velocity: rad/s about its pivot, counter-clockwise.
        pivot: (x, y), m; None for the middle of its points.
        sensor: hold nothing, and record in `events` which of the particles that it would hold begin and end to touch it.
        made: restitution, friction and any other argument of `Surface`.

    All of them may be set while the world runs. `pivot` and `angle` are its current place; setting them moves it there without
    pushing particles.
    """

    surface_speed = Checked(checks.number)
    velocity = Checked(checks.vector)
    angular_velocity = Checked(checks.number)
    pivot = Checked(checks.vector)
    angle = Checked(checks.number)
    sensor = Checked(checks.flag)
    one_way: tuple[float, float] | None = None
    """Direction in which it is passable, in its frame at angle 0; None: solid."""
    table: Any = None
    """Its segments in the engine's form, made when it first enters a world."""
    _home: Any = None
    """A weak reference to its list: in two worlds it would move twice as fast."""
    resurfaced = -1
    """Journal number of the last change of its surface; -1 during construction, when no world knows it."""
    refiltered = -1
    """Journal number of the last change of its filters; -1: none since construction."""

    def __init__(
        self,
        points: Points,
        *,
        surface_speed: float = 0.0,
        velocity: Sequence[float] = (0.0, 0.0),
        angular_velocity: float = 0.0,
        pivot: Sequence[float] | None = None,
        sensor: bool = False,
        **made: Any,
    ) -> None:
        super().__init__(**made)
        self.surface_speed, self.velocity, self.angular_velocity = surface_speed, velocity, angular_velocity
        self.pivot = points.sum(axis=0) / len(points) if pivot is None else pivot
        self.angle = 0.0
        self.sensor = sensor
        self._local: Points = np.subtract(points, self.pivot)
        self._drawn_at: Any = None
        self._drawn: list[Outline] = []
        self.resurfaced = journal.latest

    def _changed(self, name: str) -> None:
        if self.resurfaced >= 0:
            number = journal.note(self)
            self.resurfaced = self.resurfaced if name in _MOTION else number
            self.refiltered = number if name in _FILTERS else self.refiltered

    def __getstate__(self) -> dict[str, Any]:
        left = ("table", "resurfaced", "refiltered", "_home", "_drawn_at", "_drawn")  # caches of this process
        return {name: value for name, value in vars(self).items() if name not in left}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _drawn_at=None, _drawn=[], resurfaced=journal.latest)

    @property
    def _is_made(self) -> bool:
        """Whether its shape is final."""
        return self.resurfaced >= 0

    @property
    def points(self) -> Points:
        """(n, 2) current corners, m; a copy."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        return np.asarray(self._local @ np.array([[c, s], [-s, c]]) + self.pivot)

    @points.setter
    def points(self, value: Any) -> None:
        allowed = "allowed are pivot and angle, or a new one in its place"
        raise InputError(f"points of a {type(self).__name__} cannot be set; {allowed}")

    @property
    def moves(self) -> bool:
        """Whether it has a velocity."""
        return self.velocity != (0.0, 0.0) or self.angular_velocity != 0.0

    @abstractmethod
    def outlines(self) -> list[Outline]:
        """Lines to draw at its current place."""

    @abstractmethod
    def _parts(self) -> Parts:
        """Its parts relative to the pivot at angle 0."""

    def carry(self, pivot: tuple[float, float], angle: float) -> None:
        """Move it by its own motion: unlike setting pivot and angle, this is not recorded as a change."""
        self.__dict__.update(pivot=pivot, angle=angle)

    def drawn(self) -> list[Outline]:
        """As `outlines`, with dashes for a sensor and an arrow for a one-way line; cached while it does not move."""
        where = (self.pivot, self.angle, self.sensor, self.one_way)
        if where != self._drawn_at:
            lines = self.outlines()
            if self.sensor:
                lines = [dash for outline in lines for dash in _dashes(outline)]
            elif self.one_way is not None:
                lines = [*lines, _arrow(self.points, self.one_way, self.angle)]
            self._drawn_at, self._drawn = where, lines
        return self._drawn

    def __repr__(self) -> str:
        x, y = self.pivot
        return f"{type(self).__name__} at ({x:g}, {y:g}) m"


def _dashes(outline: Outline) -> list[Outline]:
    """Every other part of an outline."""
    points = np.concatenate((outline.points, outline.points[:1])) if outline.filled else outline.points
    gone = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))))
    ends = np.linspace(0.0, gone[-1], 2 * _DASHES).reshape(-1, 2)
    x, y = (np.interp(ends, gone, column) for column in points.T)
    return [Outline(dash, filled=False) for dash in np.stack((x, y), axis=-1)]


def _arrow(points: Points, way: tuple[float, float], angle: float) -> Outline:
    """An arrow in the middle of a line through points, in the direction in which particles pass."""
    c, s = np.cos(angle), np.sin(angle)
    along = np.array([c * way[0] - s * way[1], s * way[0] + c * way[1]]) / np.hypot(*way)
    across = np.array([-along[1], along[0]])
    size = _ARROW * float(np.ptp(points, axis=0).max())
    k = (len(points) - 1) // 2
    middle = 0.5 * (points[k] + points[k + 1])
    return Outline(middle + size * np.array([-across, 2 * along, across]), filled=False)


AnyObstacle = TypeVar("AnyObstacle", bound=Obstacle)


_versions = itertools.count(1)

_MOST_REMOVED = 32
"""Most single removals to track; beyond it comparing the lists is faster."""


class Obstacles(CheckedList[Obstacle]):
    """The list type of `world.obstacles`.

    Attributes:
        version: increases with every change of the list.
        reordered: version of the last change other than appending obstacles or removing single ones.
        removed: version and index of each removal since then.
    """

    version = reordered = 0

    def __init__(self, obstacles: Iterable[Obstacle] = ()) -> None:
        super().__init__(obstacles)
        self.version = self.reordered = next(_versions)
        self.removed: list[tuple[int, int]] = []
        self._drawn: list[list[Outline]] = []
        self._outlines: list[Outline] = []

    def __repr__(self) -> str:
        return listed("obstacle", self)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (), None, iter(self)

    if TYPE_CHECKING:

        def append(self, thing: AnyObstacle) -> AnyObstacle: ...  # type: ignore[override]

    def check_one(self, thing: Any) -> None:
        if not isinstance(thing, Obstacle):
            allowed = "allowed is an object such as pyverlet.Disc((0, 0), 1) or pyverlet.Segment((0, 0), (1, 0))"
            raise InputError(f"obstacle is a {type(thing).__name__}; {allowed}")
        home = thing._home and thing._home()
        if thing.moves and home is not None and home is not self and any(each is thing for each in home):
            raise InputError(f"obstacle {thing!r} moves, and is one of another world; allowed is a copy of it, by copy.copy")
        thing._home = weakref.ref(self)

    def extend(self, things: Iterable[Obstacle]) -> None:
        super().extend(things)
        self.version = next(_versions)

    def pop(self, index: SupportsIndex = -1) -> Obstacle:
        """Remove the obstacle of this index, by default the last; returns it."""
        thing = super().pop(index)
        self.version = next(_versions)
        self.removed.append((self.version, range(len(self) + 1)[index]))
        if len(self.removed) > _MOST_REMOVED:
            self.reordered = self.version
            self.removed.clear()
        return thing

    def remove(self, thing: Obstacle) -> None:
        """Remove an obstacle, the first if it is listed twice; ValueError if it is not there."""
        self.pop(self.index(thing))

    def __delitem__(self, where: Any) -> None:
        if isinstance(where, slice):
            left = self[:]
            del left[where]
            self[:] = left
        else:
            self.pop(where)

    def outlines(self) -> list[Outline]:
        """Lines to draw all of them at their current places, m; cached while nothing moves."""
        drawn = [obstacle.drawn() for obstacle in self]
        if len(drawn) != len(self._drawn) or any(a is not b for a, b in zip(drawn, self._drawn, strict=True)):
            self._drawn = drawn
            self._outlines = [outline for outlines in drawn for outline in outlines]
        return self._outlines

    def save(self) -> list[tuple[Obstacle, tuple[float, float], float]]:
        """The obstacles and their places."""
        return [(obstacle, obstacle.pivot, obstacle.angle) for obstacle in self]

    def restore(self, saved: list[tuple[Obstacle, tuple[float, float], float]]) -> None:
        """Set the obstacles and places that `save` returned."""
        self[:] = [obstacle for obstacle, _, _ in saved]
        for obstacle, pivot, angle in saved:
            obstacle.pivot, obstacle.angle = pivot, angle


def _changing(method: Any) -> Any:
    """Wrap a method of lists that changes them."""

    @functools.wraps(method)
    def changed(self: Obstacles, *args: Any, **options: Any) -> Any:
        try:
            return method(self, *args, **options)
        finally:
            self.version = self.reordered = next(_versions)
            self.removed.clear()

    return changed


for _name in ("insert", "clear", "sort", "reverse", "__setitem__", "__imul__"):
    setattr(Obstacles, _name, _changing(getattr(CheckedList, _name)))
