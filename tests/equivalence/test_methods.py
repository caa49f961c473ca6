"""The fast way against the readable one: the same contacts on any scene, the same statistics of a settled pile."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pyverlet as pv
from pyverlet.ground.constants import SKIN_MOST, WORTH_THINNING
from pyverlet.laws.contacts.broadphase import start
from pyverlet.laws.contacts.methods import BruteForce, Fast
from pyverlet.laws.contacts.solver import find_contacts
from pyverlet.state.slots import Slots
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


def listed(state: State, skin: float) -> Any:
    """A fast broad phase that has just listed the pairs of a state, and the slots it has put the state into."""
    slots = Slots(state.dtype)
    slots.gather(state)
    phase: Any = start(Fast(skin=skin), state.dtype)
    phase.update(slots)
    return phase, slots


@pytest.mark.parametrize("most", [400, pytest.param(2000, marks=pytest.mark.slow)])
@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    share=st.floats(0, 1),
    room=st.floats(0.5, 50),
    spread=st.sampled_from([1.0, 4.0, 50.0, 200.0]),
    skin=st.sampled_from([0.0, 0.1, 0.6, 2.0]),
)
def test_the_list_holds_each_pair_within_the_skin_once(
    most: int, seed: int, share: float, room: float, spread: float, skin: float
) -> None:
    state = random_state(seed, 2 + round(share * (most - 2)), room, spread, np.dtype(np.float64))
    # In a straight line through all sizes, so that large ones reach over many small cells and strips.
    state.position[::3, 0] *= 0.05
    phase, slots = listed(state, skin)
    reach = state.radius[:, None] + state.radius[None] + skin * 2 * state.radius.mean()
    expected = np.hypot(*(state.position[:, None] - state.position[None]).transpose(2, 0, 1)) < reach
    pinned = np.isinf(state.mass)
    expected &= ~(pinned[:, None] & pinned[None])
    found = np.sort(slots.particle[phase.list.pairs()].astype(np.int64), axis=1)
    found = found[np.lexsort(found.T[::-1])]
    assert found.tolist() == np.argwhere(np.triu(expected, 1)).tolist()


def test_a_list_that_lasts_is_thinned() -> None:
    # A heap that comes to rest never strays: what is listed for nothing at most doubles in cost before the list is made anew.
    state = random_state(3, 3000, 20.0, 1.0, np.dtype(np.float32))
    slots = Slots(state.dtype)
    slots.gather(state)
    phase: Any = start(Fast(), state.dtype)
    phase.skin_diameters = SKIN_MOST
    counts: list[int] = []
    for _ in range(2000):
        phase.follow(slots)
        phase.update(slots)
        phase.aged(7)
        if phase.rebuilds > len(counts):
            counts.append(int(phase.list.count.sum()))
    assert counts[-1] < 0.3 * counts[0]
    # From 2 to 0.02 diameters it is 21 steps of 1.25; a step from the last would spare less than what it is worth.
    assert 3 < len(counts) <= 22
    assert phase._excess < WORTH_THINNING


@pytest.mark.parametrize("spread", [1.0, 4.0, 50.0])
def test_strips_of_one_parity_share_no_particle(spread: float) -> None:
    # What lets threads solve them at the same time, and any number of threads give the same bits.
    phase, slots = listed(random_state(3, 6000, 40.0, spread, np.dtype(np.float32)), 0.3)
    pairs = phase.list
    strips = [slice(a, a + n) for a, n in zip(pairs.first, pairs.count, strict=True)]
    assert len(strips) >= 6
    for parity in range(2):
        of = np.full(len(slots), -1)
        for number, strip in enumerate(strips):
            if number % 2 == parity:
                members = np.unique(np.concatenate((pairs.pair_i[strip], pairs.pair_j[strip])))
                assert (of[members] == -1).all()
                of[members] = number


@pytest.mark.parametrize("spread", [1.0, 4.0, 50.0])
def test_pairs_next_to_each_other_share_no_particle(spread: float) -> None:
    # Only speed depends on it. Where colours meet it may happen; circles with more neighbours than colours have theirs spread.
    phase, _ = listed(random_state(3, 6000, 40.0, spread, np.dtype(np.float32)), 0.1)
    shared = total = 0
    for a, n in zip(phase.list.first, phase.list.count, strict=True):
        i, j = phase.list.pair_i[a : a + n].astype(int), phase.list.pair_j[a : a + n].astype(int)
        shared += int(np.count_nonzero((i[1:] == i[:-1]) | (i[1:] == j[:-1]) | (j[1:] == i[:-1]) | (j[1:] == j[:-1])))
        total += int(n)
    assert shared < 0.02 * total


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


@pytest.mark.parametrize("restitution", [0.0, pytest.param(0.4, marks=pytest.mark.slow)])
def test_fast_and_brute_settle_alike(restitution: float) -> None:
    # The order of the pairs differs, so that trajectories part; what they come to must not.
    fast, brute = settled(Fast(), restitution), settled(BruteForce(), restitution)
    assert fast[0] == pytest.approx(brute[0], rel=0.02)
    assert fast[1] == pytest.approx(brute[1], rel=0.5, abs=2e-4)
    assert max(fast[2], brute[2]) < 0.05 * 360 * 9.81 * 0.45


@pytest.mark.parametrize("spread", [1.0, 4.0, 50.0])
def test_no_contact_is_missed_while_the_list_is_kept(spread: float) -> None:
    # After every frame of a violent scene, each overlapping pair must be on the list the solver works with.
    world = pv.World(boundary=pv.Circle(radius=12), dtype=np.float64)
    rng = np.random.default_rng(4)
    axis = np.arange(-8, 8, 1.1)
    x, y = np.meshgrid(axis, axis)
    position = np.column_stack((x.ravel(), y.ravel()))
    radius = 0.5 * spread ** rng.uniform(-1, 0, len(position))
    world.add(position=position, velocity=rng.normal(0, 30, position.shape), radius=radius)
    for _ in range(60):
        world.step(1 / 60)
        assert world._contacts is not None
        listed = world._slots.particle[world._contacts.wide.pairs()]
        known = set(map(tuple, np.sort(listed, axis=1).tolist()))
        assert set(map(tuple, find_contacts(world._state, BruteForce()).tolist())) <= known


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
