"""Scene files: worlds as documents in TOML or JSON, read into a `Scene` like named ones, and written."""

import io
import json
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet import scenes
from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.guess import did_you_mean
from pyverlet.common.outside import file_errors
from pyverlet.common.shown import brief
from pyverlet.data import describe_links, serialize, settings_json, toml
from pyverlet.data.atomic_file import replacing
from pyverlet.data.describe import OBJECT, describe, describe_all
from pyverlet.data.scene_build import COLUMNS, Recipe, Table, hash_of
from pyverlet.scenes import Scene, Settings
from pyverlet.scenes._scene import Show
from pyverlet.world.world import World

SUFFIXES = (".toml", ".json")

LARGEST = 64_000_000  # bytes; arrays belong in a file beside it
ALONE = {"format", "name", "summary", "scene", "settings", "run", "view"}  # keys allowed in a document that names a scene


def is_file(name: str) -> bool:
    """Whether this is meant as a file and not a name."""
    return name.lower().endswith(SUFFIXES)


def read(path: str | Path) -> Scene:
    """See `pyverlet.scenes.read`."""
    path = checks.path("path", path)
    document = validated(_loaded(path), str(path))
    show = Show()
    if "view" in document:
        x0, y0, x1, y1 = document["view"]["part"]
        if not (x0 < x1 and y0 < y1):
            raise InputError(f"'{path}': part is {[x0, y0, x1, y1]}; allowed is x0 < x1 and y0 < y1")
        show = Show(view=lambda settings: (x0, y0, x1, y1))
    if "run" in document:
        show = Show(view=show.view, seconds=lambda settings: float(document["run"]["seconds"]))
    name = document.get("name") or path.stem
    if "scene" in document:
        if unknown := sorted(set(document) - ALONE):
            raise InputError(f"'{path}' names a scene and has {unknown[0]!r}; allowed beside are {', '.join(sorted(ALONE))}")
        try:
            base = scenes.get(document["scene"])
        except RecursionError:
            raise InputError(f"'{path}' names {document['scene']!r}, which leads back to it; allowed is another scene") from None
        given = settings_json.from_json(document.get("settings", {}))
        summary, defaults = document.get("summary") or base.summary, base.settings(**given)
        show = Show(base.show.colours, show.view or base.show.view, show.seconds or base.show.seconds)
        return Scene(name, summary, base.build, defaults, base.closed_form, show, base.variants, base.line, document=document)
    if "settings" in document:
        raise InputError(
            f"'{path}' has settings and names no scene; allowed is `scene`, or what the settings say under its own key"
        )
    recipe = Recipe(document, path)
    return Scene(
        name, document.get("summary") or f"from {path.name}", recipe.build, recipe.defaults, show=show, document=document
    )


def write(scene: Scene, path: str | Path) -> None:
    """See `Scene.write`."""
    path, document = checks.path("path", path), scene.document
    _suffix(path)
    recipe = getattr(scene.build, "__self__", None)
    if isinstance(recipe, Recipe):
        recipe.copy_arrays(path.parent)
    if document is None:
        if getattr(scenes.SCENES.get(scene.name), "build", None) is not scene.build:
            raise InputError(f"scene is {scene.name!r}, which no name gives; allowed is one of pyverlet's, or `freeze`")
        if scene.defaults.picture is not None:
            raise InputError(f"picture is '{scene.defaults.picture}'; allowed in a scene file is none")
        known = settings_json.to_json(settings_json.overrides(scene.defaults))
        settings = {name: value for name, value in known.items() if name not in ("threads", "picture")}
        document = {"format": 1, "name": scene.name, "scene": scene.name, "settings": settings}
    save(document, path)


def write_frozen(scene: Scene, path: str | Path, settings: Settings) -> None:
    """See `Scene.freeze`."""
    path = checks.path("path", path)
    _suffix(path)
    document = freeze(scene.build(settings), path)
    about = {key: value for key, value in (scene.document or {}).items() if key in ("summary", "run", "view")}
    if scene.show.view and "view" not in about:
        about["view"] = {"part": [float(value) for value in scene.show.view(settings)]}
    save({"format": 1, "name": scene.name, "summary": scene.summary} | about | document, path)


def save(document: dict[str, Any], path: Path) -> None:
    """Write a document; an old file is replaced atomically."""
    text = toml.dumps(document) if _suffix(path) == ".toml" else json.dumps(document, indent=1, allow_nan=False) + "\n"
    with replacing(path) as file:
        file.write(text.encode())


def schema() -> dict[str, Any]:
    """The JSON Schema of scene files, for editors."""
    from pyverlet.data import scene_models

    found = scene_models.Document.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema"} | found | {"title": "pyverlet scene"}


def freeze(world: World, path: Path) -> Table:
    """The document of a world at its start; arrays are written to a file beside `path`.

    Raises:
        InputError: it contains objects of a user's own class, or user-defined arrays, which such a file cannot hold.
    """
    if world.data:
        raise InputError(
            f"world.data has {next(iter(world.data))!r}; allowed in scene files are no arrays, which pyverlet.save keeps"
        )
    arrays: dict[str, Any] = {}
    groups, number = [], world.group_number
    arrays_path = path.with_suffix(".npz")
    for k in np.unique(number):
        name = f"group{k}"
        arrays |= {f"{name}.{key}": getattr(world, key)[number == k] for key in COLUMNS}
        groups.append({"type": "arrays", "name": name, "file": arrays_path.name, "hash": ""})
    described = describe_all(world)
    tables = {
        "world": {
            "gravity": list(world.gravity),
            "integrator": describe(world.integrator),
            "substeps": world.substeps,
            "dtype": world.dtype.name,
            "ledger": world.keeps_ledger,
            "events": world.records_events,
            "sleep": world._sleep is not None,
        },
        "room": describe(world.boundary),
        "collisions": False if world.collisions is None else describe(world.collisions),
        "joined": describe_links.describe(world),
        **described,
        "forces": [_grouped(force, world) for force in described["forces"]],
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
    with replacing(arrays_path) as file:
        file.write(content.getvalue())
    found: Table = serialize.plain(tables)
    return {"groups": groups} | {key: value for key, value in found.items() if value != []}


def _grouped(force: Table, world: World) -> Table:
    """A force on a group, with the group's name in the file."""
    group = force.get("group")
    if not isinstance(group, dict):
        return {key: value for key, value in force.items() if value is not None}
    return force | {"group": f"group{np.searchsorted(world._state.begun, group['first'], side='right') - 1}"}


def _suffix(path: Path) -> str:
    if not is_file(path.name):
        raise InputError(f"path is '{path}'; allowed for a scene is a name that ends in {' or '.join(SUFFIXES)}")
    return path.suffix.lower()


def _loaded(path: Path) -> Any:
    suffix = _suffix(path)
    with file_errors("path", path, "read"):
        if path.stat().st_size > LARGEST:
            raise InputError(f"'{path}' has {path.stat().st_size:,} bytes; allowed are {LARGEST:,}")
        content = path.read_bytes()
    try:
        text = content.decode()
        return tomllib.loads(text) if suffix == ".toml" else json.loads(text)
    except (ValueError, RecursionError) as error:  # errors of both parsers, and text that is not UTF-8
        raise InputError(f"'{path}' is no {suffix[1:].upper()}: {error}") from None


def validated(value: Any, name: str) -> dict[str, Any]:
    """The validated document, without defaults.

    Raises:
        InputError: one sentence with the error, its place and, for an unknown key, the nearest known one.
    """
    from pydantic import ValidationError

    from pyverlet.data import scene_models as models

    try:
        text = json.dumps(value)
    except (TypeError, ValueError) as error:  # a date, which TOML has
        raise InputError(f"'{name}' holds something else than tables, lists, numbers and texts ({error})") from None
    try:
        document = models.Document.model_validate_json(text)
    except ValidationError as error:
        raise InputError(f"'{name}': {_sentence(error.errors(), value, models)}") from None
    found: dict[str, Any] = document.model_dump(mode="json", exclude_unset=True)
    return found


def _sentence(errors: list[Any], value: Any, models: Any) -> str:
    """The first error as a sentence; unknown keys first, as they cause missing ones."""
    error = min(errors, key=lambda error: error["type"] != "extra_forbidden")
    loc = error["loc"]
    where, within = _path(loc, value), _path(loc[:-1], value)
    if error["type"] == "extra_forbidden":
        holder, key = _holder(loc[:-1], models), str(loc[-1])
        hint = did_you_mean(key, holder.model_fields, alike=0.5) or f" (known: {', '.join(holder.model_fields)})"
        return f"{within + ' ' if within else ''}has no key {key!r}{hint}"
    if error["type"] == "missing":
        return f"{within or 'the file'} lacks {loc[-1]!r}"
    if error["type"] == "union_tag_invalid":
        given, tags = error["ctx"]["tag"], [tag.strip(" '") for tag in error["ctx"]["expected_tags"].split(",")]
        return f"{where} has the type {given!r}{did_you_mean(given, tags, alike=0.4)}; allowed are {', '.join(tags)}"
    if error["type"] == "union_tag_not_found":
        return f"{where} lacks 'type'"
    said = error["msg"][0].lower() + error["msg"][1:]
    return f"{where} is {brief(error['input'])}; {said}"


def _path(loc: Sequence[Any], value: Any) -> str:
    """The place in the file, such as groups[0].radius, without the alternatives that pydantic tried."""
    text = ""
    for part in loc:
        known = value if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
        if part in known:
            text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
            value = value[part]
    return text


def _holder(loc: Sequence[Any], models: Any) -> Any:
    """The model of the table at this place."""
    return next((models.MODELS[part] for part in reversed(loc) if part in models.MODELS), models.Document)
