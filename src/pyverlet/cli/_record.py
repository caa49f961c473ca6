"""The command `record`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from pyverlet import record as recording
from pyverlet import scenes
from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli._app import app
from pyverlet.cli._integrators import single
from pyverlet.cli._show import picture_style
from pyverlet.ground.progress import Progress
from pyverlet.picture import DARK, LIGHT
from pyverlet.picture.colour import COLOURINGS

DEFAULT_SECONDS = 10.0


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
