"""The commands that read or write files: new, record, replay, and scene check, freeze and schema."""

import warnings
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from pyverlet import record as recording
from pyverlet import scenes
from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli._app import app, picture_style
from pyverlet.cli._options import single
from pyverlet.common.errors import InputError
from pyverlet.common.outside import file_errors
from pyverlet.common.progress import Progress
from pyverlet.picture import DARK, LIGHT
from pyverlet.picture.colour import COLOURINGS
from pyverlet.scenes.sketch import SUFFIX

__all__ = ["app"]

DEFAULT_SECONDS = 10.0  # of a film

Kind = Literal["cage", "cloth", "fountain", "cradle", "empty"]

SceneFile = Annotated[Path, typer.Argument(metavar="FILE", help="A scene file, .toml or .json.")]

scene_app = typer.Typer(help="Scenes as files.", rich_markup_mode=None)
app.add_typer(scene_app, name="scene")


@app.command()
def new(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="To write, such as mysketch.py.")],
    kind: Annotated[Kind, typer.Option(help="What it starts with.")] = "cage",
) -> None:
    """Write a sketch to start from: a scene of your own in 25 lines."""
    if path.suffix.lower() != SUFFIX or not path.stem.isidentifier():
        raise InputError(f"path is '{path}'; allowed is a name such as mysketch.py")
    text = (resources.files("pyverlet.cli") / "sketches" / f"{kind}.txt").read_text(encoding="utf-8")
    if path.exists():
        raise InputError(f"path is '{path}', which is there already; allowed is a new name")
    with file_errors("path", path, "written"), path.open("x", encoding="utf-8") as file:
        file.write(text.replace("NAME", path.name))
    out.note(f"wrote '{path}'; now: pyverlet run {path} --watch")


@app.command()
@options.with_settings(*(name for name in options.SETTINGS if name != "ledger"))
def record(
    scene: options.SceneName,
    path: Annotated[
        Path, typer.Argument(metavar="FILE", help="A name that ends in .mp4, .gif, .webp, .html or .png, or frame-{:04d}.png.")
    ],
    seconds: Annotated[float | None, options.simulated("10, or the scene's")] = None,
    fps: Annotated[int | None, options.count("Pictures a second.", "60; .gif: 25")] = None,
    size: options.Size = None,
    colour: Annotated[
        options.ColourName | None,
        typer.Option(help="What the colours of the circles say.", show_default="origin, or the scene's"),
    ] = None,
    theme: options.ThemeOption = "dark",
    *,
    overrides: dict[str, Any],
) -> None:
    """Record a scene as a film (.mp4, .gif, .webp), a page that plays it (.html), numbered pictures (frame-{:04d}.png), or its
    last moment (.png).
    Needs no screen. The same command gives the same pictures. Ctrl-C keeps what was recorded until then.
    """
    chosen = scenes.get(scene)
    settings = chosen.settings(**overrides | {"integrator": single(overrides["integrator"])})
    show = chosen.show
    if seconds is None:
        seconds = show.seconds(settings) if show.seconds else DEFAULT_SECONDS
    plan = recording.plan(path, seconds=seconds, fps=fps, size=None if size is None else options.pixels(size))
    world = chosen.build(settings)
    given = None if colour is None else COLOURINGS["order" if colour == "origin" else colour]()
    style = picture_style(chosen, settings, plan.dt, given, DARK if theme == "dark" else LIGHT)
    with Progress("recording") as progress:
        film = recording.shoot(world, plan, style, progress=progress)
    length = f", {film.seconds:.4g} s" if film.pictures > 1 else ""
    out.note(f"wrote {path}: {film.pictures} {'picture' if film.pictures == 1 else 'pictures'}{length}")


@app.command()
def replay(
    path: Annotated[Path, typer.Argument(metavar="FILE", help="A journal, as `pyverlet run --journal FILE` wrote it.")],
    headless: Annotated[bool, typer.Option("--headless", help="Without the page, as fast as it goes, and report.")] = False,
    as_json: options.Json = False,
    no_open: options.NoOpen = False,
    port: options.Port = None,
) -> None:
    """Replay a session, on the page or without, and compare the state hash with the recorded one every second.

    --json implies --headless. The exit code is 1 if a hash differs.
    """
    from pyverlet.viewers.launch import serve
    from pyverlet.viewers.replay import ReplayState, Script

    script = Script(path)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        first = script.open()
    for warning in caught:
        out.note(f"note: {warning.message}")
    if not (headless or as_json):
        view_state = partial(ReplayState, script)
        serve(lambda: first, title=first.title, port=port, open_browser=not no_open, dt=script.dt, view_state=view_state)
        return
    if port is not None or no_open:
        raise InputError("port or no-open is given for a replay without a page; allowed is none of them")
    with Progress("frame") as progress:
        result = script.run(progress)
    end = "" if result["whole"] else "; it was cut off there"
    rows = [
        ("journal", str(path)),
        ("went through", f"{result['frames']:,} frames, {result['seconds']:.4g} s, {result['commands']} commands{end}"),
        ("hashes", f"{result['checked']} of {result['checked']} as they were"),
        ("state hash", result["state_hash"]),
    ]
    if result["stopped"]:
        rows.append(("stopped", f"{result['stopped']}, as in the session"))
    out.tell(result, out.table(rows), as_json=as_json)


@scene_app.command()
def check(path: SceneFile, as_json: options.Json = False) -> None:
    """Read a scene file, build its world, and describe it; or report the error in the file."""
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
    """Write the start of a scene as numbers, which stays the same in every version."""
    chosen = scenes.get(scene)
    if path.resolve() == Path(scene).resolve():
        raise InputError(f"path is '{path}', the very scene that is read; allowed is another name")
    chosen.freeze(path, **overrides)
    out.note(f"wrote '{path}' and '{path.with_suffix('.npz')}'")


@scene_app.command()
def schema() -> None:
    """Print the JSON Schema of scene files, for editors."""
    from pyverlet.data import scene_file

    out.write_json(scene_file.schema())
