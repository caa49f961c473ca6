"""The commands of the laboratory: compare, order, truth."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from pyverlet import scenes
from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli._app import DEFAULT_DT, app
from pyverlet.cli._options import imported, integrators, what
from pyverlet.ground import checks
from pyverlet.ground.errors import InputError, PyverletError
from pyverlet.ground.progress import Progress
from pyverlet.laws.integrators import BY_NAME
from pyverlet.scenes import report
from pyverlet.scenes.sketch import SketchScene

__all__ = ["app"]

USUAL = "explicit-euler,semi-implicit-euler,position-verlet,velocity-verlet,rk4,yoshida4"
"""What `compare` compares unless said: the time-corrected Verlet is position Verlet where the step is constant."""

EVERY = ",".join(BY_NAME)

Names = Annotated[
    str, typer.Option("--integrators", help="Names with commas, or your own as module:Class.", metavar="A,B", show_default=False)
]
Plot = Annotated[Path | None, options.file("Write a figure (.png, .pdf or .svg).")]


def _counts(text: str) -> list[int]:
    """Whole numbers from a list with commas."""
    counts = [checks.whole("substeps", options.whole(part.strip())) for part in text.split(",")]
    if twice := [count for count in counts if counts.count(count) > 1]:
        raise InputError(f"substeps names {twice[0]} twice; allowed is each once")
    return counts


def _own_precision(scene: scenes.Scene) -> dict[str, None]:
    """No dtype for a sketch that takes none: its world is compared as it is built, and that is said."""
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

    Energies are relative to that of the start, in float64: the drift from start to end, the slope of the line fitted to it,
    and the amplitude about that line.
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
    if as_json:
        out.write_json({"scene": chosen.name, "seconds": frames * dt, "dt": dt, "runs": [run.as_dict() for run in runs]})
        return
    head = ("substeps", "integrator", "drift", "slope (1/s)", "amplitude", "first top (m)", "last top (m)", "ms a frame")
    rows = []
    for run in runs:
        tops = run.apexes[1]
        first, last = (f"{tops[0]:.4f}", f"{tops[-1]:.4f}") if len(tops) else ("", "")
        numbers = (f"{run.drift:+.3e}", f"{run.slope:+.3e}", f"{run.amplitude:.3e}")
        rows.append((str(run.substeps), run.integrator, *numbers, first, last, f"{run.ms_per_frame:.3f}"))
    out.write(f"{chosen.name}, {frames * dt:.4g} s: energy relative to {runs[0].energy[0]:.6g} J at the start\n")
    out.write(out.columns(head, rows))


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
    """Measure the order of integrators on four problems with a solution on paper, beside the order they declare."""
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
    if as_json:
        out.write_json({"within": lab.WITHIN, "methods": [each.as_dict() for each in orders]})
        return
    head = ("method", "expected", *orders[0].convergence, "")
    rows = []
    for each in orders:
        fitted = ["rounding" if found.order is None else f"{found.order:.2f}" for found in each.convergence.values()]
        expected = "none" if each.method.expected is None else str(each.method.expected)
        rows.append((each.method.label, expected, *fitted, "as expected" if each.as_expected else "NOT AS EXPECTED"))
    out.write(out.columns(head, rows))


def _problems(path: str | None) -> list[Any]:
    """The problem at an import path, or the four there are."""
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
    """What goes wrong in a problem of the user's own becomes a sentence."""
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
    """Try nine claims about Euler and Verlet: claim, experiment, numbers, verdict.

    The exit code is 1 if some number does not bear out a verdict.
    """
    from pyverlet.lab import truth as lab

    wanted = [code.upper() for code in codes] if codes else list(lab.EXPERIMENTS)
    if unknown := [code for code in wanted if code not in lab.EXPERIMENTS]:
        raise InputError(f"unknown claim {unknown[0]!r}; known: {', '.join(lab.EXPERIMENTS)}")
    findings = [lab.EXPERIMENTS[code].run() for code in Progress.over("claim", wanted)]
    if as_json:
        out.write_json([finding.as_dict() for finding in findings])
    elif markdown:
        out.write(lab.markdown(findings).rstrip("\n"))
    else:
        out.write("\n\n".join(map(lab.text, findings)))
    out.fail_if(not all(finding.holds for finding in findings))
