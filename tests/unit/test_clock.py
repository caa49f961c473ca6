"""The fixed-step clock and the frame budget."""

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import core
from pyverlet.common import progress
from pyverlet.common.progress import Progress


@pytest.mark.parametrize("drawn", [10, 24, 30, 60, 75, 144, 240])
def test_as_many_frames_as_time_has_passed(drawn: int) -> None:
    clock = pv.Clock(dt=1 / 60, max_catch_up=10)
    frames = sum(clock.advance(1 / drawn) for _ in range(10 * drawn))
    assert abs(frames - 600) <= 1
    assert clock.dropped == 0


def test_alpha_is_the_leftover_fraction() -> None:
    clock = pv.Clock(dt=0.1)
    assert clock.advance(0.125) == 1
    assert clock.alpha == pytest.approx(0.25)
    assert clock.advance(0.05) == 0
    assert clock.alpha == pytest.approx(0.75)
    # Interpolated drawing then moves evenly: frame number + alpha is the wall time.
    rng = np.random.default_rng(0)
    clock, frames, wall = pv.Clock(dt=0.1), 0, 0.0
    for elapsed in rng.uniform(0, 0.3, 200):
        frames, wall = frames + clock.advance(elapsed), wall + elapsed
        assert frames + clock.alpha == pytest.approx(wall / 0.1, abs=1e-6)
        assert 0 <= clock.alpha < 1


def test_no_spiral_of_death() -> None:
    # A frame of physics that takes three frames of wall time: the clock asks for at most its cap, counts the rest.
    clock = pv.Clock(dt=1 / 60, max_catch_up=4)
    asked, elapsed = 0, 1 / 60
    for _ in range(100):
        due = clock.advance(elapsed)
        assert due <= 4
        asked, elapsed = asked + due, max(due * 3, 1) / 60
    assert clock.dropped > 100
    assert clock.advance(3600) == 4
    assert clock.advance(1 / 60) <= 2  # the hour is forgotten
    assert sum(clock.advance(1 / 60) for _ in range(60)) >= 59


def test_budget_counts_frames_over_the_limit() -> None:
    budget = pv.FrameBudget(limit_ms=5.0, window=100)
    assert (budget.last_ms, budget.median_ms, budget.p95_ms) == (0, 0, 0)
    for ms in range(1, 101):
        budget.record(ms / 10)
    assert budget.frames == 100
    assert budget.over == 50
    assert budget.last_ms == 10.0
    assert budget.median_ms == pytest.approx(5.05)
    assert budget.p95_ms == pytest.approx(9.6, abs=0.1)


# ---- The line of progress: what it estimates, and from when ----


def test_the_time_left_ignores_what_came_before_the_first_call(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # 100 s of compiling, then a frame every second: with 10 of 60 done, 50 s are left, not 60 s * 109 / 10.
    now = [0.0]
    monkeypatch.setattr(progress, "monotonic", lambda: now[0])
    with Progress("frame") as line:
        now[0] = 99.0
        for done in range(1, 11):
            now[0] += 1.0
            line(done, 60)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "frame: 1 of 60"
    assert lines[-1] == "frame: 6 of 60, 54 s left"


# ---- Energies in vectors against those one after the other ----


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("count", [0, 1, 7, 8, 100, 10_000])
@pytest.mark.parametrize("lag", [0.0, 0.01])
def test_mechanical_energy_is_the_sum_of_all_three(dtype: Any, count: int, lag: float) -> None:
    rng = np.random.default_rng(count)
    position, velocity, acceleration = rng.normal(0, 10, (3, count, 2)).astype(dtype)
    spin, radius, mass = rng.uniform(0.5, 2, (3, count)).astype(dtype)
    mass[rng.random(count) < 0.1] = np.inf
    total = core.unit("engine", dtype).total_energy(position, velocity, acceleration, lag, spin, radius, mass, 1.0, -9.81)
    moved = velocity.astype(float) + lag * acceleration.astype(float)
    arrays = (array.astype(float) for array in (position, moved, spin, radius, mass))
    parts = core.unit("engine", float).energies(*arrays, 1.0, -9.81)
    # 10,000 terms of up to some 1e3 J, which cancel in part, each rounded in float64.
    assert total == pytest.approx(sum(parts), rel=1e-12, abs=1e-9)


# ---- Several worlds as one: stepped, saved and hashed together ----


def ball(height: float) -> pv.World:
    world = pv.World(collisions=None, dtype=np.float64)
    world.add(position=(0, height))
    return world


def test_one_world_is_itself() -> None:
    world = ball(3)
    panels = pv.Panels.of(world)
    assert pv.Panels.of(panels) is panels
    panels.step(0.1)
    assert (len(panels), panels.worlds, panels.time, panels.frames) == (1, [world], 0.1, 1)
    assert panels.state_hash() == world.state_hash()


def test_pace_says_what_a_frame_of_the_screen_does() -> None:
    def every_second(world: pv.World, frame: int, dt: float) -> None:
        if frame % 2 == 0:
            world.step(2 * dt)

    panels = pv.Panels([pv.Panel("fast", ball(3)), pv.Panel("slow", ball(3), every_second)])
    for _ in range(3):
        panels.step(0.1)
    assert [world.frames for world in panels.worlds] == [3, 1]
    assert [world.time for world in panels.worlds] == pytest.approx([0.3, 0.2])
    assert panels.time == pytest.approx(0.3)


def test_restore_brings_back_the_bits_and_the_pace() -> None:
    panels = pv.Panels([pv.Panel("a", ball(3)), pv.Panel("b", ball(4))])
    panels.step(0.1)
    saved, before = panels.save(), panels.state_hash()
    panels.step(0.1)
    after = panels.state_hash()
    panels.restore(saved)
    assert panels.state_hash() == before != after
    assert [panel.frames for panel in panels] == [1, 1]
    panels.step(0.1)
    assert panels.state_hash() == after


def test_the_hash_depends_on_every_world() -> None:
    def hashed(*heights: float) -> str:
        return pv.Panels([pv.Panel("", ball(height)) for height in heights]).state_hash()

    assert len({hashed(1, 2), hashed(2, 1), hashed(1, 3), hashed(1)}) == 4
