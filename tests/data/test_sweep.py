"""Sweeps: the same table byte for byte however it came about, and one sentence for what cannot be."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import bits_after, refused

import pyverlet as pv
from pyverlet.data import sweep_run
from pyverlet.data.sweep import Study
from pyverlet.viewers import launch

GRID = {"friction": [0.0, 0.4], "seed": range(4)}


def height(world: pv.World) -> dict[str, Any]:
    return {"height": float(world.position[:, 1].max()), "circles": len(world)}


def fails_for_three(world: pv.World) -> float:
    if len(world) == 3:
        raise ArithmeticError("three\nis too many")
    return 1.0


def ends_at_seven(world: pv.World) -> float:
    if len(world) == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return 0.5 * len(world)


def small(out: Path, grid: Any = GRID, **options: Any) -> Study:
    given: dict[str, Any] = {"measure": height, "seconds": 0.1, "particles": 12} | options
    return pv.sweep("box", grid, out=out, **given)


@pytest.fixture(autouse=True)
def _importable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes that are started find this module by its name, however pytest was."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2]))


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder: Path = tmp_path_factory.mktemp("serial") / "study"
    small(folder).run(processes=1)
    return folder


def test_each_row_is_its_world(serial: Path) -> None:
    study = small(serial)
    table = study.array()
    assert study.status() == (8, 8, 0, 0)
    assert table["friction"].tolist() == [0.0] * 4 + [0.4] * 4
    assert table["seed"].tolist() == [0, 1, 2, 3] * 2
    assert table["circles"].dtype == np.int64
    for k in (1, 6):
        world = study.world(k)
        assert world.time == 0.0
        assert world.state_hash() == table["start"][k]
        assert bits_after(world, 0.1) == table["end"][k]
        assert height(world)["height"] == table["height"][k]
    assert study.verify(rows=3).differ == []
    lines = (serial / "table.csv").read_text().splitlines()
    assert lines[0].startswith("run,friction,seed,height,circles,start,end,error,pyverlet,numpy,python,kernels")
    assert len(lines) == 9


def test_processes_and_executors_make_the_same_table(serial: Path, tmp_path: Path) -> None:
    expected = (serial / "table.csv").read_bytes()
    study = small(tmp_path / "processes")
    study.run(processes=2)
    assert (tmp_path / "processes" / "table.csv").read_bytes() == expected
    with ThreadPoolExecutor(2) as executor:
        small(tmp_path / "threads").run(executor)
    assert (tmp_path / "threads" / "table.csv").read_bytes() == expected


def test_a_torn_row_is_made_again_and_nothing_else(serial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = small(tmp_path)
    lines = (serial / "rows.jsonl").read_bytes().splitlines(keepends=True)
    (tmp_path / "rows.jsonl").write_bytes(b"".join(lines[4:6]) + b'{"damaged": \n' + lines[0] + lines[7][:50])
    made: list[int] = []
    first = sweep_run.one

    def noted(plan: Any, run: Any) -> Any:
        made.append(run.number)
        return first(plan, run)

    monkeypatch.setattr(sweep_run, "one", noted)
    study.run(processes=1)
    assert made == [1, 2, 3, 6, 7]
    assert (tmp_path / "table.csv").read_bytes() == (serial / "table.csv").read_bytes()
    study.run(processes=1)
    assert len(made) == 5


def test_a_grid_may_grow(serial: Path, tmp_path: Path) -> None:
    small(tmp_path, {"friction": [0.4], "seed": range(2)}).run(processes=1)
    study = small(tmp_path)
    assert study.status().done == 2
    study.run(processes=1)
    assert (tmp_path / "table.csv").read_bytes() == (serial / "table.csv").read_bytes()


def test_a_run_that_raises_is_a_row_that_says_so(tmp_path: Path) -> None:
    study = pv.sweep("box", {"particles": [2, 3, 4]}, measure=fails_for_three, seconds=0.0, out=tmp_path)
    study.run(processes=1)
    table = study.array()
    assert table["error"].tolist() == ["", "ArithmeticError: three is too many", ""]
    assert np.isnan(table["value"][1])
    assert table["value"][[0, 2]].tolist() == [1.0, 1.0]
    assert study.status().failed == 1
    assert study.verify().runs == [0, 2]
    before = (tmp_path / "rows.jsonl").read_bytes()
    study.run(processes=1)
    assert (tmp_path / "rows.jsonl").read_bytes() == before
    study.run(processes=1, again=True)
    assert len((tmp_path / "rows.jsonl").read_bytes()) > len(before)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_a_run_that_ends_its_process_costs_no_other(tmp_path: Path) -> None:
    study = pv.sweep("box", {"particles": range(1, 13)}, measure=ends_at_seven, seconds=0.0, out=tmp_path)
    study.run(processes=2)
    table = study.array()
    assert [k for k, error in enumerate(table["error"]) if error] == [6]
    assert table["error"][6] == sweep_run.ENDED
    assert np.delete(table["value"], 6).tolist() == [0.5 * k for k in range(1, 13) if k != 7]


KILLED = """
import sys
sys.path[:0] = sys.argv[2:]
import test_sweep
test_sweep.small(test_sweep.Path(sys.argv[1]), {"friction": [0.0, 0.4], "seed": range(50)}).run(processes=1)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_killed_and_started_again_it_comes_to_the_same(tmp_path: Path) -> None:
    grid, whole, cut = {"friction": [0.0, 0.4], "seed": range(50)}, tmp_path / "whole", tmp_path / "cut"
    plan = small(whole, grid)
    plan.run(processes=1)
    command = [sys.executable, "-c", KILLED, str(cut), str(Path(__file__).parent)]
    for least in (1, 30):
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as run:
            until = time.monotonic() + 120
            while time.monotonic() < until and run.poll() is None and count_rows(cut) < least:
                time.sleep(0.002)
            run.kill()
    study = small(cut, grid)
    assert 30 <= study.status().done < 100
    # As it may look when the disk was not told in time, too.
    with (cut / "rows.jsonl").open("ab") as file:
        file.write(b'{"key": "half a row')
    text = (cut / "rows.jsonl").read_bytes()
    study.run(processes=2)
    assert (cut / "rows.jsonl").read_bytes()[:100] == text[:100]
    assert (cut / "table.csv").read_bytes() == (whole / "table.csv").read_bytes()


ORPHANED = """
import sys
sys.path[:0] = sys.argv[2:]
import test_sweep
if __name__ == "__main__":
    test_sweep.small(test_sweep.Path(sys.argv[1]), {"seed": range(3000)}, measure=test_sweep.process).run(processes=2)
"""


def process(world: pv.World) -> int:
    return os.getpid()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_processes_end_with_a_coordinator_that_is_killed(tmp_path: Path) -> None:
    script = tmp_path / "orphaned.py"
    script.write_text(ORPHANED)
    command = [sys.executable, str(script), str(tmp_path / "study"), *map(str, Path(__file__).parents[:3:2])]
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as run:
        until = time.monotonic() + 120
        while time.monotonic() < until and run.poll() is None and count_rows(tmp_path / "study") < 30:
            time.sleep(0.01)
        run.kill()
    rows = (tmp_path / "study" / "rows.jsonl").read_text().splitlines()
    left = {json.loads(row)["values"]["value"] for row in rows[:-1]}
    assert left
    while left and time.monotonic() < until:
        left = {number for number in left if lives(number)}
        time.sleep(0.05)
    assert not left


def lives(number: int) -> bool:
    """Whether there is a process of that number that has not ended."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{number}/stat")
    return not (status.exists() and status.read_text().rsplit(")", 1)[1].split()[0] == "Z")


def count_rows(folder: Path) -> int:
    path = folder / "rows.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


def test_many_rows_are_read_at_once(tmp_path: Path) -> None:
    # Thousands of rows: what a study does with each is in proportion, and it looks at each once.
    study = small(tmp_path, {"seed": range(3_000)}, seconds=0.0)
    lines = []
    for run in study._runs:
        row = {**sweep_run._blank(run), "values": {"height": 1.0, "circles": 12}, "start": "0" * 16, "end": "0" * 16}
        lines.append(json.dumps(row))
    (tmp_path / "rows.jsonl").write_text("\n".join(lines) + "\n")
    study.run(processes=1)
    assert len(study.array()) == 3_000


def test_bad_input_gets_a_sentence_and_loses_nothing(serial: Path, tmp_path: Path) -> None:
    before = {path.name: path.read_bytes() for path in serial.iterdir() if path.is_file()}

    def no_study(said: str, grid: Any = GRID, *, out: Path = tmp_path / "new", scene: str = "box", **options: Any) -> None:
        given: dict[str, Any] = {"measure": height, "seconds": 0.1, "particles": 12} | options
        refused(said, pv.sweep, scene, grid, out=out, **given)

    no_study("did you mean 'cage'", scene="cagee")
    no_study("no setting 'frction' .did you mean 'friction'", {"frction": [0]})
    no_study("friction is -1", {"friction": [0, -1]})
    no_study("friction is nan", {"friction": [np.nan]})
    no_study("friction of the grid is 0.5", {"friction": 0.5})
    no_study("seed of the grid has 1 twice", {"seed": [1, 2, 1]})
    no_study("grid is {}", {})
    no_study("particles is in the grid and beside it", {"particles": [1]})
    no_study("measure is 3", measure=3)
    no_study("dt is 0", dt=0)
    no_study("seconds is nan", seconds=np.nan)
    no_study("has a study whose scene is 'box'", scene="cage", out=serial)
    no_study("has a study whose frames is 6", seconds=0.2, out=serial)
    no_study("has a study whose settings", particles=13, out=serial)
    pv.scenes.get("box").write(tmp_path / "mine.toml")
    written = pv.scenes.read(tmp_path / "mine.toml")
    pv.sweep(written, {"friction": [0.0]}, out=tmp_path / "other", seconds=0.1)
    no_study("has a study whose scene is another 'box'; allowed is a new folder$", out=tmp_path / "other")
    (tmp_path / "file").write_text("")
    no_study("cannot be used", out=tmp_path / "file" / "study")
    (tmp_path / "odd").mkdir()
    (tmp_path / "odd" / "plan.json").write_text("{")
    no_study("no plan", out=tmp_path / "odd")
    study = small(serial)
    refused("executor is 7", small(tmp_path / "e").run, 7)
    refused("k is 8", study.world, 8)
    assert {path.name: path.read_bytes() for path in serial.iterdir() if path.is_file()} == before


def test_measures_that_return_other_columns(tmp_path: Path) -> None:
    def fickle(world: pv.World) -> dict[str, float]:
        return {"a": 1.0} if len(world) < 4 else {"b": 1.0}

    study = pv.sweep("box", {"particles": [2, 3, 4, 5]}, measure=fickle, seconds=0.0, out=tmp_path)
    refused("measure returned b for run", study.run, processes=1)
    assert study.status().done == 3
    for number, wrong in enumerate((np.nan, {1: object()}, object())):
        given: list[Any] = [wrong]
        bad = pv.sweep("box", {"particles": [2]}, measure=lambda world: given[0], seconds=0.0, out=tmp_path / str(number))  # noqa: B023
        bad.run(processes=1)
        assert "measure returned" in bad.array()["error"][0]


def test_rows_of_other_kernels_never_mix(serial: Path, tmp_path: Path) -> None:
    study = small(tmp_path)
    text = (serial / "rows.jsonl").read_text()
    row = json.loads(text.splitlines()[0])
    row["made_by"]["kernels"] = "0" * 16
    (tmp_path / "rows.jsonl").write_text(json.dumps(row) + "\n")
    assert study.status().foreign == 1
    refused("has rows made by", study.run, processes=1)
    study.run(processes=1, again=True)
    assert (tmp_path / "table.csv").read_bytes() == (serial / "table.csv").read_bytes()


def test_what_was_forged_is_found(serial: Path, tmp_path: Path) -> None:
    study = small(tmp_path)
    rows = [json.loads(line) for line in (serial / "rows.jsonl").read_text().splitlines()]
    rows[2]["values"]["height"] += 1e-9
    (tmp_path / "rows.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    assert study.verify(rows=8).differ == [2]


def test_one_at_a_time(tmp_path: Path) -> None:
    study = small(tmp_path)
    code = (
        "import sys; from pathlib import Path; from pyverlet.data import sweep_plan\n"
        "with sweep_plan.only_one(Path(sys.argv[1])):\n    print('mine', flush=True)\n    sys.stdin.read()"
    )
    other = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    with other:
        assert other.stdout is not None
        assert other.stdout.readline().strip() == b"mine"
        refused("another process", study.run, processes=1)
        other.communicate()


def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Any, refusal: Any, modules: Any) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    modules(mine="def tops(world):\n    return {'top': float(world.position[:, 1].max())}\n")
    made = ("sweep", "run", "box", "--vary", "friction=0,0.5", "--vary", "seed=1:3", "--set", "particles=8", "--seconds", "0.05")
    code, text, _ = run(*made, "--measure", "mine:tops", "--out", "study", "--processes", "1")
    assert code == 0
    assert text.splitlines()[0].split() == ["run", "friction", "seed", "top", "start", "end", "error"]
    assert text.splitlines()[-1] == "4 of 4 runs"
    code, text, _ = run("sweep", "status", "study", "--json")
    assert json.loads(text) == {"runs": 4, "done": 4, "failed": 0, "foreign": 0}
    for measure in ((), ("--measure", "mine:tops")):
        code, text, _ = run("sweep", "verify", "study", "--rows", "2", *measure)
        assert (code, text.count("all as they were")) == (0, 1)
    shown: list[pv.World] = []
    monkeypatch.setattr(launch, "serve", lambda build, **options: shown.extend(build().panels.worlds))
    assert run("sweep", "show", "study", "3")[0] == 0
    assert shown[0].state_hash() == pv.scenes.get("box").world(friction=0.5, seed=2, particles=8).state_hash()
    row = json.loads((tmp_path / "study" / "rows.jsonl").read_text().splitlines()[0])
    row["end"] = "0" * 16
    (tmp_path / "study" / "rows.jsonl").write_text(json.dumps(row) + "\n")
    assert run("sweep", "verify", "study")[0] == 1
    for wrong, said in (
        (("sweep", "status", "nowhere"), "has no study"),
        ((*made, "--out", "x", "--measure", "mine:bottoms"), "mine has no bottoms"),
        ((*made, "--out", "x", "--vary", "seed"), "vary is 'seed'"),
        (("sweep", "run", "box", "--vary", "seed=1:x", "--out", "x"), "vary has '1:x'"),
    ):
        assert said in refusal(*wrong)


@pytest.mark.full
def test_dask_with_a_worker_that_is_killed(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    grid = {"friction": [0.0, 0.4], "seed": range(500)}
    small(tmp_path / "serial", grid).run(processes=1)
    with (
        distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        victim = next(iter(cluster.workers.values())).pid
        with ThreadPoolExecutor(1) as beside:
            study = small(tmp_path / "dask", grid)
            running = beside.submit(study.run, client.get_executor(pure=False), workers=2)
            while count_rows(tmp_path / "dask") < 100 and not running.done():
                time.sleep(0.01)
            os.kill(victim, signal.SIGKILL)
            running.result()
    assert (tmp_path / "dask" / "table.csv").read_bytes() == (tmp_path / "serial" / "table.csv").read_bytes()
