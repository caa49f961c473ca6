"""Pickles and copies of worlds: the moving state by `parts`, and the objects in the world as they are.

The particles' `State` and the lists of a world are pickled as themselves, so that groups and links pickled with a world still
refer to its particles. Compiled code, the profile and the observer are not copied.
"""

from __future__ import annotations

import copy
import inspect
from functools import cache
from typing import Any

from pyverlet.common import pickling
from pyverlet.common.threads import max_threads
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.world import parts as apart
from pyverlet.world.saved import INTO
from pyverlet.world.world import World

_OBJECTS = ("boundary", "collisions", "integrator", "forces", "obstacles", "actors", "links")


def settings(world: World) -> dict[str, Any]:
    """Numbers and text that `World` is constructed with."""
    return {
        "dtype": world.dtype.name, "gravity": list(world.gravity), "substeps": world.substeps, "threads": world._threads,
        "ledger": world.keeps_ledger, "events": world.records_events, "contacts": world._contact_records is not None,
        "sleep": world._sleep is not None,
    }  # fmt: skip


def contents(world: World) -> dict[str, Any]:
    """The contents of a world as a dict. Arrays are copies: the state itself may be pickled later, after another frame."""
    moving = apart.take_apart(world)
    return {
        "settings": settings(world),
        "particles": world._state,
        "facts": moving.facts,
        "arrays": moving.arrays,
        "objects": {name: getattr(world, name) for name in _OBJECTS},
        "users": {name: value for name, value in vars(world).items() if name not in _own()},
    }


@cache
def _own() -> frozenset[str]:
    """Names of the attributes that every world has; other attributes are the user's."""
    return frozenset(vars(World()))


def check(world: World) -> None:
    """Raise InputError if something in the world cannot be pickled."""
    for name in _OBJECTS:
        held = getattr(world, name)
        for number, thing in enumerate(held) if name in ("forces", "obstacles", "actors", "links") else ((None, held),):
            what = name if number is None else f"{name}[{number}]"
            if not pickling.by_name(thing):  # such as a function made a force by a decorator
                pickling.check(what, type(thing))
                pickling.check(what, *filter(inspect.isfunction, getattr(thing, "__dict__", {}).values()))
    for label, function in world.watched.items():
        pickling.check(f"what is watched as {label!r}", *filter(inspect.isfunction, (function,)))


def restore_state(world: World, given: dict[str, Any]) -> None:
    """Turn a bare object into the world of these `contents`, which own their objects from now on."""
    options, objects = given["settings"], given["objects"]
    most = max_threads()
    World.__init__(world, **options | {"threads": options["threads"] and min(options["threads"], most)})
    world._state = given["particles"]
    vars(world).update({name: objects[name] for name in ("links", "forces", "obstacles")})
    world._force_sum.forces, world._obstacle_arrays = world.forces, ObstacleArrays(world.obstacles)
    for name in ("boundary", "collisions", "integrator"):
        setattr(world, name, objects[name])
    apart.fill(world, moving := apart.Parts(given["facts"], given["arrays"]))  # last: the integrator starts without accelerations
    world.restore(apart.put_together(world, moving))
    vars(world)["actors"] = objects["actors"]  # they restore themselves
    vars(world).update(given["users"])


def copied(world: World, memo: dict[Any, Any]) -> World:
    """An independent copy of a world, as `copy.deepcopy` makes them."""
    into: World | None = memo.get(INTO)
    if into is not None and memo.get(id(world._state)) is into._state:  # references to the old world now mean this one
        return into
    again = memo[id(world)] = type(world).__new__(type(world))
    with world.held():
        given = contents(world)
        restore_state(again, copy.deepcopy(given, memo))
    return again
