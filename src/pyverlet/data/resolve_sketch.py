"""A sketch that a file tells of, by its name, its place and what was in it: found again, and run only if it is the same.

Nothing is run because a file says so: what a file names is looked for when its world is asked for, and has to be, to the byte,
what it was.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pyverlet.data.settings_json import overrides
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
        return super().build(super().scene().settings(**overrides(settings)))

    def scene(self) -> Scene:
        """The sketch as a scene, without looking for it."""
        return SketchScene(self.path.stem, "", self.build, Given(), sketch=self)
