"""A sketch that a file tells of, by its name, its place and what was in it: found again, and run only if it is the same.

Nothing is run because a file says so: what a file names is looked for when its world is asked for, and has to be, to the byte,
what it was.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.data.describe import TYPE, Builder
from pyverlet.data.sweep_plan import plain
from pyverlet.ground.errors import InputError
from pyverlet.scenes import Scene, Settings
from pyverlet.scenes.sketch import Given, Sketch, SketchScene
from pyverlet.world.world import World


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
        asked = {name: getattr(settings, name) for name in settings.given} if isinstance(settings, Given) else vars(settings)
        return super().build(super().scene().settings(**{name: _switched(name, value) for name, value in asked.items()}))

    def scene(self) -> Scene:
        """The sketch as a scene, without looking for it."""
        return SketchScene(self.path.stem, "", self.build, Given(), sketch=self)


# ---- the settings it was built with ------------------------------------------------------------------------------------


def settings_to_json(settings: Settings) -> dict[str, Any]:
    """What was asked for, as JSON has it; for `settings_from_json`.

    Raises:
        InputError: an object of a class that cannot be described.
    """
    names = settings.given if isinstance(settings, Given) else [field.name for field in dataclasses.fields(Settings)]
    return {name: plain(name, _switched(name, getattr(settings, name))) for name in sorted(names)}


def settings_from_json(table: Mapping[str, Any]) -> dict[str, Any]:
    """What `Scene.settings` takes, of what `settings_to_json` returned."""
    return {name: value_of(name, value) for name, value in table.items()}


def value_of(name: str, value: Any) -> Any:
    """A setting as the scene takes it, of what `plain` made of it."""
    if isinstance(value, Mapping) and TYPE in value:
        return Builder().build(name, value, object)
    if name == "dtype" and value in ("float32", "float64"):
        return np.dtype(value).type
    return tuple(value) if isinstance(value, list) else value


def _switched(name: str, value: Any) -> Any:
    """`Scene.settings` ignores None, and has False for no collisions."""
    return False if name == "collisions" and value is None else value
