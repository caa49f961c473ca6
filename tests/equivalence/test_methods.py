"""The fast way against the readable one: the same contacts on any scene, the same statistics of a settled pile."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pyverlet as pv
from pyverlet.broadphase import BruteForce, Fast
from pyverlet.collisions import find_contacts
from pyverlet.state import State


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
    spread=st.sampled_from([1.0, 4.0, 50.0]),
    dtype=st.sampled_from([np.dtype(np.float32), np.dtype(np.float64)]),
    skin=st.sampled_from([0.0, 0.2, 0.6]),
)
def test_fast_and_brute_find_the_same_contacts(
    seed: int,
    n: int,
    room: float,
    spread: float,
    dtype: np.dtype[Any],
    skin: float,
) -> None:
    state = random_state(seed, n, room, spread, dtype)
    assert find_contacts(state, Fast(skin=skin)).tolist() == find_contacts(state, BruteForce()).tolist()


def test_contacts_against_plain_numpy() -> None:
    # A third way, without any kernel, so that both cannot be wrong together.
    state = random_state(1, 300, 8.0, 4.0, np.dtype(np.float64))
    distance = np.hypot(*(state.position[:, None] - state.position[None]).transpose(2, 0, 1))
    touching = distance < state.radius[:, None] + state.radius[None]
    pinned = np.isinf(state.mass)
    touching &= ~(pinned[:, None] & pinned[None])
    expected = np.argwhere(np.triu(touching, 1))
    assert len(expected) > 50
    assert find_contacts(state, Fast()).tolist() == expected.tolist()


def settled(method: Fast | BruteForce, restitution: float) -> tuple[float, float, float]:
    rng = np.random.default_rng(2)
    world = pv.World(
        boundary=pv.Box((0, 0), (20, 60)), collisions=pv.Collisions(restitution=restitution, method=method), dtype=np.float64
    )
    x, y = np.meshgrid(np.arange(1, 19.0), np.arange(1, 21.0))
    balls = world.add(position=np.column_stack((x.ravel(), y.ravel())) + rng.uniform(-0.1, 0.1, (360, 2)), radius=0.45)
    world.run(seconds=8)
    return float(balls.position[:, 1].mean()), world.overlap().mean, world.energy().kinetic


@pytest.mark.parametrize("restitution", [0.0, 0.4])
def test_fast_and_brute_settle_alike(restitution: float) -> None:
    # The order of the pairs differs, so that trajectories part; what they come to must not.
    fast, brute = settled(Fast(), restitution), settled(BruteForce(), restitution)
    assert fast[0] == pytest.approx(brute[0], rel=0.02)
    assert fast[1] == pytest.approx(brute[1], rel=0.5, abs=2e-4)
    assert max(fast[2], brute[2]) < 0.05 * 360 * 9.81 * 0.45


def test_no_contact_is_missed_while_the_list_is_kept() -> None:
    # After every frame of a violent scene, each overlapping pair must be on the list the solver works with.
    world = pv.World(boundary=pv.Circle(radius=12), dtype=np.float64)
    rng = np.random.default_rng(4)
    axis = np.arange(-8, 8, 1.1)
    x, y = np.meshgrid(axis, axis)
    position = np.column_stack((x.ravel(), y.ravel()))
    world.add(position=position, velocity=rng.normal(0, 30, position.shape), radius=0.5)
    for _ in range(60):
        world.step(1 / 60)
        assert world._contacts is not None
        listed = world._slots.particle[world._contacts.broad_phase.list.pairs()]
        known = set(map(tuple, np.sort(listed, axis=1).tolist()))
        assert set(map(tuple, find_contacts(world._state, BruteForce()).tolist())) <= known
