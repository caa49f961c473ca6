"""Result types and helpers that all builders share."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.constants import STANDARD_GRAVITY
from pyverlet.common.errors import InputError
from pyverlet.common.shown import Shown
from pyverlet.laws.links import Link
from pyverlet.state.group import Group

if TYPE_CHECKING:
    from pyverlet.world.world import World

Point = Sequence[float] | NDArray[np.float64]

RIM = 0.49
"""Radius of linked particles over their spacing: neighbours almost touch, so that nothing gets through."""


@dataclass(frozen=True, repr=False)
class Built(Shown):
    """Particles and links made by a builder.

    Attributes:
        group: the particles.
        links: the links appended to `world.links`.
    """

    _shows = ("group", "links")

    group: Group
    links: tuple[Link, ...]


@dataclass(frozen=True, repr=False)
class Sheet(Built):
    """Particles in rows and columns, with their links.

    Attributes:
        grid: (rows, columns) indices in the group, row 0 on top: `sheet.group.pin(sheet.grid[0])` fixes the upper edge.
    """

    grid: NDArray[np.int64]


Arguments = ParamSpec("Arguments")
Made = TypeVar("Made")


def builder(build: Callable[Arguments, Made]) -> Callable[Arguments, Made]:
    """Decorator: refuse keyword arguments known neither to the builder nor to `World.add`, which receives the rest."""

    @functools.wraps(build)
    def checked(*arguments: Arguments.args, **named: Arguments.kwargs) -> Made:
        from pyverlet.world.particles import Particles

        own, others = inspect.signature(build).parameters, inspect.signature(Particles.add).parameters
        known = own.keys() | (others.keys() - {"self", "position", "radius", "mass"}) - {"particles"}
        if unknown := sorted(named.keys() - known):
            allowed = (
                f"allowed are {', '.join(name for name in own if name not in ('world', 'particles'))}, and what World.add takes"
            )
            raise InputError(f"{build.__name__} has no argument {unknown[0]!r}; {allowed}")
        return build(*arguments, **named)

    return checked


def add(
    world: World, position: NDArray[np.float64], spacing: float, radius: float | None, mass: float, **particles: Any
) -> Group:
    """Add particles whose total mass is `mass`; their radius defaults to RIM times the spacing."""
    each = checks.number("mass", mass, above=0.0) / len(position)
    return world.add(position=position, radius=RIM * spacing if radius is None else radius, mass=each, **particles)


def weight(world: World, mass: float) -> float:
    """The weight m g, N; with standard gravity if the world has none."""
    return mass * (float(np.hypot(*world.gravity)) or float(np.hypot(*STANDARD_GRAVITY)))
