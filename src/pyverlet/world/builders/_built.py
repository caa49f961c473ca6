"""What builders return, and what they share."""

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
"""Radius of linked particles in terms of their spacing: neighbours all but touch, nothing gets through."""


@dataclass(frozen=True, repr=False)
class Built(Shown):
    """Particles and links.

    Attributes:
        group: the particles.
        links: what was appended to `world.links`.
    """

    _shows = ("group", "links")

    group: Group
    links: tuple[Link, ...]


@dataclass(frozen=True, repr=False)
class Sheet(Built):
    """Particles in rows.

    Attributes:
        grid: (rows, columns) indices in the group, row 0 on top: `sheet.group.pin(sheet.grid[0])` hangs it by its upper edge.
    """

    grid: NDArray[np.int64]


Arguments = ParamSpec("Arguments")
Made = TypeVar("Made")


def builder(build: Callable[Arguments, Made]) -> Callable[Arguments, Made]:
    """Refuse arguments that neither a builder has nor `World.add`, to which the others go."""

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
    """Particles that weigh `mass` together; their radius unless given is RIM of the spacing."""
    each = checks.number("mass", mass, above=0.0) / len(position)
    return world.add(position=position, radius=RIM * spacing if radius is None else radius, mass=each, **particles)


def weight(world: World, mass: float) -> float:
    """m g, N; standard gravity in a world without any."""
    return mass * (float(np.hypot(*world.gravity)) or float(np.hypot(*STANDARD_GRAVITY)))
