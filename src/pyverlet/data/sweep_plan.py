"""The plan of a study: its runs, their keys, and its folder.

A row is a line of `rows.jsonl`, written once and never changed. Durations are in `timing.jsonl`, so that the table is the same on
every machine, whatever the runs took.
"""

import contextlib
import csv
import hashlib
import io
import itertools
import json
import os
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from time import monotonic
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import file_lock
from pyverlet.common.errors import InputError
from pyverlet.common.shown import cut
from pyverlet.core.sources import sources_hash
from pyverlet.data import serialize
from pyverlet.data.atomic_file import Closing, replacing
from pyverlet.data.settings_json import plain, to_json
from pyverlet.data.snapshot import versions
from pyverlet.scenes import SCENES, Scene
from pyverlet.world.world import World

FORMAT = 1

SCENE_FILE = "scene.json"  # in the folder of a study: a copy of the scene file, if its scene came from one
SKETCH = "sketch"  # key of `plan.json` for the sketch's place, which does not distinguish studies


class Run(NamedTuple):
    """One run: its number in the grid, its key and its settings as the scene takes them."""

    number: int
    key: str
    settings: dict[str, Any]


@dataclass(frozen=True)
class Plan:
    """A study: common settings and values by setting, and the measure after so many `frames` of `dt` s.

    Without `frames` the measure steps the world.
    """

    scene: Scene
    grid: dict[str, list[Any]]
    settings: dict[str, Any]
    measure: Callable[[World], Any]
    frames: int | None
    dt: float

    def about(self) -> dict[str, Any]:
        """All but the grid, for JSON: studies that differ in it are different."""
        return {
            "format": FORMAT,
            "scene": _scene(self.scene),
            "settings": to_json(dict(sorted(self.settings.items()))),
            # Without its module, which differs between running and importing a script.
            "measure": getattr(self.measure, "__qualname__", type(self.measure).__qualname__),
            "frames": self.frames,
            "dt": self.dt,
        }

    def runs(self) -> list[Run]:
        """All runs, with the last setting of the grid varying fastest."""
        head = _canonical(self.about())
        known = [
            [(value, f"{json.dumps(name)}:{_canonical(plain(name, value))}") for value in values]
            for name, values in self.grid.items()
        ]
        runs = []
        for number, chosen in enumerate(itertools.product(*known)):
            text = head + ",".join(sorted(said for _, said in chosen))
            key = hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
            runs.append(Run(number, key, dict(zip(self.grid, (value for value, _ in chosen), strict=True))))
        return runs

    def world(self, run: Run) -> World:
        """The initial world of a run, on one thread, as runs share the cores."""
        return self.scene.world(**{"threads": 1, **self.settings, **run.settings})


def bare(scene: Scene) -> Scene:
    """The scene without parts for viewing, which may be functions that cannot be sent to other processes."""
    return replace(scene, show=replace(scene.show, view=None, seconds=None), closed_form=None, variants=())


def _scene(scene: Scene) -> Any:
    if SCENES.get(scene.name) is scene:
        return scene.name
    document = getattr(scene, "document", None)
    if document is not None:
        return serialize.plain(serialize.pack(document))
    if scene.sketch is not None:
        return {"name": scene.name, "sketch": scene.sketch.name, "source": scene.sketch.digest}
    build = scene.build
    return {"name": scene.name, "build": f"{build.__module__}:{getattr(build, '__qualname__', type(build).__qualname__)}"}


def _canonical(value: Any) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


_SYNC_S = 1.0  # interval of writes to the disk, s: later rows may be lost in a power cut

_NEEDED = {"key", "settings", "start", "end", "values", "error", "made_by"}


@cache
def made_by() -> dict[str, str]:
    """What determines the bits of rows: versions, and a hash of the kernels' sources."""
    return versions() | {"kernels": sources_hash()}


def open_folder(folder: Path, plan: Plan) -> None:
    """Create the folder, or check that it is this study's, whose grid may have grown.

    Raises:
        InputError: it cannot be written, or has another study.
    """
    about, path = plan.about(), folder / "plan.json"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else None
    except OSError as error:
        raise InputError(f"out is '{folder}', which cannot be used ({error.strerror}); allowed is a folder of yours") from None
    except ValueError:
        raise InputError(f"'{path}' is no plan of a study; allowed is a new folder") from None
    if known is not None:
        for name, value in about.items():
            theirs = known.get(name) if isinstance(known, dict) else None
            if theirs != value:
                there, here = (  # for a scene document its name; otherwise the beginning
                    cut(repr(each["name"] if isinstance(each, dict) and "name" in each else each), 80) for each in (theirs, value)
                )
                other = f"is {there}, not {here}" if there != here else f"is another {there}"
                raise InputError(f"'{folder}' has a study whose {name} {other}; allowed is a new folder")
    if plan.scene.sketch is not None:  # stored, without distinguishing studies
        about |= {SKETCH: str(plan.scene.sketch.path.resolve())}
    grid = {name: [plain(name, value) for value in values] for name, values in plan.grid.items()}
    wanted = json.dumps({**about, "grid": grid}, indent=1).encode() + b"\n"
    if known is None or path.read_bytes() != wanted:
        if known is None and getattr(plan.scene, "document", None) is not None:
            plan.scene.write(folder / SCENE_FILE)
        with replacing(path) as file:
            file.write(wanted)


@contextlib.contextmanager
def only_one(folder: Path) -> Iterator[None]:
    """Context in which no other process makes rows here; InputError if one does."""
    with file_lock.locked(folder / ".lock") as ours:
        if not ours:
            raise InputError(f"'{folder}' is a study that another process is making; allowed is one at a time")
        yield


class Rows(Closing):
    """The rows of a study by key, and the files to which they are added; `read_only` does not change those."""

    def __init__(self, folder: Path, *, read_only: bool = False) -> None:
        self._path, self._timing = folder / "rows.jsonl", folder / "timing.jsonl"
        self._rows: dict[str, dict[str, Any]] = {}
        self._files: list[BinaryIO] = []
        self._synced = monotonic()
        sound = self._read()
        if not read_only:
            try:
                if self._path.exists() and sound < self._path.stat().st_size:
                    os.truncate(self._path, sound)  # an incomplete last line
                self._files = [self._path.open("ab"), self._timing.open("ab")]
            except OSError as error:
                raise InputError(f"'{folder}' cannot be written ({error.strerror}); allowed is a folder of yours") from None

    def _read(self) -> int:
        """Size of the complete lines in bytes. A damaged line is ignored, so its run is repeated."""
        raw = self._path.read_bytes() if self._path.exists() else b""
        whole = raw.rfind(b"\n") + 1
        for line in raw[:whole].splitlines():
            try:
                row = json.loads(line)
            except ValueError:
                continue
            if isinstance(row, dict) and row.keys() >= _NEEDED:
                self._rows[row["key"]] = row
        return whole

    def get(self, key: str) -> Mapping[str, Any] | None:
        """The row of a run, if any; the last one if it was repeated."""
        return self._rows.get(key)

    def add(self, row: dict[str, Any], seconds: float) -> None:
        """Store a row, even if this process is killed next."""
        rows, timing = self._files
        rows.write(json.dumps(row, separators=(",", ":"), allow_nan=False).encode() + b"\n")
        rows.flush()
        timing.write(json.dumps({"key": row["key"], "seconds": round(seconds, 6), "host": socket.gethostname()}).encode() + b"\n")
        self._rows[row["key"]] = row
        if monotonic() - self._synced > _SYNC_S:
            self._sync()

    def _sync(self) -> None:
        for file in self._files:
            file.flush()
            os.fsync(file.fileno())
        self._synced = monotonic()

    def close(self) -> None:
        self._sync()
        for file in self._files:
            file.close()


def _cells(plan: Plan, rows: Sequence[Mapping[str, Any]]) -> tuple[list[str], list[list[Any]]]:
    """Names of columns, and a list of cells per row; None where a failed run has none."""
    measured = next((list(row["values"]) for row in rows if row["error"] is None), [])
    number = {run.key: run.number for run in plan.runs()}
    made = list(made_by())
    head = ["run", *plan.grid, *(f"{name}'" if name in plan.grid else name for name in measured), "start", "end", "error", *made]
    lines = []
    for row in rows:
        values = row["values"] or {}
        cells = [number[row["key"]], *(row["settings"][name] for name in plan.grid), *(values.get(name) for name in measured)]
        lines.append([*cells, row["start"], row["end"], row["error"], *(row["made_by"].get(name) for name in made)])
    return head, lines


def write_table(folder: Path, plan: Plan, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write `table.csv`, with numbers as Python writes them, so that no bit is lost."""
    head, lines = _cells(plan, rows)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(head)
    writer.writerows([_text(cell) for cell in line] for line in lines)
    with replacing(folder / "table.csv") as file:
        file.write(text.getvalue().encode())


def _text(cell: Any) -> str:
    if cell is None:
        return ""
    if isinstance(cell, float | int) and not isinstance(cell, bool):
        return repr(cell)
    return cell if isinstance(cell, str) else json.dumps(cell)


def as_array(plan: Plan, rows: Sequence[Mapping[str, Any]]) -> NDArray[Any]:
    """A structured array of the rows: integers, floats, bools or text by column; NaN for missing numbers."""
    head, lines = _cells(plan, rows)
    columns = [_column([line[k] for line in lines]) for k in range(len(head))]
    table = np.zeros(len(lines), [(name, column.dtype) for name, column in zip(head, columns, strict=True)])
    for name, column in zip(head, columns, strict=True):
        table[name] = column
    return table


def _column(cells: list[Any]) -> NDArray[Any]:
    kinds = {type(cell) for cell in cells}
    if cells and kinds <= {int}:
        return np.array(cells, np.int64) if all(abs(cell) < 2**63 for cell in cells) else np.array(cells, float)
    if cells and kinds == {bool}:
        return np.array(cells)
    if cells and kinds <= {int, float, type(None)} and kinds != {type(None)}:
        return np.array([np.nan if cell is None else cell for cell in cells], float)
    return np.array([_text(cell) for cell in cells] or [""], str)[: len(cells)]
