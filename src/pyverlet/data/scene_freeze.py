"""From a world at its start to a document, with its arrays in a file beside."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.data import describe_links, serialize
from pyverlet.data.atomic_file import replacing
from pyverlet.data.describe import OBJECT, describe
from pyverlet.data.scene_build import COLUMNS, Table, hash_of
from pyverlet.ground.errors import InputError
from pyverlet.world.world import World


def freeze(world: World, path: Path) -> Table:
    """What a document says about a world at its start, whose arrays go into a file beside `path`.

    Raises:
        InputError: there are objects of a user's own class in it, or arrays of the user's own, which no such file can hold.
    """
    if world.data:
        raise InputError(
            f"world.data has {next(iter(world.data))!r}; allowed in scene files are no arrays, which pyverlet.save keeps"
        )
    arrays: dict[str, Any] = {}
    groups, number = [], world.group_number
    beside = path.with_suffix(".npz")
    for k in np.unique(number):
        name = f"group{k}"
        arrays |= {f"{name}.{key}": getattr(world, key)[number == k] for key in COLUMNS}
        groups.append({"type": "arrays", "name": name, "file": beside.name, "hash": ""})
    tables = {
        "world": {
            "gravity": list(world.gravity),
            "integrator": describe(world.integrator),
            "substeps": world.substeps,
            "dtype": world.dtype.name,
            "ledger": world.keeps_ledger,
            "events": world.tells_events,
            "sleep": world._sleep is not None,
        },
        "room": describe(world.boundary),
        "collisions": False if world.collisions is None else describe(world.collisions),
        "joined": describe_links.describe(world),
        "forces": [_grouped(describe(force), world) for force in world.forces],
        "obstacles": [describe(obstacle) for obstacle in world.obstacles],
        "actors": [describe(actor) for actor in world.actors],
        "start_hash": world.state_hash(),
    }
    for key, value in tables.items():
        for table in value if isinstance(value, list) else [value]:
            if isinstance(table, dict) and OBJECT in table:
                raise InputError(
                    f"{key} has an object of a class of your own, {table[OBJECT]!r}; allowed in a file are pyverlet's"
                )
    content = io.BytesIO()
    np.savez(content, **arrays)
    for group in groups:
        group["hash"] = hash_of(content.getvalue())
    with replacing(beside) as file:
        file.write(content.getvalue())
    found: Table = serialize.plain(tables)
    return {"groups": groups} | {key: value for key, value in found.items() if value != []}


def _grouped(force: Table, world: World) -> Table:
    """A force on a group, by the name that the group has in the file."""
    group = force.get("group")
    if not isinstance(group, dict):
        return {key: value for key, value in force.items() if value is not None}
    return force | {"group": f"group{np.searchsorted(world._state.begun, group['first'], side='right') - 1}"}
