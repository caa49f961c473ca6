"""Scenes by name. One scene is one file; adding one is a file and a line here."""

from __future__ import annotations

from pathlib import Path

from pyverlet.ground.errors import InputError
from pyverlet.ground.guess import did_you_mean
from pyverlet.scenes import (
    boids,
    bounce,
    box,
    cage,
    cage_brute_force,
    car,
    cloth,
    conveyor,
    dam_break,
    droplets,
    drum,
    fall,
    galton,
    gas,
    hourglass,
    image,
    newton_cradle,
    orbit,
    particle_life,
    ragdoll,
    rope_bridge,
    sketch,
    soft_bodies,
    wrecking_ball,
)
from pyverlet.scenes._scene import Scene, Settings, Variant

__all__ = ["SCENES", "Scene", "Settings", "Variant", "get", "read"]

SCENES: dict[str, Scene] = {
    scene.name: scene
    for scene in (
        cage.SCENE, box.SCENE, fall.SCENE, image.SCENE, galton.SCENE, hourglass.SCENE, gas.SCENE, orbit.SCENE, conveyor.SCENE,
        drum.SCENE, *bounce.SCENES, cage_brute_force.SCENE, cloth.SCENE, rope_bridge.SCENE, soft_bodies.SCENE,
        newton_cradle.SCENE, car.SCENE, ragdoll.SCENE, wrecking_ball.SCENE, particle_life.SCENE, boids.SCENE, droplets.SCENE,
        dam_break.SCENE,
    )
}  # fmt: skip


def read(path: str | Path) -> Scene:
    """The scene of a file: .toml or .json, `docs/data.md` says what may stand in it, or a sketch, .py, `docs/sketch.md`.

    Raises:
        InputError: the file cannot be read, or something in it is wrong; for a key that is unknown, with the nearest known one.
    """
    if Path(path).suffix.lower() == sketch.SUFFIX:
        return sketch.Sketch.read(path).scene()
    from pyverlet.data import scene_file

    return scene_file.read(path)


def get(name: str) -> Scene:
    """The scene called `name`, or that of a file if the name ends in .toml, .json or .py.

    Raises:
        InputError: there is none; the message suggests the nearest and names the known ones.
    """
    if name.lower().endswith((".toml", ".json", sketch.SUFFIX)):
        return read(name)
    if name in SCENES:
        return SCENES[name]
    raise InputError(f"unknown scene {name!r}{did_you_mean(name.lower(), SCENES)}; known: {', '.join(SCENES)}")
