"""A study from its folder alone: also one that another program made."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from pyverlet.data.resolve_sketch import LazySketch, value_of
from pyverlet.data.sweep import Measure, Study, basics
from pyverlet.data.sweep_plan import SCENE_FILE, SKETCH, Plan
from pyverlet.ground.errors import InputError
from pyverlet.scenes import Scene, get
from pyverlet.world.world import World


def open_study(folder: str | Path, measure: Measure | None = None) -> Study:
    """The study in a folder.

    Args:
        folder: of the study.
        measure: the one it was made with. Nothing is imported because a file says so: without it the study can be looked at, and
            verified but for what was measured. A sketch is run when a world is asked for, if it is what it was.

    Raises:
        InputError: there is none, or it is of a scene that only the program that made it knows.
    """
    path = Path(folder) / "plan.json"
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
        told, settings, grid = about["measure"], about["settings"], about["grid"]
        scene = _scene(about["scene"], folder, about.get(SKETCH))
        known = measure or (basics if told == basics.__qualname__ else Unknown(told))
        plan = Plan(
            scene,
            {name: [value_of(name, value) for value in values] for name, values in grid.items()},
            {name: value_of(name, value) for name, value in settings.items()},
            known, about["frames"], about["dt"],
        )  # fmt: skip
        return Study(plan, Path(folder))
    except FileNotFoundError:
        raise InputError(f"'{folder}' has no study (no plan.json in it); allowed is the folder of one") from None
    except OSError as error:
        raise InputError(f"'{path}' cannot be read ({error.strerror}); allowed is the folder of a study") from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"'{path}' is no plan of a study ({error}); allowed is the folder of one") from None


class Unknown:
    """A measure of which only the name is known."""

    def __init__(self, name: str) -> None:
        self.__qualname__ = name

    def __call__(self, world: World) -> dict[str, Any]:
        return {}


def _scene(told: Any, folder: str | Path, place: str | None) -> Scene:
    if isinstance(told, str):
        return get(told)
    if "format" in told:  # a document: `Study` has written it there
        return get(str(Path(folder) / SCENE_FILE))
    if "sketch" in told:
        name = told["sketch"]
        sketch = LazySketch(name, told["source"], Path(place or name), Path(), Path(folder).parent)
        return replace(sketch.scene(), name=told["name"])
    raise InputError(f"'{folder}' is a study of a scene of its program's own; allowed is pyverlet.sweep with that scene")
