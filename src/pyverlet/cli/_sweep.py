"""`pyverlet sweep`: parameter studies from the command line."""

import ast
import itertools
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from pyverlet.cli import _options as options
from pyverlet.cli import _print as out
from pyverlet.cli._options import imported, integrator
from pyverlet.common.errors import InputError
from pyverlet.data.sweep import Measure, Study, open_study
from pyverlet.data.sweep import sweep as make
from pyverlet.viewers.protocol import finite

_SHOWN, _MOST = 20, 1_000_000

app = typer.Typer(help="Parameter studies.", rich_markup_mode=None)

Folder = Annotated[Path, typer.Argument(metavar="FOLDER", help="The study's.")]
MeasurePath = Annotated[
    str | None,
    typer.Option("--measure", help="Function of a world; energy and more unless said.", metavar="PATH", show_default=False),
]


@app.command(name="run")
def run_sweep(
    scene: options.SceneName,
    vary: Annotated[
        list[str], typer.Option(help="A setting's values: friction=0,0.2,0.4 or seed=0:100; repeat it.", metavar="NAME=VALUES")
    ],
    folder: Annotated[Path, typer.Option("--out", help="Folder of the study; one that has it goes on.", metavar="FOLDER")],
    fixed: Annotated[
        list[str] | None, typer.Option("--set", help="One of all runs: particles=500.", metavar="NAME=VALUE", show_default=False)
    ] = None,
    seconds: Annotated[float, options.simulated("10")] = 10.0,
    dt: options.Dt = 1 / 60,
    measure: MeasurePath = None,
    processes: Annotated[int | None, options.count("That share the work.", "one for each core")] = None,
    dask: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, in place of processes here (extra dask).", metavar="URL")
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Make those again that failed, or that other kernels made.")] = False,
    as_json: options.Json = False,
) -> None:
    """Run a scene with every combination of settings. After Ctrl-C the same command continues."""
    grid: dict[str, list[Any]] = {}
    for name, values in map(_varied, vary):
        if name in grid:
            raise InputError(f"vary has {name} twice; allowed is each setting once, with all its values")
        grid[name] = values
    settings = {name: _value(name, text) for name, _, text in (each.partition("=") for each in fixed or [])}
    study = make(scene, grid, out=folder, measure=_measure(measure), seconds=seconds, dt=dt, **settings)
    if dask is None:
        study.run(processes=processes, again=again)
    else:
        _on_dask(study, dask, again)
    _tell(study, as_json)


def _on_dask(study: Study, address: str, again: bool) -> None:
    try:
        import distributed
    except ImportError:
        raise InputError("dask is not installed; allowed are `pip install 'pyverlet[dask]'`, and processes here") from None
    try:
        client = distributed.Client(address, timeout=10)
    except (OSError, ValueError) as error:
        raise InputError(f"dask is {address!r}, where no scheduler answers ({error}); allowed is the address of one") from None
    with client:
        study.run(client.get_executor(pure=False), workers=max(sum(client.ncores().values()), 1), again=again)


@app.command(name="status")
def sweep_status(folder: Folder, as_json: options.Json = False) -> None:
    """Show the progress of a study."""
    _tell(open_study(folder), as_json, rows=False)


@app.command(name="verify")
def verify_sweep(
    folder: Folder,
    rows: Annotated[int, options.count("How many.", "5")] = 5,
    measure: MeasurePath = None,
    as_json: options.Json = False,
) -> None:
    """Repeat some rows, drawn at random, and compare. Exit code 1 if one differs."""
    found = open_study(folder, _measure(measure)).verify(rows)
    result = f"these differ: {', '.join(map(str, found.differ))}" if found.differ else "all as they were"
    text = f"made again: runs {', '.join(map(str, found.runs)) or 'none'}; {result}"
    out.tell(found._asdict(), text, as_json=as_json)
    out.fail_if(found.differ)


@app.command(name="show")
def show_world(
    folder: Folder,
    number: Annotated[int, typer.Argument(parser=options.whole, metavar="RUN", help="Its number in the table.")],
    port: options.Port = None,
    no_browser: Annotated[bool, typer.Option("--no-open", "--no-browser", help="Do not open a browser tab.")] = False,
) -> None:
    """Show the world of a run on the live page, from its start."""
    from pyverlet.viewers.launch import serve
    from pyverlet.viewers.presentation import Presentation

    study = open_study(folder)

    def build() -> Presentation:
        return replace(Presentation.of(study.world(number), f"{study.scene.name}, run {number}"), callbacks=study.scene.sketch)

    serve(build, title=study.scene.name, port=port, open_browser=not no_browser)


def _tell(study: Study, as_json: bool, *, rows: bool = True) -> None:
    status = study.status()
    table: Any = study.array() if rows else np.empty(0)
    names = table.dtype.names or ()
    if as_json:
        lines = finite([dict(zip(names, row, strict=True)) for row in table.tolist()])
        out.write_json(status._asdict() | ({"rows": lines} if rows else {}))
        return
    if rows:
        shown = [name for name in names if name not in ("pyverlet", "numpy", "python", "kernels")]
        values = [[row[name] for name in shown] for row in table[:_SHOWN]]
        cells = [[f"{value:.6g}" if isinstance(value, float) else str(value) for value in row] for row in values]
        out.write(out.columns(shown, cells))
        if len(table) > _SHOWN:
            out.write(f"... {len(table) - _SHOWN} more, all in table.csv")
    failed = f", {status.failed} failed" if status.failed else ""
    foreign = f", {status.foreign} made by other kernels or versions" if status.foreign else ""
    out.write(f"{status.done} of {status.runs} runs{failed}{foreign}")


def _measure(path: str | None) -> Measure | None:
    if path is None:
        return None
    found = imported("measure", path, "allowed is module:function, a function of a world")
    if not callable(found):
        raise InputError(f"measure is {path!r}, which is no function; allowed is a function of a world")
    return found  # type: ignore[no-any-return]


def _varied(text: str) -> tuple[str, list[Any]]:
    name, given, values = text.partition("=")
    if not given or not values:
        raise InputError(f"vary is {text!r}; allowed is a setting and its values, such as friction=0,0.2 or seed=0:100")
    return name, list(itertools.chain.from_iterable(_values(name, part) for part in values.split(",")))


def _values(name: str, text: str) -> list[Any]:
    """One value, or integers from:to or from:to:step, without the last, as in Python."""
    if ":" not in text:
        return [_value(name, text)]
    try:
        numbers = [int(part) for part in text.split(":")]
        values = range(*numbers) if len(numbers) in (2, 3) else [_value(name, text)]
        if len(values) > _MOST:
            raise InputError(f"vary has {len(values)} values for {name}; allowed are at most {_MOST}")
    except (ValueError, OverflowError):
        raise InputError(f"vary has {text!r} for {name}; allowed are whole numbers from:to, and values with commas") from None
    return list(values)


def _value(name: str, text: str) -> Any:
    if name == "integrator":
        return integrator(text)
    if name == "dtype":
        return np.dtype(text).type if text in ("float32", "float64") else text
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text
