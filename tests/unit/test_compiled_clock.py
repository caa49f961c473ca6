"""The clock of compiled code: that of Python, without Python."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from time import perf_counter

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.compile import clock
from pyverlet.world.profile import Profile


def test_it_is_the_clock_of_python() -> None:
    how = clock.address(), clock.tick()
    clock.seconds(*how)
    times = [perf_counter(), clock.seconds(*how), perf_counter(), clock.seconds(*how), perf_counter()]
    assert times == sorted(times)


def test_a_note_adds_what_has_gone_by() -> None:
    spent = np.zeros(3)
    before = spent[0] = perf_counter()
    for _ in range(2):
        time.sleep(0.01)
        clock.note(spent, 2, clock.address(), clock.tick())
    # Notes leave no gap, but for the rounding of some thousand or million seconds.
    assert spent[0] - before == pytest.approx(spent[2], abs=4 * np.spacing(before))
    assert 0.02 <= spent[2] <= perf_counter() - before
    clock.note(spent, 1, 0, clock.tick())
    assert spent[1] == 0


def test_several_python_threads_may_ask_at_once() -> None:
    def ask(_: int) -> bool:
        times = [clock.seconds(clock.address(), clock.tick()) for _ in range(2000)]
        return times == sorted(times)

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(ask, range(4)))


def test_a_frame_that_was_broken_off_is_not_counted() -> None:
    profile = Profile()
    profile.begin()
    profile.mark("a")
    profile.end()
    profile.begin()
    time.sleep(0.01)
    profile.mark("lost")
    profile.begin()
    profile.mark("b")
    profile.end()
    assert set(profile.stages) == {"b"}
    assert set(profile.total_ms) == {"a", "b"}
    assert profile.frames == 2
    assert profile.total_ms["b"] == profile.stages["b"] < 10


def test_compiled_code_notes_its_own_stages_whoever_was_first() -> None:
    # Circles that grow have Python call the stages of the first frames, and name them.
    world = pv.World(boundary=pv.Circle(radius=40))
    world.add(position=[(0, 0), (0.5, 0), (3, 0), (4, 0)], radius=0.5, allow_overlap=True)
    world.run(seconds=3)
    assert (world._state.grown == 1).all()
    world.step(1 / 60)
    assert set(world.profile.stages) == {
        "gather", "integrate", "broad phase", "contacts", "bounds", "velocities", "finish", "scatter",
    }  # fmt: skip


def test_a_frame_is_timed_by_stage() -> None:
    world = pv.World(boundary=pv.Circle(radius=40))
    side = np.arange(30) - 14.5
    world.add(position=np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2), radius=0.4)
    world.run(seconds=1)
    begin = perf_counter()
    world.step(1 / 60)
    elapsed = 1e3 * (perf_counter() - begin)
    assert set(world.profile.stages) == {
        "gather", "integrate", "broad phase", "contacts", "bounds", "velocities", "finish", "scatter",
    }  # fmt: skip
    assert sum(world.profile.stages.values()) <= world.profile.frame_ms <= elapsed
    # Nothing but a few marks lies between the stages.
    assert sum(world.profile.stages.values()) > 0.8 * world.profile.frame_ms
