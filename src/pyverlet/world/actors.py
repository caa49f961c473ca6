"""Actors change a world before each frame: emitters add particles, sinks remove them.

A new actor derives from `Actor` and implements `act`, and `after` if needed; `save` and `restore` if it has state.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.errors import InputError
from pyverlet.common.lists import CheckedList
from pyverlet.common.shown import Shown
from pyverlet.laws.boundaries import Boundary, Box, Circle
from pyverlet.world.queries import free_in_order, on_top

if TYPE_CHECKING:
    from pyverlet.world.world import World

_PLACES = 33
"""Sample points along a path at which a sink tests a user-defined region."""

_TRIES = 4
"""Candidate positions an emitter tries for each particle that is due."""


class Actor(Shown, ABC):
    """Base class of objects that act on a world once per frame; append one to `world.actors`."""

    @abstractmethod
    def act(self, world: World, dt: float) -> None:
        """Called before a frame of dt seconds. It may change the world, including its list of actors.

        Actors removed before their turn do not act; actors added now act from the next frame on.
        """

    def after(self, world: World, dt: float) -> None:
        """Called after a frame of dt seconds that succeeded."""

    def save(self) -> Any:
        """The state that `restore` needs to continue as from now; part of `world.save()`."""
        return None

    def restore(self, saved: Any) -> None:
        """Go back to the state that `save` returned."""

    def of(self, world: World) -> Actor:
        """The actor to use in this world: itself, or a copy if its state belongs to another world."""
        return self


class Actors(CheckedList[Actor]):
    """The list type of `world.actors`."""

    def check_one(self, thing: Any) -> None:
        if isinstance(thing, type) or not callable(getattr(thing, "act", None)):
            raise InputError(f"actor is {thing!r}; allowed is an object of a class derived from pyverlet.Actor, such as a Sink")


def have_own(world: World) -> None:
    """Replace actors whose state belongs to another world by copies of their own."""
    for place, actor in enumerate(world.actors):
        if isinstance(actor, Actor):
            world.actors[place] = actor.of(world)


def act_once(world: World, dt: float) -> None:
    """Call each actor listed now once, in order, unless an earlier one removes it; actors added meanwhile wait."""
    have_own(world)
    for place, actor in enumerate(tuple(world.actors)):
        actors = world.actors
        # The list rarely changes meanwhile, and searching it for each actor would cost n^2.
        if (place < len(actors) and actors[place] is actor) or any(listed is actor for listed in actors):
            actor.act(world, dt)


def act_after(world: World, dt: float) -> None:
    """Call `after` of each actor once the frame has ended."""
    for actor in tuple(world.actors):
        if isinstance(actor, Actor):
            actor.after(world, dt)


def _mouth(name: str, value: Any) -> Box | Circle:
    """Check the region in which an emitter places particles."""
    if not isinstance(value, Box | Circle):
        raise InputError(f"{name} is {value!r}; allowed is a pyverlet.Box or a pyverlet.Circle")
    return value


def _sizes(name: str, value: Any) -> tuple[float, float]:
    """The smallest and largest radius, m, from one number or two."""
    low, high = value if isinstance(value, tuple) and len(value) == 2 else (value, value)
    return checks.number(name, low, above=0.0), checks.number(name, high, least=low)


def _area(name: str, value: Any) -> Boundary:
    """Check that a region can tell inside from outside."""
    if not isinstance(value, Boundary):
        raise InputError(f"{name} is {value!r}; allowed is an object such as pyverlet.Box((0, 0), (1, 1))")
    return value


class Emitter(Actor):
    """Adds particles at random free places of a region; while there is no room, it waits.

    Args:
        region: Box or Circle that contains the new particles completely.
        rate: particles per second.
        velocity: (x, y) initial velocity, m/s.
        radius: m, or (smallest, largest) of a uniform distribution.
        mass: kg; 1 unless a density is given.
        density: kg/m^2, instead of the mass: mass = density pi radius^2.
        most: limit on the number of particles; None for no limit.
        seed: seed of the random places; the same seed gives the same places.

    Attributes:
        emitted: particles emitted so far.
    """

    _shows = ("region", "rate", "emitted")

    region = Checked(_mouth)
    rate = Checked(checks.number, least=0.0, most=1e7)
    velocity = Checked(checks.vector)
    radius = Checked(_sizes)
    mass: Checked[float | None] = Checked(checks.number, above=0.0, none=True)
    density: Checked[float | None] = Checked(checks.number, above=0.0, none=True)
    most: Checked[int | None] = Checked(checks.integer, least=0, none=True)

    def __init__(
        self,
        region: Box | Circle,
        *,
        rate: float,
        velocity: Sequence[float] = (0.0, 0.0),
        radius: float | tuple[float, float] = 0.5,
        mass: float | None = None,
        density: float | None = None,
        most: int | None = None,
        seed: int = 0,
    ) -> None:
        self.region, self.rate, self.velocity = region, rate, velocity
        self.radius, self.most, self.density = radius, most, density
        self.region.check(np.array([self.radius[1]]))
        if mass is not None and density is not None:
            raise InputError(f"density is {density!r} and mass is {mass!r}; allowed is one of them, not both")
        self.mass = 1.0 if mass is None and density is None else mass
        self._rng = np.random.default_rng(checks.integer("seed", seed, least=0))
        self._due = 0.0
        self.emitted = 0

    def act(self, world: World, dt: float) -> None:
        # Missed particles are not made up for: a blocked emitter does not burst when it becomes free.
        self._due = min(self._due + self.rate * dt, 1.0 + self.rate * dt)
        wanted = int(self._due) if self.most is None else min(int(self._due), self.most - self.emitted)
        if wanted <= 0:
            return
        places, sizes = self._draw(_TRIES * wanted)
        allowed = world.is_free(places)
        places, sizes, near = places[allowed], sizes[allowed], self._near(world)
        position, radius = np.concatenate((world.position[near], places)), np.concatenate((world.radius[near], sizes))
        pairs = on_top(position, radius, len(near), world.boundary.periodic) - (len(near), 0)
        taken = np.flatnonzero(free_in_order(pairs, len(near), np.ones(len(places), bool)))[:wanted]
        if found := len(taken):
            weight = {"mass": self.mass, "density": self.density}
            world.add(position=places[taken], velocity=self.velocity, radius=sizes[taken], **weight)  # type: ignore[arg-type]
            self.emitted += found
            self._due -= found

    def save(self) -> Any:
        return self._due, self.emitted, self._rng.bit_generator.state

    def restore(self, saved: Any) -> None:
        self._due, self.emitted, self._rng.bit_generator.state = saved

    def _draw(self, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Random places (count, 2) in the region, m, and radii (count,)."""
        sizes = self._rng.uniform(*self.radius, count)
        if isinstance(self.region, Circle):
            # Uniform over the area: the square of the distance from the centre is uniform.
            distance = np.sqrt(self._rng.uniform(0, 1, count)) * (self.region.radius - sizes)
            angle = self._rng.uniform(0, 2 * np.pi, count)
            offset = distance[:, None] * np.column_stack((np.cos(angle), np.sin(angle)))
            return np.asarray(self.region.center + offset), sizes
        lower, upper = np.asarray(self.region.lower), np.asarray(self.region.upper)
        room = np.maximum(upper - lower - 2 * sizes[:, None], 0)
        return lower + sizes[:, None] + self._rng.uniform(0, 1, (count, 2)) * room, sizes

    def _near(self, world: World) -> NDArray[np.intp]:
        """Indices of the world's particles that may reach into the region."""
        x0, y0, x1, y1 = self.region.extent()
        middle = np.array(((x0 + x1) / 2, (y0 + y1) / 2))
        (x, y), r = (middle + world.boundary.periodic.nearest(world.position - middle)).T, world.radius
        return np.flatnonzero((x + r > x0) & (x - r < x1) & (y + r > y0) & (y - r < y1))


class Sink(Actor):
    """Removes particles whose centre is in a region before a frame, or crossed it in a straight line during the frame.

    Args:
        region: Box, Circle or a boundary of your own.
        outside: remove particles outside the region instead, such as those that have left the scene.

    Attributes:
        removed: particles removed so far.
    """

    _shows = ("region", "outside", "removed")

    region = Checked(_area)
    outside = Checked(checks.flag)

    def __init__(self, region: Boundary, *, outside: bool = False) -> None:
        self.region, self.outside = region, outside
        self.removed = 0
        self._start = np.empty(0, np.int64), np.empty((0, 2))  # particle numbers and positions at the start of the frame

    def act(self, world: World, dt: float) -> None:
        self._remove(world, np.flatnonzero(self._takes(world.position)))
        self._start = world.number.copy(), world.position.copy()

    def after(self, world: World, dt: float) -> None:
        number, start = self._start
        if not len(number) or not len(world):
            return
        where = np.searchsorted(number, world.number).clip(max=len(number) - 1)
        known = np.flatnonzero(number[where] == world.number)
        start, end = start[where[known]].astype(float), world.position[known].astype(float)
        way = world.boundary.periodic.nearest(end - start)
        crossed = self._crossed(start, start + way)
        if world.boundary.periodic:  # the part of the path beyond the periodic boundary
            crossed |= self._crossed(end - way, end)
        crossed &= ~self._takes(end)  # these are removed before the next frame
        self._remove(world, known[crossed])

    def forget(self, numbers: NDArray[np.int64]) -> None:
        """Ignore the displacement of particles that were moved by the user since the frame began."""
        known, start = self._start
        others = ~np.isin(known, numbers)
        self._start = known[others], start[others]

    def _remove(self, world: World, gone: NDArray[np.intp]) -> None:
        if len(gone):
            world.remove(gone)
            self.removed += len(gone)

    def _takes(self, position: NDArray[Any]) -> NDArray[np.bool_]:
        """Which of these centres are where particles are removed."""
        outside = self.region.outside(position)
        return np.asarray(outside if self.outside else ~outside)

    def _crossed(self, start: NDArray[Any], end: NDArray[Any]) -> NDArray[np.bool_]:
        """Which of the straight paths from `start` (n, 2) to `end`, m, pass through places where particles are removed."""
        crossed = np.zeros(len(start), bool)
        if self.outside and type(self.region) in (Box, Circle):
            return crossed  # convex: paths between points inside stay inside
        extent = self.region.extent()
        may = (start != end).any(axis=1)
        if extent is not None and not self.outside:
            low, high = np.array(extent[:2]), np.array(extent[2:])
            may &= ((np.minimum(start, end) <= high) & (np.maximum(start, end) >= low)).all(axis=1)
        rows = np.flatnonzero(may)
        p, way = start[rows], end[rows] - start[rows]
        if type(self.region) is Box:
            with np.errstate(divide="ignore", invalid="ignore"):
                one, other = (low - p) / way, (high - p) / way
            # An axis-parallel path never enters or leaves across the other pair of sides; rows outside them are already excluded.
            enters = np.where(way == 0, 0.0, np.minimum(one, other)).max(axis=1, initial=0.0)
            leaves = np.where(way == 0, 1.0, np.maximum(one, other)).min(axis=1, initial=1.0)
            crossed[rows] = enters <= leaves
        elif type(self.region) is Circle:
            to = np.asarray(self.region.center) - p
            t = ((to * way).sum(axis=1) / (way * way).sum(axis=1)).clip(0, 1)
            crossed[rows] = np.hypot(*(to - t[:, None] * way).T) <= self.region.radius
        else:
            for t in np.linspace(0, 1, _PLACES):
                crossed[rows] |= self._takes(p + t * way)
        return crossed

    def save(self) -> Any:
        return self.removed

    def restore(self, saved: Any) -> None:
        self.removed = saved
