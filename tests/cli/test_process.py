"""The installed command as a process of its own: streams, signals, what it loads."""

import csv
import os
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

import pytest
from tests.programs import Program, python

ROOT = Path(__file__).resolve().parents[2]
POSIX = pytest.mark.skipif(os.name == "nt", reason="no SIGINT to a child on Windows, and no shell's pipe of POSIX")


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder where children look for modules first."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])]))
    return tmp_path


def test_script_is_installed() -> None:
    script = Path(sysconfig.get_path("scripts")) / ("pyverlet.exe" if os.name == "nt" else "pyverlet")
    if not script.exists():
        pytest.skip("the package is not installed here, only importable")
    done = subprocess.run([script, "list"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0
    assert "cage" in done.stdout


def test_bad_input_in_a_real_process() -> None:
    done = python("-m", "pyverlet", "run", "cagee")
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)


@POSIX
def test_ctrl_c_ends_a_run_with_130() -> None:
    with Program("-m", "pyverlet", "run", "cage", "--particles", "200", "--seconds", "100000", "--json") as program:
        assert "of" in program.line(error=True)  # progress: it is running
        time.sleep(0.2)
        out, err = program.end()
    assert (program.process.returncode, out, err.splitlines()[-1]) == (130, "", "pyverlet: interrupted")


USER = """
import os, signal, pyverlet
try:
    os.kill(os.getpid(), signal.SIGINT)
except KeyboardInterrupt:
    print("mine")
"""
INTERRUPTED_IMPORT = """
import os, signal, time
os.kill(os.getpid(), signal.SIGINT)
time.sleep(10)
"""


@POSIX
@pytest.mark.parametrize("module", ["numpy", "typer"])
@pytest.mark.parametrize("script", [False, True], ids=["module", "script"])
def test_ctrl_c_while_the_command_loads_is_a_sentence(path: Path, module: str, script: bool) -> None:
    (path / f"{module}.py").write_text(INTERRUPTED_IMPORT)  # the library whose import is interrupted
    installed = path / "scripts" / "pyverlet"
    installed.parent.mkdir()
    installed.write_text("import sys\nfrom pyverlet.cli import main\nsys.exit(main())\n")
    with Program(*([str(installed)] if script else ["-m", "pyverlet"]), "list") as program:
        said = program.process.communicate(timeout=60)
    assert (program.process.returncode, *said) == (130, "", "pyverlet: interrupted\n")


@POSIX
@pytest.mark.parametrize("start", [["-c", "import user"], ["-m", "user"]])
def test_who_imports_the_library_keeps_ctrl_c(path: Path, start: list[str]) -> None:
    (path / "user").mkdir()
    # The package itself imports the library, while Python still looks for what it is to run.
    (path / "user" / "__init__.py").write_text(USER)
    (path / "user" / "__main__.py").write_text("")
    with Program(*start) as program:
        said = program.process.communicate(timeout=60)
    assert (program.process.returncode, *said) == (0, "mine\n", "")


@POSIX
def test_a_closed_pipe_is_no_drama() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "pyverlet", "list", "--json"]
    process = subprocess.Popen(command, stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    _, err = process.communicate(timeout=60)
    assert "Traceback" not in err
    assert "Error" not in err


LOADED = """
import sys
def look(*never): print("loaded:", *(name for name in never if name in sys.modules), file=sys.stderr)
import pyverlet
look("starlette", "uvicorn", "websockets", "typer", "matplotlib", "pyverlet.viewers.launch")
import pyverlet.viewers, pyverlet.record
look("starlette", "uvicorn", "websockets", "asyncio", "av", "PIL")
from pyverlet.cli import main
main(["list"])
look("starlette", "uvicorn", "websockets", "matplotlib")
main(["run", "fall", "--frames", "1"])
look("starlette", "uvicorn", "matplotlib")
"""


def test_loads_only_what_it_needs() -> None:
    said = python("-c", LOADED, check=True).stderr.splitlines()
    assert [line for line in said if line.startswith("loaded:")] == ["loaded:"] * 4


# ---- The benchmarks run, with those other engines that are installed, and measure them alike ----


def benchmark(*arguments: str) -> str:
    """What a benchmark prints."""
    return python("-m", *arguments, cwd=ROOT, check=True, timeout=900).stdout


@pytest.mark.slow
def test_the_comparison_runs_and_writes_its_rows(tmp_path: Path) -> None:
    table = tmp_path / "rows.csv"
    said = benchmark("benchmarks", "--particles", "60", "--frames", "3", "--csv", str(table))
    rows = {row["engine"]: row for row in csv.DictReader(table.read_text().splitlines())}
    assert {"pyverlet, 1 thread", "pyverlet, 2 threads", "pyverlet, brute force"} <= set(rows)
    assert "60 discs settled" in said
    for row in rows.values():
        assert row["engine"] in said
        assert float(row["ms_per_frame"]) > 0
        assert 0 <= float(row["overlap_mean"]) <= float(row["overlap_max"]) < 0.05
        assert row["outside"] == "0"
    # One and two threads give the same bits, so the same overlap.
    assert rows["pyverlet, 1 thread"]["overlap_max"] == rows["pyverlet, 2 threads"]["overlap_max"]


@pytest.mark.slow
def test_the_physics_of_every_engine_is_measured() -> None:
    said = benchmark("benchmarks", "physics", "--particles", "40")
    (ours,) = [line for line in said.splitlines() if line.startswith("pyverlet, 1 thread")]
    # worst rebound below 1 % of the drop, the gas's energy kept to three digits
    assert float(ours.split("float32")[1].split("%")[0]) < 1.0
    assert " 1.000 " in ours


@pytest.mark.slow
def test_the_cost_of_a_force_of_ones_own_is_measured() -> None:
    said = benchmark("benchmarks.forces", "--particles", "60", "--frames", "3")
    assert "60 circles" in said
    assert float(said.split(" times with, ")[1].split()[0]) > 0


@pytest.mark.slow
def test_this_version_is_as_fast_as_itself() -> None:
    said = benchmark("benchmarks", "beside", "--checkout", str(ROOT), "--particles", "60", "--turns", "4")
    table = said.split("ratio")[1].splitlines()[1:]
    there, here, ratio = map(float, table[0].split()[4:7])
    assert 0.2 < ratio < 5.0  # that the two are what is divided, on however noisy a machine
    assert ratio == pytest.approx(here / there, rel=0.5)
    assert said.count("8, 8 substeps") == len(table)


@pytest.mark.parametrize(
    ("options", "said"), [([], "needs --checkout FOLDER"), (["--checkout", "nowhere"], "checkout is 'nowhere'")]
)
def test_beside_what_is_asked_in_a_sentence(options: list[str], said: str) -> None:
    run = python("-m", "benchmarks", "beside", *options, cwd=ROOT)
    assert run.returncode != 0
    assert said in run.stderr
    assert "Traceback" not in run.stderr


PASSING = """
from benchmarks.linked_frames import PER_FRAME, STAY, Passing
from benchmarks.links import cloth
for single in (False, True):
    world = Passing(cloth(10, 6, 3), 10, single=single)
    kept = sum(map(len, world._world.links))
    for _ in range(STAY + 5):
        world.step()
    assert sum(map(len, world._world.links)) == kept + STAY * PER_FRAME
"""
FITS = """
from math import isclose
from benchmarks.roofline import moved
from benchmarks.scale import exponent, line, serial_share
n = (1e3, 1e4, 1e5)
c0, c1 = line(n, [0.02 + 3e-4 * each for each in n])  # T = c0 + c1 n
assert isclose(c0, 0.02, rel_tol=1e-9) and isclose(c1, 3e-4, rel_tol=1e-9)
assert line(n, [3e-4 * each - 0.01 for each in n])[0] == 0.0  # no frame takes less than no time
assert isclose(exponent(n, [7 * each**1.25 for each in n]), 1.25, rel_tol=1e-9)  # T = 7 n^b
for s in (0.0, 0.01, 0.3, 1.0):  # T(p) = T(1) (s + (1 - s) / p)
    assert isclose(serial_share({p: 5 * (s + (1 - s) / p) for p in (1, 2, 4, 16)}), s, abs_tol=1e-9)
smaller, larger = (moved(f, 3.0, 2.5, 0.1, 8) for f in (4, 8))
assert all(smaller[stage] < larger[stage] <= 2 * smaller[stage] for stage in smaller)  # numbers twice as long, indices not
"""


@pytest.mark.parametrize(
    "code", [pytest.param(PASSING, marks=pytest.mark.slow, id="links that come and go are as many as stay"),
             pytest.param(FITS, id="fits find what times are made of")]
)  # fmt: skip
def test_parts_of_benchmarks(code: str) -> None:
    python("-c", code, cwd=ROOT, check=True)


@pytest.mark.slow
def test_costs_are_measured_fitted_and_drawn(tmp_path: Path) -> None:
    table, picture = tmp_path / "rows.csv", tmp_path / "scale.png"
    files = ("--csv", str(table), "--plot", str(picture))
    said = benchmark("benchmarks", "scale", "--largest", "300", "--threads", "1", *files)
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert [(row["motion"], row["particles"], row["threads"]) for row in rows] == [
        (motion, "300", "1") for motion in ("settled", "falling")
    ]
    for row in rows:
        # Nanoseconds a disc and substep are those of the frame over all of them.
        each = 1e6 * float(row["ms"]) / (300 * int(row["substeps"]))
        assert float(row["ns_per_particle_substep"]) == pytest.approx(each)
        assert 0 <= float(row["mean"]) <= float(row["largest"]) < 0.05
    assert "GB/s" in said
    assert "ns that memory takes" in said
    assert picture.read_bytes().startswith(b"\x89PNG")
