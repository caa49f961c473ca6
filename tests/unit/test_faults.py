"""What goes wrong with machines: killed in the middle, full disks, half files, many at once. Nothing saved is lost."""

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

posix = pytest.mark.skipif(os.name == "nt", reason="signals and limits of POSIX")


def said(code: str, **environment: str) -> str:
    env = {**os.environ, **environment}
    return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True, timeout=120).stdout


@pytest.mark.parametrize("asked", ["1", "3"])
def test_the_environment_says_how_many_threads(asked: str) -> None:
    code = """
import numpy as np, pyverlet as pv
world = pv.World()
world.add(position=np.stack(np.divmod(np.arange(20000), 200), axis=-1) * 1.1)
world.step(1 / 60)
print(world.threads)
"""
    assert said(code, PYVERLET_THREADS=asked).split() == [asked]


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
