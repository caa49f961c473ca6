"""Snapshots: a world in a file, which continues with the same bits in any process: `save` and `load`."""

import io
import platform
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.common.threads import max_threads
from pyverlet.core.sources import sources_hash
from pyverlet.data import archive, describe_links, serialize
from pyverlet.data.atomic_file import replacing
from pyverlet.data.describe import Builder, describe, describe_all
from pyverlet.laws.boundaries import Boundary
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.integrators import Integrator
from pyverlet.world import copies
from pyverlet.world import parts as apart
from pyverlet.world.measures import hash_of
from pyverlet.world.parts import Parts
from pyverlet.world.world import World

Header = dict[str, Any]

FORMAT = 1

MIGRATIONS: dict[int, Callable[[Header, dict[str, Array]], None]] = {}
"""By format number: converts the contents of a file in place to the next format."""


class OtherBits(UserWarning):
    """A loaded world was written by other kernels, so it may now differ in the last bits."""


def save(world: World, path: str | Path, *, scene: Mapping[str, Any] | None = None) -> None:
    """Write a world atomically to a file, from which `load` continues with the same bits.

    All particles and the state of all objects are saved; the profile and the observer are not. Objects of your own classes are
    saved by name, actors also with the result of their `save`.

    Args:
        world: between two frames.
        path: of the file, by convention `heap.pvsnap`. An old one is replaced once the new one is complete on the disk.
        scene: saved with it, as JSON: the document that the world was made from.

    Raises:
        InputError: the file cannot be written, a value is invalid in a world, or an object has state that files cannot hold.
            An old file is unchanged.
    """
    if not isinstance(world, World):
        raise InputError(f"world is {world!r}; allowed is a pyverlet.World")
    target = checks.path("path", path)
    header, arrays = to_table(world, scene)
    with ThreadPoolExecutor(1) as beside, replacing(target) as file:
        hashed = beside.submit(_hash, header, arrays)  # for a million circles it takes as long as all the rest
        apart.check(Parts(header["facts"], _moving(arrays)), world.dtype)
        archive.write(file, lambda: header | {"state_hash": hashed.result()}, arrays)


def to_table(world: World, scene: Mapping[str, Any] | None = None) -> tuple[Header, dict[str, Array]]:
    """The contents of a world's file: a table for JSON, without the state's hash, and arrays."""
    moving = apart.take_apart(world)
    arrays = dict(moving.arrays)

    def put_aside(array: Array) -> dict[str, str]:
        name = f"extra.{sum(known.startswith('extra.') for known in arrays)}"
        arrays[name] = array
        return {serialize.ARRAY: name}

    # User-defined arrays: (rows, bytes per row), dtype in the form of `numpy.lib.format`, and shape of a row.
    kinds: list[tuple[Any, list[int]]] = []
    for key, name in zip([key for key in arrays if key.startswith(apart.OWN)], moving.facts["data"], strict=True):
        column = arrays[key]
        if column.dtype.hasobject:
            allowed = "allowed in files are numbers, texts and dates of NumPy's dtypes"
            raise InputError(f"data[{name!r}] holds Python objects; {allowed}")
        little = column.astype(column.dtype.newbyteorder("<"))
        kinds.append((np.lib.format.dtype_to_descr(little.dtype), list(column.shape[1:])))
        arrays[key] = np.frombuffer(little.tobytes(), np.uint8).reshape(len(column), little.nbytes // len(column))
    header: Header = {
        "format": FORMAT,
        "made_by": versions() | {"system": sys.platform, "machine": platform.machine()},
        "kernels": sources_hash(),
        "particles": len(world),
        "scene": serialize.pack(dict(scene)) if scene is not None else None,
        "world": serialize.map_arrays(_settings(world), put_aside),
        "facts": serialize.pack(moving.facts),
        "own": serialize.pack(kinds),
    }
    return header, arrays


def _moving(arrays: dict[str, Array]) -> dict[str, Array]:
    return {name: array for name, array in arrays.items() if not name.startswith("extra.")}


def _hash(header: Header, arrays: dict[str, Array]) -> str:
    names = ("position", "velocity", "spin", "angle", "radius", "mass")
    return hash_of(header["facts"]["time"], (arrays[f"particles.{name}"] for name in names))


def versions() -> dict[str, str]:
    """Versions of pyverlet, NumPy and Python."""
    import pyverlet

    return {"pyverlet": pyverlet.__version__, "numpy": np.__version__, "python": platform.python_version()}


def _settings(world: World) -> dict[str, Any]:
    """Constructor arguments of the world, and its objects."""
    return {
        **copies.settings(world),
        "boundary": describe(world.boundary),
        "collisions": world.collisions and describe(world.collisions),
        "integrator": describe(world.integrator),
        **describe_all(world),
        "links": describe_links.describe(world),
        "iterations": world.links.iterations,
    }


def load(path: str | Path, exact: bool = False, objects: Iterable[Any] = ()) -> World:
    """Load a world that `save` wrote.

    It continues with the same bits as the saved one, in any process and on any number of threads. If the file was written by
    other kernels, of another version of pyverlet, it continues from the same state, with a warning that bits may differ.

    Args:
        path: of the file.
        exact: refuse a file written by other kernels.
        objects: your own objects in it: forces, actors, a boundary, an integrator, obstacles, functions made forces, several of
            one class in the order of the world; and classes of links.

    Raises:
        InputError: the file is missing, damaged or of a newer format, `exact` is impossible, or an object is missing.
    """
    path = checks.path("path", path)
    try:
        objects = list(objects)
    except TypeError:
        raise InputError(f"objects is {objects!r}; allowed is a list of objects of your own") from None
    header, arrays = archive.read(path)
    try:
        return from_table(header, arrays, exact=exact, objects=objects)
    except InputError as error:
        raise InputError(f"'{path}': {error}") from error.__cause__
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError, RecursionError) as error:
        raise InputError(f"'{path}' lacks something ({error!r}); allowed is a file as pyverlet wrote it") from error


def from_table(header: Header, arrays: dict[str, Array], *, exact: bool = False, objects: Iterable[Any] = ()) -> World:
    """The world of `to_table`'s result, whose arrays it then owns."""
    if _migrated(header, arrays) and exact:
        raise InputError("exact is True, and the file is of an older format; allowed is exact=False")
    ours = header["kernels"] == sources_hash()
    if exact and not ours:
        raise InputError(
            f"exact is True, and the file was written by other kernels ({header['kernels']}, pyverlet "
            f"{header['made_by']['pyverlet']}) than these ({sources_hash()}); allowed is exact=False"
        )
    settings = _with_arrays(header["world"], arrays)
    known = {name: array for name, array in _moving(arrays).items() if name not in apart.RETIRED}
    moving = Parts(serialize.unpack(header["facts"]), known)
    for k, (described, row) in enumerate(serialize.unpack(header.get("own", []))):
        content, dtype = known[f"{apart.OWN}{k}"], np.lib.format.descr_to_dtype(described)
        if dtype.hasobject:
            raise InputError(f"an array of data is of dtype {dtype}; allowed are dtypes without Python objects")
        column = np.frombuffer(content.tobytes(), dtype).reshape(len(content), *row)
        known[f"{apart.OWN}{k}"] = column.astype(dtype.newbyteorder("="))
    if unknown := {name for name in known if not name.startswith(apart.OWN)} - set(apart.FIELDS):
        raise InputError(f"there is an array {min(unknown)!r}; allowed are those pyverlet knows")
    with ThreadPoolExecutor(1) as beside:
        hashed = beside.submit(_hash, header, arrays)
        world = _world(settings, moving, list(objects))
    if header.get("state_hash", hashed.result()) != hashed.result():
        raise InputError(f"the state's hash is {hashed.result()}; allowed is {header['state_hash']}, as when it was written")
    if not ours:
        warnings.warn(
            f"this world was written by other kernels (pyverlet {header['made_by']['pyverlet']}): it goes on from the same "
            "state, and may differ from theirs in the last bits",
            OtherBits,
            stacklevel=3,
        )
    return world


def to_bytes(world: World) -> bytes:
    """The contents of a file of the world."""
    out = io.BytesIO()
    header, arrays = to_table(world)
    archive.write(out, lambda: header, arrays)
    return out.getvalue()


def from_bytes(content: bytes) -> World:
    """The world of `to_bytes`'s result; InputError if it is damaged."""
    try:
        return from_table(*archive.read_from(io.BytesIO(content), len(content)))
    except InputError:
        raise
    except archive.BROKEN as error:
        raise InputError(f"a snapshot is damaged ({error}); allowed is one as it was written") from error


def _migrated(header: Header, arrays: dict[str, Array]) -> bool:
    """Convert contents to the current format. Returns whether that was necessary."""
    first = number = checks.integer("format", header.get("format"))
    if number > FORMAT:
        raise InputError(f"format is {number}, of a newer pyverlet; allowed are 1 to {FORMAT}")
    for older in range(number, FORMAT):
        MIGRATIONS[older](header, arrays)
    return first < FORMAT


def _with_arrays(value: Any, arrays: dict[str, Array]) -> Any:
    if isinstance(value, list):
        return [_with_arrays(part, arrays) for part in value]
    if isinstance(value, dict):
        if list(value) == [serialize.ARRAY]:
            return arrays[value[serialize.ARRAY]]
        return {key: _with_arrays(part, arrays) for key, part in value.items()}
    return value


def _world(settings: dict[str, Any], moving: Parts, objects: list[Any]) -> World:
    builder = Builder(objects)
    threads = settings["threads"]
    world = World(
        boundary=builder.build("boundary", settings["boundary"], Boundary),
        collisions=settings["collisions"] and builder.build("collisions", settings["collisions"], Collisions),
        integrator=builder.build("integrator", settings["integrator"], Integrator),
        threads=None if threads is None else min(checks.integer("threads", threads), max_threads()),
        contacts=settings.get("contacts", False),
        **{name: settings[name] for name in ("gravity", "substeps", "dtype", "ledger", "events", "sleep")},
    )
    builder.world = world
    apart.fill(world, moving)
    builder.build_all(settings)
    describe_links.build(world, settings["links"], objects)
    world.links.iterations = settings["iterations"]
    world.restore(apart.put_together(world, moving))
    return world
