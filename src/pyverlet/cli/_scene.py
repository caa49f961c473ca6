"""The commands `scene check`, `scene freeze` and `scene schema`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pyverlet import scenes
from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli._app import app
from pyverlet.ground.errors import InputError

__all__ = ["scene_app"]

scene_app = typer.Typer(help="Scenes as files.", rich_markup_mode=None)
app.add_typer(scene_app, name="scene")

SceneFile = Annotated[Path, typer.Argument(metavar="FILE", help="A scene file, .toml or .json.")]


@scene_app.command()
def check(path: SceneFile, as_json: options.Json = False) -> None:
    """Read a scene file, build its world, and say what is in it; or what is wrong with it."""
    scene = scenes.read(path)
    worlds = scene.panels().worlds
    facts = {
        "name": scene.name,
        "summary": scene.summary,
        "particles": sum(map(len, worlds)),
        "links": sum(len(world.links) for world in worlds),
        "obstacles": sum(len(world.obstacles) for world in worlds),
        "start_hash": worlds[0].state_hash(),
    }
    out.tell(facts, out.table((key.replace("_", " "), str(value)) for key, value in facts.items()), as_json=as_json)


@scene_app.command()
@options.with_settings("particles", "radius_spread", "restitution", "friction", "seed", "dtype")
def freeze(
    scene: options.SceneName,
    path: Annotated[Path, typer.Argument(metavar="FILE", help="To write, .toml or .json; arrays go into a .npz beside it.")],
    *,
    overrides: dict[str, Any],
) -> None:
    """Write the start of a scene as numbers: the same in every version, whatever a later one would draw by chance."""
    chosen = scenes.get(scene)
    if path.resolve() == Path(scene).resolve():
        raise InputError(f"path is '{path}', the very scene that is read; allowed is another name")
    chosen.freeze(path, **overrides)
    out.note(f"wrote '{path}' and '{path.with_suffix('.npz')}'")


@scene_app.command()
def schema() -> None:
    """Print the JSON Schema of scene files, with which editors help to write them."""
    from pyverlet.data import scene_file

    out.write_json(scene_file.schema())
