"""The comparison with other engines runs, with those that are installed, and measures them alike."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_the_comparison_runs_and_writes_its_rows(tmp_path: Path) -> None:
    table = tmp_path / "rows.csv"
    command = [sys.executable, "-m", "benchmarks", "--particles", "60", "--frames", "3", "--csv", str(table)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900, check=True)
    rows = {row["engine"]: row for row in csv.DictReader(table.read_text().splitlines())}
    assert {"pyverlet, 1 thread", "pyverlet, 2 threads", "pyverlet, brute force"} <= set(rows)
    assert "60 discs settled" in run.stdout
    for row in rows.values():
        assert row["engine"] in run.stdout
        assert float(row["ms_per_frame"]) > 0
        assert 0 <= float(row["overlap_mean"]) <= float(row["overlap_max"]) < 0.05
        assert row["outside"] == "0"
    # One and two threads give the same bits, so the same overlap.
    assert rows["pyverlet, 1 thread"]["overlap_max"] == rows["pyverlet, 2 threads"]["overlap_max"]


@pytest.mark.slow
def test_the_physics_of_every_engine_is_measured() -> None:
    command = [sys.executable, "-m", "benchmarks", "physics", "--particles", "40"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900, check=True)
    (ours,) = [line for line in run.stdout.splitlines() if line.startswith("pyverlet, 1 thread")]
    # worst rebound below 1 % of the drop, the gas's energy kept to three digits
    assert float(ours.split("float32")[1].split("%")[0]) < 1.0
    assert " 1.000 " in ours


@pytest.mark.slow
def test_the_cost_of_a_force_of_ones_own_is_measured() -> None:
    command = [sys.executable, "-m", "benchmarks.forces", "--particles", "60", "--frames", "3"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900, check=True)
    assert "60 circles" in run.stdout
    assert float(run.stdout.split("ratio")[1]) > 0


@pytest.mark.slow
def test_this_version_is_as_fast_as_itself() -> None:
    command = [sys.executable, "-m", "benchmarks", "beside", "--checkout", str(ROOT), "--particles", "60", "--turns", "4"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=900, check=True)
    first = run.stdout.split("ratio")[1].splitlines()[1].split()
    there, here, ratio = float(first[4]), float(first[5]), float(first[6])
    assert 0.2 < ratio < 5.0  # that the two are what is divided, on however noisy a machine
    assert ratio == pytest.approx(here / there, rel=0.5)
    assert run.stdout.count("8, 8 substeps") == len(run.stdout.split("ratio")[1].splitlines()) - 1


@pytest.mark.parametrize(
    ("options", "said"), [([], "needs --checkout FOLDER"), (["--checkout", "nowhere"], "checkout is 'nowhere'")]
)
def test_beside_what_is_asked_in_a_sentence(options: list[str], said: str) -> None:
    run = subprocess.run([sys.executable, "-m", "benchmarks", "beside", *options], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode != 0
    assert said in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.slow
def test_links_that_come_and_go_are_as_many_as_stay() -> None:
    code = """
from benchmarks.linked_frames import PER_FRAME, STAY, Passing
from benchmarks.links import cloth
for single in (False, True):
    world = Passing(cloth(10, 6, 3), 10, single=single)
    kept = sum(map(len, world._world.links))
    for _ in range(STAY + 5):
        world.step()
    assert sum(map(len, world._world.links)) == kept + STAY * PER_FRAME
"""
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, timeout=300, check=True)
