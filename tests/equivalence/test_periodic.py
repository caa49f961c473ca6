"""Periodic rooms: the grids find what brute force does, on any number of threads, and a world goes on as it was saved."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.ground.threads import max_threads
from pyverlet.laws.collisions import find_contacts


def _crowd(seed: int) -> pv.World:
    """Circles of all sizes on top of each other, in rooms of all shapes: as large as they may be, or tiny."""
    rng = np.random.default_rng(seed)
    period, lower, count = rng.uniform(4, 40, 2), rng.uniform(-50, 50, 2), int(rng.integers(2, 300))
    largest = period.min() / 4 * rng.uniform(0.05, 1)
    radius = rng.uniform(largest / (1.01, 3, 20)[seed % 3], largest, count)
    radius[1:] *= 0.1 if seed % 5 == 0 else 1.0
    room = pv.Periodic(tuple(lower), tuple(lower + period), axes=("xy", "x", "y")[seed % 7 % 3])
    world = pv.World(boundary=room, dtype=(np.float32, np.float64)[seed % 2])
    world.add(position=rng.uniform(lower, lower + period, (count, 2)), radius=radius, on_overlap="push")
    return world


def test_contacts_are_those_of_nearest_images() -> None:
    for seed in range(30):
        world = _crowd(seed)
        x, r, period = world.position.astype(float), world.radius.astype(float), np.array(world.boundary.seam.period)
        way = x[:, None] - x
        way -= period * np.rint(way / np.where(period > 0, period, np.inf))
        touch = np.argwhere(np.triu(np.hypot(way[..., 0], way[..., 1]) < r[:, None] + r, 1))
        assert np.array_equal(find_contacts(world._state), touch)


def _stream(threads: int, axes: str, spread: float, **laws: Any) -> pv.World:
    """So many circles that there are several strips, of which the last one joins on to the first."""
    rng = np.random.default_rng(3)
    radius = 0.5 * rng.uniform(1 / spread, 1, 2000)
    side = float(np.sqrt((np.pi * radius**2).sum() / 0.6))
    world = pv.World(
        gravity=(1, -2), boundary=pv.Periodic((-side / 3, 5), (2 * side / 3, 5 + side), axes=axes, restitution=0.5),
        collisions=pv.Collisions(**laws), threads=threads, contacts=axes == "xy",
    )  # fmt: skip
    world.add(
        position=rng.uniform((-side / 3 + 0.5, 5.5), (2 * side / 3 - 0.5, 4.5 + side), (2000, 2)),
        velocity=rng.normal(0, 4, (2000, 2)), radius=radius,
    )  # fmt: skip
    return world


@pytest.mark.parametrize(
    ("axes", "spread", "laws"),
    [("xy", 1.0, {"restitution": 0.9}), ("x", 1.0, {"friction": 0.3}), ("y", 1.0, {}), ("xy", 6.0, {"friction": 0.2})],
)
def test_same_bits(axes: str, spread: float, laws: dict[str, Any]) -> None:
    """Of one thread and several; and of a world that is taken back and goes on anew."""
    hashes = []
    for threads in sorted({1, min(2, max_threads())}):
        world = _stream(threads, axes, spread, **laws)
        for _ in range(8):
            world.step(1 / 60)
        saved = world.save()
        for _ in range(4):
            world.step(1 / 60)
        hashes.append(world.state_hash())
        world.restore(saved)
        for _ in range(4):
            world.step(1 / 60)
        hashes.append(world.state_hash())
    assert len(set(hashes)) == 1
    if axes == "xy":
        assert world.pressure() > 0
