"""The fast way against the readable one: the same contacts on any scene, the same statistics of a settled pile."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pyverlet as pv
from pyverlet.laws.collisions import BruteForce, Fast, find_contacts
from pyverlet.state.state import State


def random_state(seed: int, n: int, room: float, spread: float, dtype: np.dtype[Any]) -> State:
    rng = np.random.default_rng(seed)
    state = State(dtype)
    state.append(
        {
            "position": rng.uniform(-room, room, (n, 2)),
            "velocity": np.zeros((n, 2)),
            "acceleration": np.zeros((n, 2)),
            "spin": np.zeros(n),
            "radius": 0.5 * spread ** rng.uniform(-1, 0, n),
            "mass": np.where(rng.random(n) < 0.1, np.inf, 1.0),
        }
    )
    return state


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(1, 500),
    room=st.floats(0.01, 200),
    spread=st.sampled_from([1.0, 4.0, 50.0, 200.0]),
    dtype=st.sampled_from([np.dtype(np.float32), np.dtype(np.float64)]),
)
def test_contacts_against_plain_numpy(seed: int, n: int, room: float, spread: float, dtype: np.dtype[Any]) -> None:
    state = random_state(seed, n, room, spread, dtype)
    x, r = state.position.astype(float), state.radius.astype(float)
    touching = ((x[:, None] - x[None]) ** 2).sum(axis=2) < (r[:, None] + r[None]) ** 2
    pinned = np.isinf(state.mass)
    touching &= ~(pinned[:, None] & pinned[None])
    assert find_contacts(state).tolist() == np.argwhere(np.triu(touching, 1)).tolist()


def settled(method: Fast | BruteForce, restitution: float) -> tuple[float, float, float]:
    rng = np.random.default_rng(2)
    world = pv.World(
        boundary=pv.Box((0, 0), (20, 60)), collisions=pv.Collisions(restitution=restitution, method=method), dtype=np.float64
    )
    x, y = np.meshgrid(np.arange(1, 19.0), np.arange(1, 21.0))
    balls = world.add(position=np.column_stack((x.ravel(), y.ravel())) + rng.uniform(-0.1, 0.1, (360, 2)), radius=0.45)
    world.run(seconds=8)
    return float(balls.position[:, 1].mean()), world.overlap().mean, world.energy().kinetic


@pytest.mark.parametrize("restitution", [0.0, pytest.param(0.4, marks=pytest.mark.slow)])
def test_fast_and_brute_settle_alike(restitution: float) -> None:
    # The order of the pairs differs, so that trajectories part; what they come to must not.
    fast, brute = settled(Fast(), restitution), settled(BruteForce(), restitution)
    assert fast[0] == pytest.approx(brute[0], rel=0.02)
    assert fast[1] == pytest.approx(brute[1], rel=0.5, abs=2e-4)
    assert max(fast[2], brute[2]) < 0.05 * 360 * 9.81 * 0.45


def test_what_falls_as_a_whole_needs_no_new_list() -> None:
    # 5 s of free fall, 123 m, all at 3 m/s to the right, and far from each other in two heaps.
    world = pv.World(dtype=np.float64)
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    lattice = np.column_stack((x.ravel(), y.ravel()))
    world.add(position=np.concatenate((lattice, lattice + np.array((50.0, 7.0)))), velocity=(3, 0), radius=0.4)
    world.run(seconds=5)
    assert world.rebuilds <= 2  # one to look for circles on top of each other, one to begin with


def test_one_circle_that_comes_near_asks_for_a_new_list() -> None:
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=0.4)
    bullet = world.add(position=(-6, 10.2), velocity=(10, 0), radius=0.4)
    world.run(seconds=0.4)
    before = world.rebuilds
    world.run(seconds=0.4)
    assert world.rebuilds > before
    assert bullet.velocity[0, 0] < 9  # it has hit
