"""What a study is made of: which runs, and what makes one of them itself and no other."""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from pyverlet.data import serialize
from pyverlet.data.settings_json import plain, to_json
from pyverlet.scenes import SCENES, Scene
from pyverlet.world.world import World

FORMAT = 1

SCENE_FILE = "scene.json"  # in the folder of a study of a scene that was read from a file: a copy of that
SKETCH = "sketch"  # key of `plan.json`: where the study's sketch was. Studies that differ in this alone are one.


class Run(NamedTuple):
    """One run: its number in the grid, its key and its settings, as the scene takes them."""

    number: int
    key: str
    settings: dict[str, Any]


@dataclass(frozen=True)
class Plan:
    """A study: settings of all runs and values by setting, and what is measured after so many `frames` of `dt` s.

    Without `frames` the measure steps the world itself.
    """

    scene: Scene
    grid: dict[str, list[Any]]
    settings: dict[str, Any]
    measure: Callable[[World], Any]
    frames: int | None
    dt: float

    def about(self) -> dict[str, Any]:
        """All but the grid, as JSON has it: studies that differ in this are others."""
        return {
            "format": FORMAT,
            "scene": _scene(self.scene),
            "settings": to_json(dict(sorted(self.settings.items()))),
            # Without its module, which differs between running and importing a script.
            "measure": getattr(self.measure, "__qualname__", type(self.measure).__qualname__),
            "frames": self.frames,
            "dt": self.dt,
        }

    def beside(self) -> dict[str, Any]:
        """What is kept with it, and makes it no other study."""
        return {} if self.scene.sketch is None else {SKETCH: str(self.scene.sketch.path.resolve())}

    def described_grid(self) -> dict[str, Any]:
        """The grid as JSON has it."""
        return {name: [plain(name, value) for value in values] for name, values in self.grid.items()}

    def runs(self) -> list[Run]:
        """All of them, the last setting of the grid changing fastest."""
        head = _canonical(self.about())
        known = [
            [(value, f"{json.dumps(name)}:{_canonical(plain(name, value))}") for value in values]
            for name, values in self.grid.items()
        ]
        runs = []
        for number, chosen in enumerate(itertools.product(*known)):
            text = head + ",".join(sorted(said for _, said in chosen))
            key = hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
            runs.append(Run(number, key, dict(zip(self.grid, (value for value, _ in chosen), strict=True))))
        return runs

    def world(self, run: Run) -> World:
        """The world of a run as it starts. One thread steps it: runs share the cores among themselves."""
        return self.scene.world(**{"threads": 1, **self.settings, **run.settings})


def bare(scene: Scene) -> Scene:
    """The scene without what is for the eye alone, and may be functions that no other process can be sent."""
    return replace(scene, show=replace(scene.show, view=None, seconds=None), closed_form=None, variants=())


def _scene(scene: Scene) -> Any:
    if SCENES.get(scene.name) is scene:
        return scene.name
    document = getattr(scene, "document", None)
    if document is not None:
        return serialize.plain(serialize.pack(document))
    if scene.sketch is not None:
        return {"name": scene.name, "sketch": scene.sketch.name, "source": scene.sketch.digest}
    build = scene.build
    return {"name": scene.name, "build": f"{build.__module__}:{getattr(build, '__qualname__', type(build).__qualname__)}"}


def _canonical(value: Any) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
