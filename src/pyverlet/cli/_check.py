"""`pyverlet check`: what is promised about the physics and what docs/physics.md has tables of, measured on this machine."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Annotated

import typer

from pyverlet import scenes
from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.ground.progress import Progress
from pyverlet.lab import fuzz, physics, table

# Columns of the table, in characters.
COLUMNS = {"check": 20, "asked": 52, "measured": 42, "": 4, "seconds": 7}

app = typer.Typer(help="Measure what is promised.", rich_markup_mode=None)


@app.callback()
def _check() -> None:
    """Measure what is promised."""


@app.command(name="physics")
def check_physics(
    only: Annotated[list[str] | None, options.names("Only this check; may be repeated.")] = None,
    full: Annotated[bool, typer.Option("--full", help="At the sizes of the promises: many minutes.")] = False,
    as_json: options.Json = False,
) -> None:
    """Measure the promises about the physics and print a line for each. Exit code 1 if one fails."""
    chosen = [physics.named(name) for name in only] if only else list(physics.CHECKS)
    if not as_json:
        out.write(line(list(COLUMNS)))
    rows: list[physics.Result] = []
    with Progress("check") as progress:
        for check in chosen:
            progress(len(rows) + 1, len(chosen))
            rows.append(row := check.run(full=full))
            if not as_json:
                out.write(line([row.name, row.asked, row.measured, "pass" if row.passed else "FAIL", f"{row.seconds:7.1f}"]))
    failed = sum(not row.passed for row in rows)
    values = {"full": full, "passed": len(rows) - failed, "failed": failed, "checks": [vars(row) for row in rows]}
    out.tell(values, f"{len(rows) - failed} of {len(rows)} pass", as_json=as_json)
    out.fail_if(failed)


@app.command(name="fuzz")
def check_fuzz(
    worlds: Annotated[int, typer.Option(help="How many.", min=1)] = 100,
    seed: Annotated[int, typer.Option(help="Of the first; the others have the numbers after it.", min=0)] = 0,
    without: Annotated[list[str] | None, options.names("Leave out this check; may be repeated.")] = None,
    as_json: options.Json = False,
) -> None:
    """Run random worlds of everything there is, and hold each to what is promised of all. Exit code 1 if one fails.

    A world that fails is printed as a program, made as small as can be, that fails in the same way.
    """
    for name in without or ():
        if name not in fuzz.CHECKS:
            raise InputError(f"--without is {name!r}; allowed are {', '.join(fuzz.CHECKS)}")
    found: list[fuzz.Finding] = []
    with Progress("fuzz") as progress:
        for finding in fuzz.fuzz(worlds, seed, without=without or ()):
            found.append(finding)
            progress(len(found), worlds)
            if finding.check and not as_json:
                out.write(f"# seed {finding.seed}: {finding.check}\n{finding.program}")
    failed, refused = (sum(map(bool, which)) for which in ([f.check for f in found], [f.refused for f in found]))
    values = {"worlds": worlds, "seed": seed, "failed": failed, "refused": refused}
    text = f"{worlds - failed - refused} of {worlds} worlds hold, {failed} fail, {refused} cannot be built"
    out.tell(values | {"findings": [vars(finding) for finding in found if finding.check]}, text, as_json=as_json)
    out.fail_if(failed)


def line(cells: Sequence[str]) -> str:
    """One row of the table, its cells wrapped into their columns."""
    wrapped = [textwrap.wrap(cell, width) or [""] for cell, width in zip(cells, COLUMNS.values(), strict=True)]
    height = max(map(len, wrapped))
    padded = [
        [part.ljust(width) for part in column + [""] * (height - len(column))]
        for column, width in zip(wrapped, COLUMNS.values(), strict=True)
    ]
    return "\n".join("  ".join(parts).rstrip() for parts in zip(*padded, strict=True))


def _tell(found: table.Table, *, markdown: bool, as_json: bool) -> None:
    out.tell(list(found.values), found.markdown() if markdown else out.columns(found.head, found.rows), as_json=as_json)


@app.command(name="limiter")
def check_limiter(
    scene: Annotated[list[str] | None, options.names("Only this scene; may be repeated.")] = None,
    seconds: Annotated[float, options.simulated("10")] = 10.0,
    particles: options.Particles = None,
    markdown: options.Markdown = False,
    as_json: options.Json = False,
) -> None:
    """In how many frames of each scene the energy limiter acts, at 2 to 16 substeps, and what it takes of the scale."""
    names = [scenes.get(name).name for name in scene] if scene else list(scenes.SCENES)
    checks.number("seconds", seconds, above=0.0)
    with Progress("run") as progress:
        found = table.limiter(names, seconds=seconds, particles=particles, progress=progress)
    _tell(found, markdown=markdown, as_json=as_json)


@app.command(name="pressure")
def check_pressure(
    seconds: Annotated[float, options.simulated("60")] = 60.0, markdown: options.Markdown = False, as_json: options.Json = False
) -> None:
    """What an elastic gas loses of its pressure, and how far circles overlap, when they move by much in a substep."""
    checks.number("seconds", seconds, least=1.0)  # before, few circles have met a wall
    with Progress("run") as progress:
        found = table.pressure(seconds=seconds, progress=progress)
    _tell(found, markdown=markdown, as_json=as_json)
