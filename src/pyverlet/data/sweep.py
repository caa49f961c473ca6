"""Parameter studies: one world per combination, on all cores or a cluster, which can be interrupted and continued."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.progress import Progress
from pyverlet.data import settings_json, sweep_plan, sweep_run
from pyverlet.data.settings_json import LazySketch, plain
from pyverlet.data.sweep_plan import SCENE_FILE, SKETCH, Plan, Rows
from pyverlet.scenes import Scene, get
from pyverlet.world.world import World

Measure = Callable[[World], Any]


class Status(NamedTuple):
    """Progress of a study: number of runs, finished ones, failed ones among these, and those by other kernels or versions."""

    runs: int
    done: int
    failed: int
    foreign: int


class Verified(NamedTuple):
    """The result of `Study.verify`: runs repeated, and those among them that differ."""

    runs: list[int]
    differ: list[int]


def sweep(
    scene: str | Scene,
    grid: Mapping[str, Sequence[Any]],
    *,
    out: str | Path,
    measure: Measure | None = None,
    seconds: float | None = None,
    dt: float = 1 / 60,
    **settings: Any,
) -> Study:
    """A study: a world of a scene for each combination of settings, run for some seconds and measured.

    Args:
        scene: its name, or a `pyverlet.scenes.Scene`.
        grid: values of each setting, such as {"friction": [0, 0.2, 0.4], "seed": range(100)}; the last varies fastest.
        out: the folder of the study. An existing folder of this study is continued; its grid may have grown.
        measure: called with the world after its seconds: returns a number, or numbers and text by name. None: `basics`.
        seconds: simulated; None if `measure` steps the world.
        dt: seconds per frame.
        settings: common to all runs.

    Raises:
        InputError: a setting is unknown, a value is invalid or NaN, or the folder cannot be written or has another study.
    """
    scene = get(scene) if isinstance(scene, str) else scene
    values = {name: list(each) for name, each in _checked(grid).items()}
    if both := values.keys() & settings.keys():
        raise InputError(f"{min(both)} is in the grid and beside it; allowed is one of them")
    if measure is not None and not callable(measure):
        raise InputError(f"measure is {measure!r}; allowed is a function of a world")
    dt = checks.number("dt", dt, above=0.0)
    frames = None if seconds is None else round(checks.number("seconds", seconds, least=0.0) / dt)
    plan = Plan(scene, values, settings, measure or basics, frames, dt)
    for name, each in values.items():
        for value in each:
            scene.settings(**settings, **{name: value})
    return Study(plan, Path(out))


def _checked(grid: Any) -> Mapping[str, Sequence[Any]]:
    if not isinstance(grid, Mapping) or not grid:
        raise InputError(f"grid is {grid!r}; allowed are values by setting, such as {{'friction': [0, 0.2]}}")
    for name, values in grid.items():
        if isinstance(values, str | bytes) or not hasattr(values, "__iter__") or not len(list(values)):
            raise InputError(f"{name} of the grid is {values!r}; allowed are one value or more, in a list")
        known: set[Any] = set()
        for value in values:
            if (found := _hashable(plain(name, value))) in known:
                raise InputError(f"{name} of the grid has {plain(name, value)!r} twice; allowed is each once")
            known.add(found)
    return grid


def _hashable(value: Any) -> Any:
    if isinstance(value, dict):
        return tuple((key, _hashable(part)) for key, part in sorted(value.items()))
    return tuple(map(_hashable, value)) if isinstance(value, list) else value


def basics(world: World) -> dict[str, float]:
    """The default measurements: energy, overlap, number of escaped particles, height of the centre of mass."""
    energy, overlap = world.energy(), world.overlap()
    return {
        "energy": energy.total,
        "kinetic": energy.kinetic,
        "overlap_mean": overlap.mean,
        "overlap_max": overlap.max,
        "escaped": world.escaped(),
        "height": float(world.position[:, 1].mean(dtype=np.float64)) if len(world) else 0.0,
    }


class Study:
    """The result of `sweep`. Its folder contains `plan.json`, `rows.jsonl`, `timing.jsonl` and, at the end, `table.csv`."""

    def __init__(self, plan: Plan, folder: Path) -> None:
        self._plan, self._folder = plan, folder
        sweep_plan.open_folder(folder, plan)
        self._runs = plan.runs()

    def __len__(self) -> int:
        return len(self._runs)

    def __repr__(self) -> str:
        status = self.status()
        return f"Study of {self._plan.scene.name!r}: {status.done} of {status.runs} runs, in '{self._folder}'"

    def run(
        self, executor: Executor | None = None, *, processes: int | None = None, workers: int | None = None, again: bool = False
    ) -> Any:
        """Make the runs without a row, and return the table.

        It may be interrupted at any time and restarted. Rows are stored as they arrive, and the table is the same byte for byte
        in any case. A killed worker loses only its current runs; a run that raises gets a row with its error.

        Args:
            executor: any `concurrent.futures.Executor`: Dask's `client.get_executor(pure=False)`, loky, MPIPoolExecutor. None:
                processes on this machine.
            processes: number of these; 1 is this process alone, None is one per core.
            workers: number of the executor's workers, if it does not say.
            again: repeat runs that failed, or were made by other kernels or versions.

        Raises:
            InputError: another process is running it, rows are by other kernels, or measures return different columns.
            Interrupted: Ctrl-C; rows until then are kept.
        """
        with sweep_plan.only_one(self._folder), Rows(self._folder) as rows:
            left = [run for run in self._runs if self._lacks(rows.get(run.key), again=again)]
            done = len(self._runs) - len(left)
            with Progress(f"{self._plan.scene.name}, run") as progress:
                progress(done, len(self._runs))
                first = None
                for run in self._runs:
                    if (known := rows.get(run.key)) and run not in left:
                        first = _same_columns(first, known)
                for row, seconds in sweep_run.make(self._plan, left, executor, processes=processes, workers=workers):
                    rows.add(row, seconds)
                    self._lacks(row, again=False)  # a worker may have other kernels
                    done += 1
                    progress(done, len(self._runs))
                    first = _same_columns(first, row)
            sweep_plan.write_table(self._folder, self._plan, self._table_rows(rows))
        return self.table()

    def _lacks(self, row: Mapping[str, Any] | None, *, again: bool) -> bool:
        if row is None:
            return True
        if row["made_by"] != sweep_plan.made_by():
            if not again:
                theirs, ours = (" ".join(map(str, each.values())) for each in (row["made_by"], sweep_plan.made_by()))
                raise InputError(
                    f"'{self._folder}' has rows made by {theirs}, and this is {ours}; allowed are a new folder, and again=True"
                )
            return True
        return again and row["error"] is not None

    def _table_rows(self, rows: Rows) -> list[Mapping[str, Any]]:
        return [row for run in self._runs if (row := rows.get(run.key)) is not None]

    def status(self) -> Status:
        """The progress of the study."""
        found = self._table_rows(Rows(self._folder, read_only=True))
        ours = sweep_plan.made_by()
        failed = sum(row["error"] is not None for row in found)
        return Status(len(self._runs), len(found), failed, sum(row["made_by"] != ours for row in found))

    def table(self) -> Any:
        """The finished rows, in the order of the grid: a DataFrame if pandas is installed, a structured array otherwise."""
        array = self.array()
        try:
            import pandas as pd
        except ImportError:
            return array
        return pd.DataFrame({name: array[name] for name in array.dtype.names or ()})

    def array(self) -> NDArray[Any]:
        """The finished rows as a structured array: run, settings, measurements, hashes, error, and versions."""
        return sweep_plan.as_array(self._plan, self._table_rows(Rows(self._folder, read_only=True)))

    @property
    def scene(self) -> Scene:
        """The scene of all its worlds."""
        return self._plan.scene

    def world(self, k: int) -> World:
        """The initial world of run k, for viewing: `pv.view(study.world(17))`."""
        return self._plan.world(self._runs[checks.integer("k", k, least=0, most=len(self._runs) - 1)])

    def verify(self, rows: int = 5, *, seed: int | None = None) -> Verified:
        """Repeat some runs in this process, drawn at random, and compare hashes and measurements.

        Args:
            rows: number of runs; at most all.
            seed: of the random choice; None for a different one each time.
        """
        known = Rows(self._folder, read_only=True)
        ready = [run for run in self._runs if (row := known.get(run.key)) is not None and row["error"] is None]
        most = checks.integer("rows", rows)
        chosen = np.random.default_rng(seed).permutation(len(ready))[:most]
        picked = sorted((ready[k] for k in chosen), key=lambda run: run.number)
        differ = []
        if self.scene.sketch is not None:
            _ = self.scene.sketch.module  # a missing or changed sketch is an error, not a difference
        for run in Progress.over("verifying, run", picked):
            row, known_row = sweep_run.one(self._plan, run), known.get(run.key)
            assert known_row is not None
            if row["values"] == {}:  # the measure is unknown here
                row["values"] = known_row["values"]
            if any(row[name] != known_row[name] for name in ("start", "end", "values", "error")):
                differ.append(run.number)
        return Verified([run.number for run in picked], differ)


def _same_columns(first: Mapping[str, Any] | None, row: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The first row with measurements; InputError unless this one has the same columns."""
    if row["error"] is not None:
        return first
    first = first or row
    if list(row["values"]) != list(first["values"]):
        one, other = (f"{', '.join(each['values'])} for run {each['key'][:8]}" for each in (row, first))
        raise InputError(
            f"measure returned {one}, and {other}; allowed are the same columns for all (the rows there are have been kept)"
        )
    return first


def open_study(folder: str | Path, measure: Measure | None = None) -> Study:
    """Open the study in a folder.

    Args:
        folder: of the study.
        measure: the one it was made with. Nothing is imported because a file says so: without it the study can be read, and
            verified except for measurements. A sketch is run when a world is needed, if it is unchanged.

    Raises:
        InputError: there is none, or its scene is known only to the program that made it.
    """
    path = Path(folder) / "plan.json"
    try:
        about = json.loads(path.read_text(encoding="utf-8"))
        measured, settings, grid = about["measure"], about["settings"], about["grid"]
        scene = _scene(about["scene"], folder, about.get(SKETCH))
        known = measure or (basics if measured == basics.__qualname__ else Unknown(measured))
        plan = Plan(
            scene,
            {name: [settings_json.value_of(name, value) for value in values] for name, values in grid.items()},
            settings_json.from_json(settings),
            known, about["frames"], about["dt"],
        )  # fmt: skip
        return Study(plan, Path(folder))
    except FileNotFoundError:
        raise InputError(f"'{folder}' has no study (no plan.json in it); allowed is the folder of one") from None
    except OSError as error:
        raise InputError(f"'{path}' cannot be read ({error.strerror}); allowed is the folder of a study") from None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"'{path}' is no plan of a study ({error}); allowed is the folder of one") from None


class Unknown:
    """A measure of which only the name is known."""

    def __init__(self, name: str) -> None:
        self.__qualname__ = name

    def __call__(self, world: World) -> dict[str, Any]:
        return {}


def _scene(about: Any, folder: str | Path, place: str | None) -> Scene:
    if isinstance(about, str):
        return get(about)
    if "format" in about:  # a document, written by `Study`
        return get(str(Path(folder) / SCENE_FILE))
    if "sketch" in about:
        name = about["sketch"]
        sketch = LazySketch(name, about["source"], Path(place or name), Path(), Path(folder).parent)
        return replace(sketch.scene(), name=about["name"])
    raise InputError(f"'{folder}' is a study of a scene of its program's own; allowed is pyverlet.sweep with that scene")


__all__ = ["Status", "Study", "Verified", "basics", "open_study", "sweep"]
