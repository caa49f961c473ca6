"""Events, against bounces in closed form."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv


def test_a_ball_is_heard_at_each_of_its_bounces() -> None:
    """After n bounces from a height H it has e^n of the speed sqrt(2 g H); in a frame of 0.25 s there are several."""
    e, height = 0.9, 0.05
    world = pv.World(boundary=pv.Box((-1, 0), (1, 9), restitution=e), collisions=pv.Collisions(), events=True, dtype=np.float64)
    world.add(position=(0, 0.1 + height), radius=0.1)
    speeds: list[float] = []
    counts = []
    for _ in range(3):
        world.step(0.25)
        counts.append(len(world.events.begin))
        speeds += [float(speed) for speed in world.events.begin["speed"]]
    assert max(counts) > 1
    # A contact of a frame is told with its largest speed, so many times as it has bounced.
    assert speeds[0] == pytest.approx(np.sqrt(2 * 9.81 * height), rel=1e-9)
    # T = 2 v / g between bounces: t_n = t_0 + 2 v_0 / g (e + ... + e^n), t_0 = v_0 / g.
    fall = np.sqrt(2 * height / 9.81)
    times = fall + 2 * fall * np.concatenate(([0], np.cumsum(e ** np.arange(1, 40))))
    assert len(speeds) == (times <= 0.75).sum()


def test_new_lists_lose_and_double_nothing() -> None:
    """Two discs that stay together while a fast one has lists made anew in each frame: one beginning, no end."""
    world = pv.World(boundary=pv.Box((-9, 0), (9, 9)), collisions=pv.Collisions(), events=True, gravity=(0, -10))
    world.add(position=[(0, 0.5), (0, 1.5)], radius=0.5)
    fast = world.add(position=(-8, 8), velocity=(60, 0), radius=0.1)
    begun, ended = [], []
    for _ in range(60):
        fast.velocity[:, 1] = 0
        fast.position[:, 1] = 8
        fast.velocity[:, 0] = np.where(np.abs(fast.position[:, 0]) > 8, -60 * np.sign(fast.position[:, 0]), fast.velocity[:, 0])
        world.step(1 / 60)
        begun += [(int(a), int(b)) for a, b in world.events.begin[["a", "b"]].tolist() if a < 2]
        ended += [(int(a), int(b)) for a, b in world.events.end[["a", "b"]].tolist() if a < 2]
    assert world.rebuilds > 30
    assert sorted(begun) == [(0, -1), (0, 1)]
    assert ended == []
