"""Checks: a name, a function that measures one guarantee, and its size; and helpers for several checks."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.errors import NonFiniteError
from pyverlet.laws.boundaries import Boundary
from pyverlet.laws.collisions import Collisions
from pyverlet.world.world import World


@dataclass(frozen=True)
class Result:
    """The result of a check."""

    asked: str  # the guarantee, with numbers
    measured: str  # the outcome, in words
    passed: bool  # whether the guarantee holds
    values: Mapping[str, float] = field(default_factory=dict)  # the numbers in `measured`, by name
    name: str = ""  # of the check
    seconds: float = 0.0  # duration


@dataclass(frozen=True)
class Check:
    """One guarantee of the physics."""

    name: str  # on the command line
    measure: Callable[..., Result]  # measures it
    settings: Mapping[str, Any] = field(default_factory=dict)  # arguments of `measure`
    full: Mapping[str, Any] = field(default_factory=dict)  # arguments that differ in the full run, of the guaranteed size

    @property
    def summary(self) -> str:
        """The first line of the measuring function's docstring."""
        return (self.measure.__doc__ or "").partition("\n")[0]

    def run(self, *, full: bool = False) -> Result:
        """Measure. A world that becomes non-finite is a failure, not an error."""
        start = perf_counter()
        try:
            result = self.measure(**{**self.settings, **(self.full if full else {})})
        except NonFiniteError as error:
            result = Result(self.summary, str(error), False)
        return replace(result, name=self.name, seconds=perf_counter() - start)


G = 9.81  # gravity, m/s^2
DT = 1 / 60  # length of a frame, s
RADIUS = 0.5  # of a circle, m, except in checks of sizes


def circles(place: Array, boundary: Boundary, *, velocity: Any = 0.0, e: float = 0.0, mu: float = 0.0, **settings: Any) -> World:
    """A world of circles (n, 2) of the usual size in a room; e and mu are theirs, `settings` of `World`."""
    world = World(boundary=boundary, collisions=Collisions(restitution=e, friction=mu), **settings)
    world.add(position=place, velocity=velocity, radius=RADIUS)
    return world


def directions(angle: Array) -> Array:
    """(n, 2) unit vectors in these directions (n,), rad."""
    return np.column_stack((np.cos(angle), np.sin(angle)))


def frames(world: World, seconds: float) -> Iterator[int]:
    """Step the world through `seconds`, yielding the frame number after each frame."""
    for number in range(1, round(seconds / DT) + 1):
        world.step(DT)
        yield number


def columns(count: int, width: float, pitch: float) -> Array:
    """(count, 2) points of a square lattice of `pitch` (m), row by row from y = 0 up, centred on x = 0."""
    across = max(1, int(width / pitch))
    row, column = np.divmod(np.arange(count), across)
    return np.column_stack(((column - (across - 1) / 2) * pitch, (row + 0.5) * pitch))


def in_disc(count: int, radius: float, pitch: float) -> Array:
    """(count, 2) points of a square lattice of `pitch` (m), those nearest to the centre of a disc of this radius (m)."""
    axis = np.arange(-np.ceil(radius / pitch), np.ceil(radius / pitch) + 1) * pitch
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    nearest = np.argsort(np.hypot(*points.T), kind="stable")[:count]
    return np.asarray(points[nearest])


def agitation(world: World) -> float:
    """Kinetic energy per particle over m g R; 1 corresponds to a fall through one radius."""
    free = np.isfinite(world.mass)
    return world.energy().kinetic / float((world.mass[free].astype(float) * G * world.radius[free]).sum())


def fastest(world: World) -> float:
    """The largest speed, m/s."""
    return float(np.hypot(*world.velocity.T).max())
