"""Settings of worlds that may be changed while they run: read, set, and those in which worlds side by side differ."""

from __future__ import annotations

import contextlib
import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from pyverlet.ground.errors import InputError
from pyverlet.laws import integrators
from pyverlet.viewers.commands import (
    Command,
    SetFriction,
    SetGravity,
    SetIntegrator,
    SetRestitution,
    SetSubsteps,
    Setting,
)

if TYPE_CHECKING:
    from pyverlet.world.world import World

SETTINGS: tuple[Any, ...] = (SetGravity, SetSubsteps, SetRestitution, SetFriction, SetIntegrator)


def read(world: World) -> dict[str, Any]:
    """What the world's settings are, by name; None for what it has not: no collisions and no walls have no friction."""
    integrator = type(world.integrator)
    return {
        "gravity": tuple(map(float, world.gravity)),
        "substeps": int(world.substeps),
        "restitution": _of_surfaces(world, "restitution"),
        "friction": _of_surfaces(world, "friction"),
        "integrator": integrator.name() if integrators.BY_NAME.get(integrator.name()) is integrator else world.integrator.label,
    }


def differing(worlds: Sequence[World]) -> tuple[str, ...]:
    """Names of the settings in which the worlds differ: what they are side by side for, so that these stay as they are."""
    all_of_them = [read(world) for world in worlds]
    return tuple(name for name in all_of_them[0] if len({settings[name] for settings in all_of_them}) > 1)


def change(world: World, command: Setting) -> None:
    """Change one setting of the world."""
    match command:
        case SetGravity(x, y):
            world.gravity = (x, y)
        case SetSubsteps(value):
            world.substeps = value
        case SetRestitution(value):
            _set_surfaces(world, "restitution", value)
        case SetFriction(value):
            _set_surfaces(world, "friction", value)
        case SetIntegrator(name):
            world.integrator = integrators.BY_NAME[name]()


def present(world: World) -> list[Command]:
    """The commands that would give another world the settings of this one, as far as a viewer may set them."""
    values = read(world)
    commands: list[Command] = []
    for kind in SETTINGS:
        value = values[kind.__name__.removeprefix("Set").lower()]
        with contextlib.suppress(InputError):  # beyond what a viewer may set, or the world has no such setting
            commands.append(kind(*value) if isinstance(value, tuple) else kind(value))
    return commands


def _of_surfaces(world: World, name: str) -> float | None:
    if world.collisions is not None:
        return float(getattr(world.collisions, name))
    value = getattr(world.boundary, name, None)
    return None if value is None else float(value)


def _set_surfaces(world: World, name: str, value: float) -> None:
    if world.collisions is not None:
        changes: dict[str, Any] = {name: value}
        world.collisions = dataclasses.replace(world.collisions, **changes)
    room = getattr(world.boundary, "room", world.boundary)  # the naive bounds have theirs inside
    if hasattr(world.boundary, name):
        setattr(room, name, value)
