"""Reads and changes settings of worlds while they run, and finds those in which worlds side by side differ."""

import contextlib
from collections.abc import Sequence
from typing import Any, get_args

from pyverlet.common.errors import InputError
from pyverlet.laws import integrators
from pyverlet.scenes._scene import set_on_world
from pyverlet.viewers import commands
from pyverlet.viewers.commands import Command, Setting, name_of
from pyverlet.world.world import World


def read(world: World) -> dict[str, Any]:
    """Settings of the world by name; None where they do not apply, such as friction without collisions and walls."""
    integrator = type(world.integrator)
    return {
        "gravity": tuple(map(float, world.gravity)),
        "substeps": int(world.substeps),
        "restitution": _of_surfaces(world, "restitution"),
        "friction": _of_surfaces(world, "friction"),
        "integrator": integrator.name() if integrators.BY_NAME.get(integrator.name()) is integrator else world.integrator.label,
    }


def differing(worlds: Sequence[World]) -> tuple[str, ...]:
    """Names of the settings in which the worlds differ; these cannot be changed, as worlds are shown to compare them."""
    all_of_them = [read(world) for world in worlds]
    return tuple(name for name in all_of_them[0] if len({settings[name] for settings in all_of_them}) > 1)


def change(world: World, command: Setting) -> None:
    """Apply a setting to the world."""
    match command:
        case commands.SetGravity(x, y):
            set_on_world(world, "gravity", (x, y))
        case commands.SetIntegrator(name):
            set_on_world(world, "integrator", integrators.BY_NAME[name]())
        case commands.SetSubsteps(value) | commands.SetRestitution(value) | commands.SetFriction(value):
            set_on_world(world, name_of(type(command)), value)


def present(world: World) -> list[Command]:
    """Commands that give another world the settings of this one, as far as a viewer may set them."""
    values = read(world)
    found: list[Command] = []
    for kind in get_args(commands.Settings):
        value = values[name_of(kind)]
        with contextlib.suppress(InputError):  # beyond the limits of viewers, or not applicable
            found.append(kind(*value) if isinstance(value, tuple) else kind(value))
    return found


def _of_surfaces(world: World, name: str) -> float | None:
    if world.collisions is not None:
        return float(getattr(world.collisions, name))
    value = getattr(world.boundary, name, None)
    return None if value is None else float(value)
