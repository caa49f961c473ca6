"""The first start: several processes compile, each kernel once, and whatever becomes of a helper, nothing is missing."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.compile import jit
from pyverlet.ground import file_lock
from pyverlet.world import rehearsals, substeps, warmup


def run(code: str, cache: Path, **environment: str) -> str:
    env = {**os.environ, "PYVERLET_CACHE_DIR": str(cache), **environment}
    return subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True, timeout=300).stdout


# Parts that are compiled in seconds, of a few kernels each.
SHORT = """
import os, subprocess, sys, numpy as np, pyverlet as pv
from pyverlet.compile import jit
from pyverlet.world import rehearsals, warmup
for name in list(rehearsals.PARTS):
    if name not in ("_motion", "_lists"): del rehearsals.PARTS[name]
"""


# Two parts of a kernel each.
TINY = """
import os, subprocess, sys, numpy as np, pyverlet as pv
from pyverlet.compile import jit
from pyverlet.world import rehearsals, warmup
from pyverlet.kernels import motion
rehearsals.PARTS.clear()
rehearsals.PARTS["one"] = lambda dtype, threads: motion.differs(np.zeros(1, dtype), np.zeros(1, dtype))
rehearsals.PARTS["two"] = lambda dtype, threads: motion.clear_pinned(np.zeros((1, 2), dtype), np.zeros(1, dtype))
warmup.rehearse = lambda world: None
"""


@pytest.mark.slow
@pytest.mark.parametrize("some", ["tiny", pytest.param("short", marks=pytest.mark.slow)])
def test_two_processes_share_the_work(some: str, tmp_path: Path) -> None:
    # Without the pipes of `_Helper`, to see both: whatever begins to compile is written to disk, under a name of its
    # own. Some helpers of kernels both compile.
    begin, parts, least = (TINY, {"one", "two"}, 2) if some == "tiny" else (SHORT, {"_motion", "_lists"}, 20)
    code = begin + (
        "counted = os.open(os.environ['COUNTED'], os.O_WRONLY | os.O_APPEND | os.O_CREAT)\n"
        "with jit.watch_compiling(lambda: os.write(counted, b'.') and None):\n"
        "    warmup._compile(np.dtype(np.float32), 1, list(rehearsals.PARTS))\n"
    )
    env = {**os.environ, "PYVERLET_CACHE_DIR": str(tmp_path), "COUNTED": str(tmp_path / "counted")}
    both = [subprocess.Popen([sys.executable, "-c", code], env=env) for _ in range(2)]
    assert [process.wait(timeout=300) for process in both] == [0, 0]
    kept = list(tmp_path.rglob("*.nbc"))
    assert least <= len(kept) <= len((tmp_path / "counted").read_text()) < 1.5 * len(kept)
    assert {path.name for path in tmp_path.rglob("compiled-float32/*")} == parts


@pytest.mark.slow  # it compiles a world's kernels anew
def test_what_is_compiled_by_many_has_the_bits_of_what_one_has(tmp_path: Path) -> None:
    code = (
        "world = pv.World(collisions=None); world.add(position=np.arange(20.0).reshape(10, 2)); pv.warm_up(world)\n"
        "world.step(0.1); print(world.state_hash())"
    )
    here = run("import numpy as np, pyverlet as pv; " + code, jit.cache_dir().parent)  # type: ignore[union-attr]
    assert run(SHORT + code, tmp_path, NUMBA_NUM_THREADS="2") == here


COUNTED = """
ours = []
pv.warm_up(pv.World(), lambda done, total: ours.append(done))
print(len(ours), len(list(jit.cache_dir().rglob("compiled-float32/*"))) if jit.cache_dir() else 2)
"""


ACCIDENTS = {
    "not started": "def fails(*a, **k): raise OSError('no more processes')\nsubprocess.Popen = fails",
    "starts and fails": "os.environ['PYTHONHOME'] = '/nowhere'",
    "killed": (
        "start = warmup._Helper.__init__\ndef killed(self, *a): start(self, *a); self._process.kill()\n"
        "warmup._Helper.__init__ = killed"
    ),
    "frozen": "warmup._Helper = None; sys.frozen = True",
    "no Python": "warmup._Helper = None; sys.executable = ''",
    "one core": "warmup._Helper = None; jit.max_threads = lambda: 1",
    "nothing can be kept": "warmup._Helper = None; jit.cache_dir = lambda: None",
}
ALWAYS = "starts and fails"


@pytest.mark.parametrize(
    "accident",
    [pytest.param(code, id=name, marks=() if name == ALWAYS else pytest.mark.slow) for name, code in ACCIDENTS.items()],
)
def test_without_a_helper_everything_is_compiled_all_the_same(accident: str, tmp_path: Path) -> None:
    began, parts = run(f"{TINY}{accident}\n{COUNTED}", tmp_path, NUMBA_NUM_THREADS="2").split()
    assert parts == "2"
    assert began == "3"  # each kernel, and the end of the line


def test_one_core_has_no_helper(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "max_threads", lambda: 1)
    with warmup._helping(np.dtype(np.float32), 1, 7) as helpers:
        assert helpers == []


@pytest.mark.slow
def test_a_helper_ends_with_its_parent() -> None:
    parent = (
        "import os, numpy as np; from pyverlet.world import warmup\n"
        "helper = warmup._Helper(np.dtype(np.float64), 1); print(helper._process.pid, flush=True); os._exit(0)"
    )
    pid = int(subprocess.run([sys.executable, "-c", parent], capture_output=True, text=True, check=True).stdout)
    for _ in range(600):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        if Path(f"/proc/{pid}/stat").exists() and Path(f"/proc/{pid}/stat").read_text().split(") ")[1][0] == "Z":
            return
        time.sleep(0.1)
    raise AssertionError("it still runs")


def test_what_is_for_later_is_compiled_behind_us_and_not_beyond(tmp_path: Path) -> None:
    code = TINY + (
        "for _ in range(2): warmup.warm_up_to_show(pv.World())\n"
        "helper, = warmup._staying\n"
        "assert helper.busy and not helper.done and set(warmup._missing(np.dtype(np.float32), 1)) == {'one', 'two'}\n"
        "print(helper._process.pid)"
    )
    pid = int(run(code, tmp_path, NUMBA_NUM_THREADS="1"))
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_only_what_a_world_needs_is_compiled_if_settings_stay(tmp_path: Path) -> None:
    code = (
        TINY
        + "pv.warm_up(pv.World(), settings=False)\nprint(len(warmup._missing(np.dtype(np.float32), 1)), len(warmup._staying))"
    )
    assert run(code, tmp_path, NUMBA_NUM_THREADS="1").split() == ["2", "0"]


def test_ctrl_c_ends_helpers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jit, "max_threads", lambda: 2)
    with pytest.raises(KeyboardInterrupt), warmup._helping(np.dtype(np.float64), 1, 7) as helpers:
        raise KeyboardInterrupt
    assert len(helpers) == 1
    assert helpers[0]._process.poll() is not None


def test_helpers_are_counted_in_the_progress(monkeypatch: pytest.MonkeyPatch) -> None:
    class Busy:
        done = 1000

        def end(self) -> None:
            pass

    monkeypatch.setattr(jit, "max_threads", lambda: 2)
    monkeypatch.setattr(warmup, "_Helper", lambda *_: Busy())
    monkeypatch.setattr(warmup, "_missing", lambda *_: ["_motion", "_lists"])
    monkeypatch.setattr(warmup, "_compile", lambda *_: None)
    seen: list[tuple[int, int]] = []
    monkeypatch.setattr(warmup, "rehearse", lambda _: None)

    @contextlib.contextmanager
    def watching(started: Callable[[], None]) -> Iterator[None]:
        yield
        started()

    monkeypatch.setattr(jit, "watch_compiling", watching)
    pv.warm_up(pv.World(), lambda done, total: seen.append((done, total)))
    assert seen[0][0] == seen[0][1] > 20


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> set[str]:
    """Names of the kernels that Python has called. What is compiled says less: other tests may have compiled it before."""
    names: set[str] = set()
    call = jit.Kernel.__call__

    def noted(kernel: jit.Kernel, *arguments: Any) -> Any:
        names.add(kernel.function.__qualname__)
        return call(kernel, *arguments)

    monkeypatch.setattr(jit.Kernel, "__call__", noted)
    return names


def test_parts_cover_what_a_world_of_circles_needs(called: set[str]) -> None:
    for part in rehearsals.PARTS.values():
        part(np.dtype(np.float32), 1)
    for friction, restitution in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):
        for room in (pv.Circle(radius=10), pv.Box((-10, -10), (10, 10)), pv.Open()):
            world = pv.World(boundary=room, collisions=pv.Collisions(friction=friction, restitution=restitution))
            world.add(position=np.random.default_rng(0).uniform(-5, 5, (60, 2)), radius=0.5)
            before = set(called)
            world.run(seconds=0.3)
            world.energy(), world.overlap(), world.momentum()
            world.mass[0] *= 100
            world.run(seconds=0.1)
            assert called - before == set(), (friction, restitution, room)


def test_rehearsals_of_larger_worlds_do_what_these_do(monkeypatch: pytest.MonkeyPatch) -> None:
    """From some numbers of circles on a frame calls other kernels, which would be compiled when the first is shown."""
    done: set[str] = set()

    def spy(owner: type, name: str) -> None:
        method = getattr(owner, name)

        def spied(*given: Any, **options: Any) -> Any:
            result = method(*given, **options)
            if result:
                done.add(name)
            return result

        monkeypatch.setattr(owner, name, spied)

    spy(substeps.Substeps, "go")
    for count, expected in ((100, {"go"}), (3000, {"go"})):
        done.clear()
        rehearsals.rehearse(pv.scenes.get("cage").world(particles=count, threads=1))
        assert done == expected, count


def _one_bounces(world: pv.World) -> None:
    world.restitution[0] = 0.5


def _one_rubs(world: pv.World) -> None:
    world.friction[0] = 0.5


def _pegs(world: pv.World) -> None:
    world.collisions = pv.Collisions(restitution=0.5)
    world.mass[0] = np.inf


def _moving_obstacle(world: pv.World) -> None:
    world.obstacles.append(pv.Segment((-3, -5), (3, -5), velocity=(0.0, 0.1)))


def _heavy_and_elastic(world: pv.World) -> None:
    world.mass[0], world.restitution[1] = 100.0, 0.5


def _across_a_seam(world: pv.World) -> None:
    world.boundary = pv.Periodic((-6, -6), (6, 6))
    world.velocity[:] = 20.0


@pytest.mark.parametrize("change", [_one_bounces, _one_rubs, _pegs, _moving_obstacle, _heavy_and_elastic, _across_a_seam])
def test_a_rehearsal_calls_all_that_the_world_will(change: Callable[[pv.World], None], called: set[str]) -> None:
    world = pv.World(boundary=pv.Circle(radius=12), threads=1)
    world.add(position=np.random.default_rng(0).uniform(-5, 5, (60, 2)), radius=0.3, allow_overlap=True)
    change(world)
    for part in rehearsals.PARTS.values():
        part(np.dtype(np.float32), 1)
    rehearsals.rehearse(world)
    before = set(called)
    world.run(seconds=0.5)
    assert called - before == set()


# ---- turns -------------------------------------------------------------------------------------------------------------

KEEP = """
import pathlib, sys
from pyverlet.ground.file_lock import turn
with turn(pathlib.Path(sys.argv[1]), "a"):
    print("mine", flush=True)
    sys.stdin.read()
"""


def test_a_turn_is_one_process_s_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "turns"
    with subprocess.Popen([sys.executable, "-c", KEEP, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdin is not None
        assert other.stdout.readline().strip() == b"mine"
        with file_lock.turn(path, "a", patience=0.0) as mine:
            assert not mine
        with file_lock.turn(path, "b", patience=0.0) as mine:
            assert mine
        timer = threading.Timer(0.3, other.kill)  # however it ends
        timer.start()
        with file_lock.turn(path, "a") as mine:
            assert mine
        timer.join()
        other.stdin.close()


def test_where_files_cannot_be_opened_everybody_has_every_turn(tmp_path: Path) -> None:
    with file_lock.turn(tmp_path / "no such folder" / "turns", "a") as mine:
        assert mine
