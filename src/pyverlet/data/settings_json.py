"""Settings of scenes as JSON has them, and back: in scene files, plans of studies and journals; and sketches that these name.

Nothing is run because a file says so: a sketch that a file names is looked for when its world is asked for, and has to be, to the
byte, what it was.
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
    """A setting as JSON has it.

    Raises:
        InputError: it is NaN, or an object that cannot be described.
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
    """A setting as the scene takes it, of what `plain` made of it."""
    if isinstance(value, Mapping) and TYPE in value:
        return Builder().build(name, value, object)
    if name == "dtype" and value in ("float32", "float64"):
        return np.dtype(value).type
    return tuple(value) if isinstance(value, list) else value


def to_json(overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Settings by name; InputError as `plain`."""
    return {name: plain(name, value) for name, value in overrides.items()}


def from_json(table: Mapping[str, Any]) -> dict[str, Any]:
    """What `Scene.settings` takes, of what `to_json` returned."""
    return {name: value_of(name, value) for name, value in table.items()}


def overrides(settings: Settings) -> dict[str, Any]:
    """What `Scene.settings` takes to make these settings, those that were asked for where they know which.

    It ignores None, and has False for no collisions.
    """
    names = sorted(settings.given) if isinstance(settings, Given) else [field.name for field in dataclasses.fields(Settings)]
    found = {name: getattr(settings, name) for name in names}
    return found | ({"collisions": False} if found.get("collisions", ()) is None else {})


def find(name: str, digest: str, *places: Path) -> Sketch:
    """The first of these files that has what the sketch had; a folder stands for the file of this name in it.

    Raises:
        InputError: none is there, or all have changed.
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
    """A sketch that is looked for, as `find` does, when it is first needed."""

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
        """As `Sketch.build`; what the sketch has as defaults is not known before it was found."""
        return super().build(super().scene().settings(**overrides(settings)))

    def scene(self) -> Scene:
        """The sketch as a scene, without looking for it."""
        return SketchScene(self.path.stem, "", self.build, Given(), sketch=self)
