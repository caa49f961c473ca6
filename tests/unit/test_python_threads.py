"""Worlds stepped from several Python threads at once: no crash, and the bits of one after the other."""

import os
import re
import signal
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from tests.programs import Program, python

import pyverlet as pv

# Four Python threads, each with its first world. Large enough, or told, to use two threads each.
FIRST_WORLDS = """
import sys, threading
from concurrent.futures import ThreadPoolExecutor
import numpy as np
import pyverlet as pv

def first(k):
    start.wait()
    world = pv.World(boundary=pv.Circle(radius=60), threads=2)
    place = np.stack(np.divmod(np.arange(2500), 50), axis=-1) * 1.05 - 26.0
    world.add(position=place, radius=0.5)
    for _ in range(5):
        world.step(1 / 60)
    return world.state_hash()

start = threading.Barrier(4)
with ThreadPoolExecutor(4) as pool:
    hashes = set(pool.map(first, range(4)))
start = threading.Barrier(1)
assert hashes == {first(0)}, "not the same bits"
"""


def small(seed: int) -> pv.World:
    world = pv.World(boundary=pv.Box((0, 0), (6, 6)))
    rng = np.random.default_rng(seed)
    place = np.stack(np.divmod(np.arange(16), 4), axis=-1) * 1.3 + 1.0
    world.add(position=place + 0.1 * rng.random(place.shape), velocity=rng.normal(0, 1, place.shape), radius=0.5)
    return world


def run(seed: int) -> str:
    world = small(seed)
    world.run(seconds=10 / 60)
    return world.state_hash()


@pytest.mark.slow
def test_a_pool_of_threads_steps_a_hundred_worlds() -> None:
    expected = [run(seed) for seed in range(100)]
    with ThreadPoolExecutor(4) as pool:
        assert [*pool.map(run, range(100))] == expected


# ---- one world, several threads ------------------------------------------------------------------------------------------


def drifting(count: int = 1000) -> pv.World:
    """Circles that all drift alike: a frame's positions and velocities are known from any one of them."""
    world = pv.World(gravity=(0, 0), dtype=np.float64, contacts=True)
    side = int(np.ceil(np.sqrt(count)))
    world.add(position=2.0 * np.stack(np.divmod(np.arange(count), side), axis=-1), velocity=(3.0, 0.0), radius=0.5)
    return world


def together(act: Callable[[], object], *others: Callable[[], object], again: bool = True) -> None:
    """Run each in a thread, the others `again` and again until the first is done; what one of them raises is raised here."""

    def repeat(other: Callable[[], object]) -> None:
        while not acting.done():
            other()

    with ThreadPoolExecutor(1 + len(others)) as pool:
        acting = pool.submit(act)
        for each in [acting, *(pool.submit(repeat, other) if again else pool.submit(other) for other in others)]:
            each.result()


def test_threads_that_step_one_world_take_turns() -> None:
    world, alone = small(7), small(7)
    together(*[lambda: world.run(seconds=0.5)] * 6, again=False)
    alone.run(seconds=3)
    assert (world.frames, world.time) == (180, alone.time)
    assert world.state_hash() == alone.state_hash()


def test_what_is_read_while_another_thread_steps_is_of_one_frame() -> None:
    world = drifting()
    start = world.position.copy()

    def moved_as_one(position: np.ndarray) -> bool:
        # Between two frames it is a view, which the next frame writes to, perhaps while this looks at it.
        return position.flags.writeable or float(np.ptp((position - start)[:, 0])) < 1e-9

    looks: dict[str, Callable[[], bool]] = {
        "position": lambda: moved_as_one(world.position),
        "group": lambda: moved_as_one(world.groups[0].position),
        "velocity": lambda: bool((world.velocity == (3.0, 0.0)).all()),
        "energy": lambda: world.energy().total == pytest.approx(4500.0),
        "momentum": lambda: world.momentum()[0] == pytest.approx(3000.0),
        "contacts": lambda: len(world.contacts) == 0,
        "overlap": lambda: world.overlap().contacts == 0,
        "query": lambda: len(world.in_circle(start[500] + (3.0 * world.time, 0), 20)) > 10,
        "hash": lambda: len(world.state_hash()) == 16,
        "save": lambda: len(world.save().arrays["mass"]) == 1000,
    }

    seen = dict.fromkeys(looks, 0)

    def look() -> None:
        for name, same in looks.items():
            assert same(), name
            seen[name] += 1

    def run() -> None:  # until all have been looked at, but not for ever
        for _ in range(20_000):
            if min(seen.values()) == 0:
                world.step(1 / 240)

    together(run, look)
    assert min(seen.values()) > 0


def test_two_looks_are_of_one_frame_while_the_world_is_held() -> None:
    world = small(1)

    def look() -> None:
        with world.held():
            before = world.time, world.state_hash()
            assert world.position.flags.writeable
            world.velocity[:] = world.velocity
            assert (world.time, world.state_hash()) == before

    together(lambda: world.run(seconds=1), look)
    assert world.frames == 60


@pytest.mark.parametrize("noted", [True, False])  # without events and contacts, frames between two changes are plain
def test_threads_may_add_and_remove_while_another_steps(noted: bool) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (40, 40)), events=noted, contacts=noted)

    def come_and_go(column: int) -> None:
        group = world.add(position=[(4.0 * column + 2, y) for y in (2, 4, 6)], velocity=(0, 1))
        link = world.links.append(pv.Stick(group, 0, 1))
        assert len(group) == len(group.position) == 3
        group.velocity = (0, 0)
        world.links.remove(link)
        world.remove(group)

    together(lambda: world.run(seconds=0.5), *(partial(come_and_go, column) for column in range(3)))
    assert (world.frames, len(world), len(world.links)) == (30, 0, 0)
    with world.held():
        world.step(1 / 60)


def test_a_frame_is_not_to_be_changed_from_within() -> None:
    world = small(3)
    said: list[str] = []

    def meddle(_: object) -> None:
        for change in (lambda: world.step(0.1), lambda: world.add(position=(1, 1)), lambda: world.remove(0), world.save):
            with pytest.raises(pv.InputError, match="in the middle of a frame") as refused:
                change()
            said.append(str(refused.value))

    world.observer = meddle
    world.step(1 / 60)
    assert {text.split()[0] for text in said} == {"step", "add", "remove", "save"}
    assert (world.frames, len(world)) == (1, 16)


# A fork while two other threads step a world and wait for it: in the child both are gone, and the world is whole.
FORK = """
import os, threading
import numpy as np
import pyverlet as pv

world = pv.World(boundary=pv.Box((0, 0), (20, 20)))
world.add(position=np.random.default_rng(0).uniform(1, 19, (200, 2)), radius=0.3)
world.run(seconds=0.2)
threads = [threading.Thread(target=world.run, kwargs={"seconds": 3}, daemon=True) for _ in range(2)]
for thread in threads:
    thread.start()
for _ in range(3):
    child = os.fork()
    if child == 0:
        frames, time = world.frames, world.time
        world.run(seconds=0.1)
        good = world.frames == frames + 6 and abs(world.time - time - 0.1) < 1e-6 and np.isfinite(world.position).all()
        os._exit(0 if good else 3)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 0, os.waitstatus_to_exitcode(status)
for thread in threads:
    thread.join()
assert world.frames == 12 + 360
"""

# Ctrl-C, again and again: the world stands between two frames, and goes on with the bits of one that was left alone.
CTRL_C = """
import os, signal, threading, time
import numpy as np
import pyverlet as pv

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs begin without it

def built():
    world = pv.World(boundary=pv.Box((0, 0), (12, 12)), collisions=pv.Collisions(friction=0.3), events=True, ledger=True)
    world.add(position=np.random.default_rng(0).uniform(1, 11, (60, 2)), radius=0.3)
    world.actors.append(pv.Emitter(pv.Box((1, 8), (11, 11)), rate=60, radius=0.1, most=50))
    return world

world, alone = built(), built()
caught = 0
for pause in np.linspace(0.01, 0.03, 12):
    timer = threading.Timer(pause, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    try:
        world.run(seconds=1000)
    except KeyboardInterrupt:
        caught += 1
    timer.join()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
assert caught == 12
assert abs(world.time - world.frames / 60) < 1e-6
for _ in range(world.frames):
    alone.step(1 / 60)
assert world.state_hash() == alone.state_hash()
assert world.ledger == alone.ledger
world.run(seconds=0.2), alone.run(seconds=0.2)
assert world.state_hash() == alone.state_hash()
"""


def test_each_thread_may_step_its_first_world() -> None:
    run = python("-c", FIRST_WORLDS, PYVERLET_THREADS="2")
    assert run.returncode == 0, run.stderr


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks here")
@pytest.mark.parametrize("program", [FORK, CTRL_C], ids=["fork", "ctrl-c"])
def test_a_world_is_whole(program: str) -> None:
    run = python("-W", "ignore", "-c", program)
    assert run.returncode == 0, run.stderr


# ---- What goes wrong with machines: killed in the middle, full disks, half files, many at once. Nothing saved is lost ----


posix = pytest.mark.skipif(os.name == "nt", reason="signals and limits of POSIX")


@pytest.mark.parametrize("asked", ["1", "3"])
def test_the_environment_says_how_many_threads(asked: str) -> None:
    code = """
import numpy as np, pyverlet as pv
world = pv.World()
world.add(position=np.stack(np.divmod(np.arange(20000), 200), axis=-1) * 1.1)
world.step(1 / 60)
print(world.threads)
"""
    assert python("-c", code, check=True, PYVERLET_THREADS=asked).stdout.split() == [asked]


def test_no_clock_that_can_be_set_times_the_page() -> None:
    viewers = Path(pv.__file__).parent / "viewers"
    assert not [path for path in viewers.glob("*.py") if re.search(r"\btime\.time\(|datetime\.now", path.read_text())]


@posix
@pytest.mark.parametrize("name", ["SIGTERM", pytest.param("SIGHUP", marks=pytest.mark.slow)])
def test_a_closed_terminal_ends_a_run(name: str) -> None:
    number = getattr(signal, name)
    with Program("-m", "pyverlet", "run", "cage", "--particles", "100", "--seconds", "100000") as program:
        program.line(error=True)  # it is running
        program.end(number)
    assert program.process.returncode in (-number, 128 + number)


@posix
@pytest.mark.slow
def test_killed_while_recording_what_was_recorded_plays(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    command = ("-m", "pyverlet", "record", "cage", "a.mp4", "--particles", "100", "--seconds", "10000", "--size", "160x120")
    with Program(*command, cwd=tmp_path):
        until = time.monotonic() + 60
        files: list[Path] = []
        while time.monotonic() < until and sum(path.stat().st_size for path in files) < 60_000:
            time.sleep(0.05)
            files = [path for path in tmp_path.iterdir() if path.is_file()]
    (film,) = files
    with av.open(str(film)) as movie:
        assert sum(1 for _ in movie.decode(video=0)) > 10


@posix
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
    done = python("-c", code, cwd=tmp_path)
    assert done.stdout.strip() == "True", done.stderr
    assert (tmp_path / "a.pvsnap").read_bytes() == before
