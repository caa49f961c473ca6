"""The fixed-step clock and the frame budget."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv


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
