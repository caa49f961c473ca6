"""Scenes by name. A scene is one file; adding one is a file and a line here."""

from importlib import import_module
from pathlib import Path

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.guess import did_you_mean
from pyverlet.scenes import sketch
from pyverlet.scenes._scene import Scene, Settings, Variant

__all__ = ["SCENES", "Scene", "Settings", "Variant", "get", "read"]

_FILES = (
    "cage", "box", "fall", "image", "galton", "hourglass", "gas", "orbit", "conveyor", "drum", "bounce", "cage_brute_force",
    "cloth", "rope_bridge", "soft_bodies", "newton_cradle", "car", "ragdoll", "wrecking_ball", "particle_life", "boids",
    "droplets", "dam_break",
)  # fmt: skip
_found = [import_module(f"{__name__}.{file}") for file in _FILES]

SCENES: dict[str, Scene] = {scene.name: scene for file in _found for scene in getattr(file, "SCENES", None) or (file.SCENE,)}


def read(path: str | Path) -> Scene:
    """Read a scene from a file: .toml or .json, see `docs/data.md`, or a sketch, .py, see `docs/sketch.md`.

    Raises:
        InputError: the file cannot be read, or is invalid; for an unknown key the message has the nearest known one.
    """
    if checks.path("path", path).suffix.lower() == sketch.SUFFIX:
        return sketch.Sketch.read(path).scene()
    from pyverlet.data import scene_file

    return scene_file.read(path)


def get(name: str) -> Scene:
    """The scene of this name, or that of a file if the name ends in .toml, .json or .py.

    Raises:
        InputError: there is none; the message suggests the nearest and lists the known ones.
    """
    if checks.text("name", name).lower().endswith((".toml", ".json", sketch.SUFFIX)):
        return read(name)
    if name in SCENES:
        return SCENES[name]
    raise InputError(f"unknown scene {name!r}{did_you_mean(name.lower(), SCENES)}; known: {', '.join(SCENES)}")
