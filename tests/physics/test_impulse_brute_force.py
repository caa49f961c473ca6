"""All pairs there are, looked at one by one, against the lists from cells: the same contacts and the same physics."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

ROOMS: list[Any] = [pv.Box((0, 0), (12, 40)), pv.Circle(center=(6, 6), radius=9), pv.Open(), pv.Periodic((0, 0), (12, 14))]
METHODS: list[Any] = [pv.Fast(), pv.BruteForce()]


def world_of(method: Any, room: Any, dtype: Any = np.float64, **law: Any) -> pv.World:
    """40 circles of several sizes, apart from each other."""
    world = pv.World(boundary=room, dtype=dtype, collisions=pv.Collisions(method=method, **law))
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(1.5 + 1.3 * np.arange(8), 2 + 1.3 * np.arange(5))
    world.add(
        position=np.column_stack((x.ravel(), y.ravel())), velocity=rng.normal(0, 1, (40, 2)), radius=rng.uniform(0.3, 0.6, 40)
    )
    return world


def pairs_of(world: pv.World) -> list[tuple[int, int]]:
    """The listed pairs of user's indices, each once."""
    first, count, i, j = world._frames.listed()
    lane = np.concatenate([np.arange(f, f + n) for f, n in zip(first, count, strict=True)])
    particle = world._slots.particle
    both = np.sort(np.column_stack((particle[i[lane]], particle[j[lane]])), axis=1)
    return [(int(a), int(b)) for a, b in np.unique(both, axis=0)]


@pytest.mark.parametrize("room", ROOMS[:3])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_pair_is_listed_once_and_for_all(room: Any, dtype: Any) -> None:
    world = world_of(pv.BruteForce(), room, dtype)
    for _ in range(60):
        world.step(1 / 60)
    assert pairs_of(world) == list(combinations(range(40), 2))
    assert world._frames.rebuilds == 1


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("law", [{}, {"restitution": 0.5, "friction": 0.3}])
def test_it_is_the_physics_of_cells(room: Any, law: dict[str, float]) -> None:
    # The order of pairs is another, so what contacts give differs by what one sweep leaves: per substep less than the velocity
    # that gravity adds, g h, at each of a few contacts. Over 20 frames, in which a fall makes 0.5 m, that stays below 1 cm. With
    # restitution small differences grow by each bounce; until two circles meet a third at once paths are the same to rounding.
    fast, brute = (world_of(method, room, **law) for method in METHODS)
    for frame in range(20):
        for world in (fast, brute):
            world.step(1 / 60)
        if frame < 3:
            assert np.abs(fast.position - brute.position).max() < 1e-12
    assert np.abs(fast.position - brute.position).max() < 0.01


def test_filters_and_pinned_circles_make_no_pairs() -> None:
    world = world_of(pv.BruteForce(), ROOMS[0])
    world.mass[:2] = np.inf
    world.category[2], world.mask[2] = 2, 2
    world.step(1 / 60)
    expected = {pair for pair in combinations(range(40), 2) if 2 not in pair} - {(0, 1)}
    assert set(pairs_of(world)) == expected
