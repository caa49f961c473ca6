"""Converts settings of scenes to JSON and back, for scene files, plans of studies and journals; and the sketches that these name.

Nothing is run because a file says so: a sketch named in a file is searched only when its world is needed, and must be unchanged
to the byte.
"""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.common.errors import InputError
from pyverlet.data import serialize
from pyverlet.data.describe import KINDS, TYPE, Builder, describe
from pyverlet.scenes import Scene, Settings
from pyverlet.scenes.sketch import Given, Sketch, SketchScene
from pyverlet.world.world import World


def plain(name: str, value: Any) -> Any:
    """A setting in its JSON form.

    Raises:
        InputError: it is NaN, or an object without a description.
    """
    if isinstance(value, float | np.floating) and not math.isfinite(value):
        raise InputError(f"{name} is {float(value)}; allowed are finite numbers")
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, type):
        return np.dtype(value).name
    if isinstance(value, tuple | list):
        return [plain(name, part) for part in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if type(value).__name__ in KINDS:
        return serialize.plain(describe(value))
    raise InputError(f"{name} is {value!r}; allowed are numbers, text and objects of pyverlet's")


def value_of(name: str, value: Any) -> Any:
    """The inverse of `plain`."""
    if isinstance(value, Mapping) and TYPE in value:
        return Builder().build(name, value, object)
    if name == "dtype" and value in ("float32", "float64"):
        return np.dtype(value).type
    return tuple(value) if isinstance(value, list) else value


def to_json(overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by name in JSON form; InputError as for `plain`."""
    return {name: plain(name, value) for name, value in overrides.items()}


def from_json(table: Mapping[str, Any]) -> dict[str, Any]:
    """Arguments of `Scene.settings` from the result of `to_json`."""
    return {name: value_of(name, value) for name, value in table.items()}


def overrides(settings: Settings) -> dict[str, Any]:
    """Arguments of `Scene.settings` that make these settings, only explicitly requested ones if known.

    `Scene.settings` ignores None, so no collisions are False.
    """
    names = sorted(settings.given) if isinstance(settings, Given) else [field.name for field in dataclasses.fields(Settings)]
    found = {name: getattr(settings, name) for name in names}
    return found | ({"collisions": False} if found.get("collisions", ()) is None else {})


def find(name: str, digest: str, *places: Path) -> Sketch:
    """The first of these files with the sketch's contents; a folder means the file of this name in it.

    Raises:
        InputError: none exists, or all have changed.
    """
    changed = None
    for place in (place / name if place.is_dir() else place for place in places):
        if not place.is_file():
            continue
        sketch = Sketch.read(place)
        if sketch.digest == digest:
            return sketch
        changed = changed or place
    if changed:
        raise InputError(f"the sketch '{changed}' has changed since then; allowed is the file as it was, also in this folder")
    raise InputError(f"the sketch '{places[0]}' is not there any more; allowed is the file as it was, also in this folder")


class LazySketch(Sketch):
    """A sketch that is searched with `find` when first needed."""

    def __init__(self, name: str, digest: str, *places: Path) -> None:
        super().__init__(places[0], b"")
        self.name, self._digest, self._places = name, digest, places

    def __reduce__(self) -> tuple[Any, ...]:
        return LazySketch, (self.name, self._digest, *(place.resolve() for place in self._places))

    @property
    def digest(self) -> str:
        return self._digest

    def _run(self) -> Any:
        if not self.source:
            found = find(self.name, self._digest, *self._places)
            self.path, self.source = found.path, found.source
        return super()._run()

    def build(self, settings: Settings) -> World:
        """As `Sketch.build`; the sketch's own defaults are unknown until it is found."""
        return super().build(super().scene().settings(**overrides(settings)))

    def scene(self) -> Scene:
        """The sketch as a scene, without searching for it."""
        return SketchScene(self.path.stem, "", self.build, Given(), sketch=self)
