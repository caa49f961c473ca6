"""The commands of the laboratory: compare, order, truth, and check, which measures the guarantees of the physics."""

import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from pyverlet import scenes
from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli._app import DEFAULT_DT, app, check_app
from pyverlet.cli._options import imported, integrators, what
from pyverlet.common import checks
from pyverlet.common.errors import InputError, PyverletError
from pyverlet.common.progress import Progress
from pyverlet.lab import fuzz, physics, table
from pyverlet.laws.integrators import BY_NAME
from pyverlet.scenes import report
from pyverlet.scenes.sketch import SketchScene

__all__ = ["app"]

USUAL = "explicit-euler,semi-implicit-euler,position-verlet,velocity-verlet,rk4,yoshida4"
"""Default integrators of `compare`, without time-corrected Verlet, which is position Verlet for constant steps."""

EVERY = ",".join(BY_NAME)

Names = Annotated[
    str, typer.Option("--integrators", help="Names with commas, or your own as module:Class.", metavar="A,B", show_default=False)
]
Plot = Annotated[Path | None, options.file("Write a figure (.png, .pdf or .svg).")]


def _counts(text: str) -> list[int]:
    """Integers from a list with commas."""
    counts = [checks.integer("substeps", options.whole(part.strip())) for part in text.split(",")]
    if twice := [count for count in counts if counts.count(count) > 1]:
        raise InputError(f"substeps names {twice[0]} twice; allowed is each once")
    return counts


def _own_precision(scene: scenes.Scene) -> dict[str, None]:
    """No dtype for a sketch without one: its world is compared as built, with a note."""
    if not isinstance(scene, SketchScene) or scene.takes("dtype"):
        return {}
    out.note(f"{scene.name} is compared in the precision it is built with, since its build() takes no dtype")
    return {"dtype": None}


@app.command()
def compare(
    scene: options.SceneName = "bounce-euler",
    names: Names = USUAL,
    substeps: Annotated[str, typer.Option(help="Numbers with commas.", metavar="N,M")] = "1,2,10",
    seconds: Annotated[float, options.simulated("60")] = 60.0,
    dt: options.Dt = DEFAULT_DT,
    plot: Plot = None,
    as_json: options.Json = False,
) -> None:
    """Run a scene under several integrators and compare energy, heights and cost.

    Energies are relative to the initial one, in float64: the drift from start to end, the slope of the line fitted to it, and the
    amplitude about that line.
    """
    from pyverlet.lab import compare as lab
    from pyverlet.lab import figures

    chosen, methods, counts = scenes.get(scene), integrators(names), _counts(substeps)
    frames = report.frame_count(seconds=seconds, dt=dt)
    if plot is not None:
        figures.check_can_plot(plot)
    with Progress("frame") as progress:
        runs = lab.compare(chosen, methods, counts, frames=frames, dt=dt, progress=progress, **_own_precision(chosen))
    if plot is not None:
        from pyverlet.lab.comparison_figure import figure

        title = f"{chosen.name}: {frames * dt:.4g} s in frames of {1e3 * dt:.3g} ms"
        figures.save(figure(runs, title, chosen.line), plot)
        out.note(f"wrote {plot}")
    head = ("substeps", "integrator", "drift", "slope (1/s)", "amplitude", "first top (m)", "last top (m)", "ms a frame")
    rows = []
    for run in runs:
        tops = run.apexes[1]
        first, last = (f"{tops[0]:.4f}", f"{tops[-1]:.4f}") if len(tops) else ("", "")
        numbers = (f"{run.drift:+.3e}", f"{run.slope:+.3e}", f"{run.amplitude:.3e}")
        rows.append((str(run.substeps), run.integrator, *numbers, first, last, f"{run.ms_per_frame:.3f}"))
    about = f"{chosen.name}, {frames * dt:.4g} s: energy relative to {runs[0].energy[0]:.6g} J at the start"
    values = {"scene": chosen.name, "seconds": frames * dt, "dt": dt, "runs": [run.as_dict() for run in runs]}
    out.tell(values, f"{about}\n\n{out.columns(head, rows)}", as_json=as_json)


@app.command()
def order(
    names: Names = EVERY,
    problem: Annotated[
        str | None,
        typer.Option(
            help="One of your own in place of the four, a pyverlet.lab.Equation.", metavar="MODULE:NAME", show_default=False
        ),
    ] = None,
    plot: Plot = None,
    as_json: options.Json = False,
) -> None:
    """Measure the order of integrators on four problems with exact solutions, and compare it with the declared order."""
    from pyverlet.lab import figures
    from pyverlet.lab import order as lab

    methods, problems = lab.methods(integrators(names)), _problems(problem)
    if plot is not None:
        figures.check_can_plot(plot)
    orders = []
    for method in Progress.over("method", methods):
        with _own(problem):
            orders += lab.table([method], problems)
    if plot is not None:
        figures.save(lab.figure(orders, problems), plot)
        out.note(f"wrote {plot}")
    head = ("method", "expected", *orders[0].convergence, "")
    rows = []
    for each in orders:
        fitted = ["rounding" if found.order is None else f"{found.order:.2f}" for found in each.convergence.values()]
        expected = "none" if each.method.expected is None else str(each.method.expected)
        rows.append((each.method.label, expected, *fitted, "as expected" if each.as_expected else "NOT AS EXPECTED"))
    values = {"within": lab.WITHIN, "methods": [each.as_dict() for each in orders]}
    out.tell(values, out.columns(head, rows), as_json=as_json)


def _problems(path: str | None) -> list[Any]:
    """The problem at an import path, or the four built-in ones."""
    from pyverlet.lab.problems import PROBLEMS, Equation, Problem

    if path is None:
        return list(PROBLEMS.values())
    allowed = "allowed is module:name, a pyverlet.lab.Equation"
    found = imported("problem", path, allowed)
    if not isinstance(found, Equation | Problem):
        raise InputError(f"problem is {path!r}, which is {found!r}; {allowed}")
    if found.name == Equation.name:
        found = replace(found, name=path.partition(":")[2])
    return [found]


@contextmanager
def _own(problem: str | None) -> Iterator[None]:
    """Context that turns errors of a user's own problem into a sentence."""
    try:
        yield
    except PyverletError:
        raise
    except Exception as error:
        if problem is None:
            raise
        raise InputError(f"problem is {problem!r}, whose functions fail ({what(error)})") from error


@app.command()
def truth(
    codes: Annotated[list[str] | None, typer.Argument(metavar="[J1 J2 ...]", help="Which; all unless said.")] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="Write the page docs/truth.md.")] = False,
    as_json: options.Json = False,
) -> None:
    """Test nine claims about Euler and Verlet: claim, experiment, numbers, verdict.

    The exit code is 1 if a number does not support its verdict.
    """
    from pyverlet.lab import truth as lab

    wanted = [code.upper() for code in codes] if codes else list(lab.EXPERIMENTS)
    if unknown := [code for code in wanted if code not in lab.EXPERIMENTS]:
        raise InputError(f"unknown claim {unknown[0]!r}; known: {', '.join(lab.EXPERIMENTS)}")
    findings = [lab.EXPERIMENTS[code].run() for code in Progress.over("claim", wanted)]
    text = lab.markdown(findings).rstrip("\n") if markdown else "\n\n".join(map(lab.text, findings))
    out.tell([finding.as_dict() for finding in findings], text, as_json=as_json)
    out.fail_if(not all(finding.holds for finding in findings))


# Column widths of the table, in characters.
COLUMNS = {"check": 20, "asked": 52, "measured": 42, "": 4, "seconds": 7}


@check_app.command(name="physics")
def check_physics(
    only: Annotated[list[str] | None, options.names("Only this check; may be repeated.")] = None,
    full: Annotated[bool, typer.Option("--full", help="At the sizes of the promises: many minutes.")] = False,
    as_json: options.Json = False,
) -> None:
    """Measure the guarantees of the physics and print a line for each. Exit code 1 if one fails."""
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


@check_app.command(name="fuzz")
def check_fuzz(
    worlds: Annotated[int, typer.Option(help="How many.", min=1)] = 100,
    seed: Annotated[int, typer.Option(help="Of the first; the others have the numbers after it.", min=0)] = 0,
    without: Annotated[list[str] | None, options.names("Leave out this check; may be repeated.")] = None,
    as_json: options.Json = False,
) -> None:
    """Run random worlds with all features, and check each against all guarantees. Exit code 1 if one fails.

    A world that fails is printed as a minimal program that fails in the same way.
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


@check_app.command(name="limiter")
def check_limiter(
    scene: Annotated[list[str] | None, options.names("Only this scene; may be repeated.")] = None,
    seconds: Annotated[float, options.simulated("10")] = 10.0,
    particles: options.Particles = None,
    markdown: options.Markdown = False,
    as_json: options.Json = False,
) -> None:
    """In how many frames of each scene the energy limiter acts, at 2 to 16 substeps, and how much it removes."""
    names = [scenes.get(name).name for name in scene] if scene else list(scenes.SCENES)
    checks.number("seconds", seconds, above=0.0)
    with Progress("run") as progress:
        found = table.limiter(names, seconds=seconds, particles=particles, progress=progress)
    _tell(found, markdown=markdown, as_json=as_json)


@check_app.command(name="pressure")
def check_pressure(
    seconds: Annotated[float, options.simulated("60")] = 60.0, markdown: options.Markdown = False, as_json: options.Json = False
) -> None:
    """Pressure error and overlap of an elastic gas for large displacements per substep."""
    checks.number("seconds", seconds, least=1.0)  # before, few circles have hit a wall
    with Progress("run") as progress:
        found = table.pressure(seconds=seconds, progress=progress)
    _tell(found, markdown=markdown, as_json=as_json)
