"""What goes wrong with machines: killed in the middle, full disks, half files, many at once. Nothing saved is lost."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.world.clock import Clock

# A kernel that is soon compiled, and calls another one.
CALL = """
import os, signal, sys, numpy as np, pyverlet
from pyverlet.compile import jit
from pyverlet.kernels import motion
def call():
    x = np.ones((4, 2))
    motion.clear_pinned(x, np.array([1.0, 0.0, 1.0, 1.0]))
    print(x.sum(), bool(motion.any_non_finite(x)), flush=True)
"""
SAID = "6.0 False"

posix = pytest.mark.skipif(os.name == "nt", reason="signals and limits of POSIX")


def start(code: str, cache: Path, **environment: str) -> subprocess.Popen[str]:
    env = {**os.environ, "PYVERLET_CACHE_DIR": str(cache), **environment}
    return subprocess.Popen(
        [sys.executable, "-c", CALL + code], env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def said(code: str, cache: Path, **environment: str) -> str:
    with start(code, cache, **environment) as process:
        out, err = process.communicate(timeout=120)
    assert process.returncode == 0, err
    return out.strip()


@posix
@pytest.mark.slow
@pytest.mark.parametrize(
    "when",
    [
        pytest.param(
            "with jit.watch_compiling(lambda: os.kill(os.getpid(), signal.SIGKILL)): call()",
            id="compiling",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "os.replace = lambda *a: os.kill(os.getpid(), signal.SIGKILL); call()",
            id="before a file is there",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            "real = os.replace\nos.replace = lambda a, b: (real(a, b), os.kill(os.getpid(), signal.SIGKILL)); call()",
            id="after the first file",
        ),
    ],
)
def test_killed_while_compiling_the_next_start_compiles(when: str, tmp_path: Path) -> None:
    with start(when, tmp_path) as process:
        process.communicate(timeout=120)
    assert process.returncode == -signal.SIGKILL
    assert said("call()", tmp_path) == SAID


@pytest.mark.slow
@pytest.mark.parametrize("harm", ["cut", *(pytest.param(each, marks=pytest.mark.slow) for each in ("empty", "flipped"))])
def test_half_a_file_is_compiled_anew(harm: str, tmp_path: Path) -> None:
    assert said("call()", tmp_path) == SAID
    kept = [path for path in tmp_path.rglob("*") if path.suffix in (".nbi", ".nbc")]
    assert kept
    for path in kept:
        data = bytearray(path.read_bytes())
        if harm == "flipped":  # where Python's pickle sees it
            data[: min(64, len(data))] = bytes(255 - byte for byte in data[:64])
        path.write_bytes(b"" if harm == "empty" else data[: len(data) // 2] if harm == "cut" else data)
    assert said("call()", tmp_path) == SAID
    counted = "seen = []\nwith jit.watch_compiling(lambda: seen.append(1)): call()\nprint(len(seen))"
    assert said(counted, tmp_path).split() == [*SAID.split(), "0"]  # and is whole again


def test_a_full_disk_keeps_nothing_and_runs(tmp_path: Path) -> None:
    full = "import shutil; from collections import namedtuple\nshutil.disk_usage = lambda p: namedtuple('U', 'free')(1000)\n"
    assert said(full + "call(); print(jit.cache_dir())", tmp_path).split() == [*SAID.split(), "None"]
    assert not list(tmp_path.rglob("*.nb?"))


@posix
@pytest.mark.slow
def test_a_folder_that_may_only_be_read_runs(tmp_path: Path) -> None:
    assert said("call()", tmp_path) == SAID
    folders = [path for path in tmp_path.rglob("*") if path.is_dir()] + [tmp_path]
    for folder in folders:
        folder.chmod(0o555)
    try:
        assert said("call()", tmp_path, TMPDIR=str(tmp_path)) == SAID
    finally:
        for folder in folders:
            folder.chmod(0o755)


@pytest.mark.slow
def test_two_versions_share_a_folder(tmp_path: Path) -> None:
    other = "real = jit.sources_hash\njit.sources_hash = lambda root=None: 'f' * 16\njit.cache_dir.cache_clear()\n"
    assert said("call()", tmp_path) == said(other + "call()", tmp_path) == said("call()", tmp_path) == SAID
    assert len([path for path in tmp_path.iterdir() if path.is_dir()]) == 2


@pytest.mark.slow  # test_two_processes_share_the_work has two
@pytest.mark.parametrize("count", [2, 8])
def test_first_starts_at_once(count: int, tmp_path: Path) -> None:
    processes = [start("call()", tmp_path) for _ in range(count)]
    told = [process.communicate(timeout=300) for process in processes]
    assert [process.returncode for process in processes] == [0] * count, told
    assert {out.strip() for out, _ in told} == {SAID}


@pytest.mark.slow
def test_no_shared_memory_is_needed(tmp_path: Path) -> None:
    # As if /dev/shm was not there: whatever asks for it fails.
    code = "import multiprocessing.synchronize as s\ndef no(*a, **k): raise OSError(38, 'no')\ns.SemLock.__init__ = no\ncall()"
    assert said(code, tmp_path) == SAID


@pytest.mark.slow
def test_one_core(tmp_path: Path) -> None:
    code = "import pyverlet as pv; call(); world = pv.World(); world.add(position=np.zeros((20000, 2))); print(world.threads)"
    assert said(code, tmp_path, PYVERLET_THREADS="1").split() == [*SAID.split(), "1"]


def test_more_threads_than_cores_is_a_sentence() -> None:
    with pytest.raises(pv.InputError, match=r"threads is 6400.*cores"):
        pv.World(threads=6400)
    done = subprocess.run(
        [sys.executable, "-m", "pyverlet", "run", "cage", "--seconds", "1", "--threads", "6400"], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert re.search(r"threads.*6400", done.stderr)
    assert "Traceback" not in done.stderr


def test_an_hour_s_gap_is_not_made_up_for_and_a_step_back_is_refused() -> None:
    clock = Clock(dt=1 / 60, max_catch_up=4)
    assert clock.advance(3600.0) == 4
    assert clock.advance(1 / 60) <= 2  # the hour is forgotten
    with pytest.raises(pv.InputError, match="elapsed is -3600"):
        clock.advance(-3600.0)
    assert sum(clock.advance(1 / 60) for _ in range(60)) >= 59


def test_no_clock_that_can_be_set_times_the_page() -> None:
    viewers = Path(pv.__file__).parent / "viewers"
    assert not [path for path in viewers.glob("*.py") if re.search(r"\btime\.time\(|datetime\.now", path.read_text())]


@posix
@pytest.mark.parametrize("name", ["SIGTERM", pytest.param("SIGHUP", marks=pytest.mark.slow)])
def test_a_closed_terminal_ends_a_run(name: str) -> None:
    command = [sys.executable, "-m", "pyverlet", "run", "cage", "--particles", "100", "--seconds", "100000"]
    ignored = signal.signal(getattr(signal, name), signal.SIG_DFL)  # as under `nohup`, which children would inherit
    try:
        started = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    finally:
        signal.signal(getattr(signal, name), ignored)
    with started as process:
        assert process.stderr
        process.stderr.readline()  # it is running
        process.send_signal(getattr(signal, name))
        _, err = process.communicate(timeout=30)
    assert process.returncode in (-getattr(signal, name), 128 + getattr(signal, name))
    assert "Traceback" not in err


@posix
@pytest.mark.slow
def test_killed_while_recording_what_was_recorded_plays(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    command = [sys.executable, "-m", "pyverlet", "record", "cage", "a.mp4", "--particles", "100", "--seconds", "10000",
               "--size", "160x120"]  # fmt: skip
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL) as process:
        until = time.monotonic() + 60
        files: list[Path] = []
        while time.monotonic() < until and sum(path.stat().st_size for path in files) < 60_000:
            time.sleep(0.05)
            files = [path for path in tmp_path.iterdir() if path.is_file()]
        process.kill()
    (film,) = files
    with av.open(str(film)) as movie:
        assert sum(1 for _ in movie.decode(video=0)) > 10


def test_a_saved_world_outlives_a_full_disk(tmp_path: Path) -> None:
    world = pv.World()
    world.add(position=np.arange(2000.0).reshape(-1, 2) * 2)
    pv.save(world, tmp_path / "a.pvsnap")
    before = (tmp_path / "a.pvsnap").read_bytes()
    code = (
        "import resource, signal, sys, numpy as np, pyverlet as pv; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "world = pv.World(); world.add(position=np.arange(8000.0).reshape(-1, 2) * 2)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))\n"
        "try: pv.save(world, 'a.pvsnap')\nexcept pv.InputError as error: print('room' in str(error))"
    )
    if os.name == "nt":
        pytest.skip("no limit on the size of files to set")
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.strip() == "True", done.stderr
    assert (tmp_path / "a.pvsnap").read_bytes() == before
