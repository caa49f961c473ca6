"""`pyverlet check limiter` and `check pressure`: tables of docs/physics.md, measured on this machine."""

from __future__ import annotations

from typing import Annotated

import typer

from pyverlet import scenes
from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli._check import app
from pyverlet.ground import checks
from pyverlet.ground.progress import Progress
from pyverlet.lab import limited, pressure
from pyverlet.lab.table import Table

__all__ = ["app"]

Markdown = Annotated[bool, typer.Option("--markdown", help="As a table for a page.")]


def _tell(table: Table, *, markdown: bool, as_json: bool) -> None:
    out.tell(list(table.values), table.markdown() if markdown else out.columns(table.head, table.rows), as_json=as_json)


@app.command(name="limiter")
def check_limiter(
    scene: Annotated[
        list[str] | None, typer.Option(help="Only this scene; may be repeated.", metavar="NAME", show_default=False)
    ] = None,
    seconds: Annotated[float, options.simulated("10")] = 10.0,
    particles: options.Particles = None,
    markdown: Markdown = False,
    as_json: options.Json = False,
) -> None:
    """In how many frames of each scene the energy limiter acts, at 2 to 16 substeps, and what it takes of the scale."""
    names = [scenes.get(name).name for name in scene] if scene else list(scenes.SCENES)
    checks.number("seconds", seconds, above=0.0)
    with Progress("run") as progress:
        found = limited.table(names, seconds=seconds, particles=particles, progress=progress)
    _tell(found, markdown=markdown, as_json=as_json)


@app.command(name="pressure")
def check_pressure(
    seconds: Annotated[float, options.simulated("60")] = 60.0,
    markdown: Markdown = False,
    as_json: options.Json = False,
) -> None:
    """What an elastic gas loses of its pressure, and how far circles overlap, when they move by much in a substep."""
    checks.number("seconds", seconds, least=1.0)  # before, few circles have met a wall
    with Progress("run") as progress:
        found = pressure.table(seconds=seconds, progress=progress)
    _tell(found, markdown=markdown, as_json=as_json)
