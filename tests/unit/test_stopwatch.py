"""Time by stage, in Python and in what is replayed without it."""

from __future__ import annotations

import time
from time import perf_counter
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.compile import entry, stopwatch
from pyverlet.compile.stopwatch import CLOCK
from pyverlet.world.profile import Profile


@pytest.mark.parametrize("note", [stopwatch.note, stopwatch._note_in_python])
def test_a_note_adds_what_has_gone_by(note: Any) -> None:
    spent = np.zeros(3)
    before = spent[0] = perf_counter()
    for _ in range(2):
        time.sleep(0.01)
        note(spent, 2, CLOCK)
    assert spent[0] - before == pytest.approx(spent[2], abs=1e-9)  # notes leave no gap, but for rounding of a large number
    assert 0.02 <= spent[2] <= perf_counter() - before
    assert spent[1] == 0


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


def test_what_is_replayed_is_timed_by_stage() -> None:
    world = pv.World(boundary=pv.Circle(radius=40))
    side = np.arange(30) - 14.5
    world.add(position=np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2), radius=0.4)
    world.run(seconds=10)
    begin = perf_counter()
    world.step(1 / 60)
    elapsed = 1e3 * (perf_counter() - begin)
    assert set(world.profile.stages) == {
        "gather", "integrate", "broad phase", "contacts", "bounds", "velocities", "finish", "scatter",
    }  # fmt: skip
    assert sum(world.profile.stages.values()) <= world.profile.frame_ms <= elapsed
    # Nothing but a few marks lies between the stages.
    assert sum(world.profile.stages.values()) > 0.8 * world.profile.frame_ms


def released(count: int) -> list[bool]:
    """Whether other Python threads may run during each of the calls that are replayed."""
    world = pv.World(boundary=pv.Circle(radius=2.0 * count**0.5), gravity=(0, 0))
    side = int(count**0.5)
    world.add(position=1.1 * np.stack(np.divmod(np.arange(side * side), side), axis=-1) - 0.55 * side, radius=0.5)
    for _ in range(3):
        world.step(1 / 60)
    found = []
    for trace in world._repeats._traces:
        at = 0
        for _ in range(trace._number if trace._key is not None else 0):
            found.append(bool(trace._words[at + entry.RELEASE // 8]))
            at += entry.CALL // 8 + int(trace._words[at + entry.TAKEN // 8])
    assert found
    return found


def test_others_may_run_while_a_large_world_is_replayed() -> None:
    assert sum(released(8100)) > 10
    assert not any(released(100))
