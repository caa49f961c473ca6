"""The fast way against the readable one: the same contacts on any scene, the same statistics of a settled pile."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.worlds import points, refused

import pyverlet as pv
from pyverlet.laws.collisions import find_contacts
from pyverlet.state.neighbours import VerletList, list_pairs, near
from pyverlet.state.periodicity import NONE, Periodicity


@settings(max_examples=90, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1), n=st.integers(1, 500), room=st.floats(0.01, 200),
    spread=st.sampled_from([1.0, 4.0, 50.0, 200.0]), axes=st.sampled_from([None, "xy", "x", "y"]),
    dtype=st.sampled_from([np.dtype(np.float32), np.dtype(np.float64)]),
)  # fmt: skip
def test_contacts_against_plain_numpy(
    seed: int, n: int, room: float, spread: float, axes: str | None, dtype: np.dtype[Any]
) -> None:
    # Circles of all sizes on top of each other, of nearest images in a periodic room: as large as they may be in it, or tiny.
    rng, half = np.random.default_rng(seed), max(room, 1.0)
    boundary = pv.Periodic((-half, 3 - half), (half, 3 + half), axes=axes) if axes else pv.Open()
    world = pv.World(boundary=boundary, dtype=dtype)
    mass, radius = np.where(rng.random(n) < 0.1, np.inf, 1.0), 0.5 * spread ** rng.uniform(-1, 0, n)
    world.add(position=rng.uniform((-room, 3 - room), (room, 3 + room), (n, 2)), radius=radius, mass=mass, on_overlap="push")
    x, r, pinned = world.position.astype(float), world.radius.astype(float), np.isinf(mass)
    way, period = x[:, None] - x, 2 * half * np.array(["x" in (axes or ""), "y" in (axes or "")])
    way -= period * np.rint(way / np.where(period > 0, period, np.inf))
    touching = (way**2).sum(axis=2) < (r[:, None] + r) ** 2
    touching &= ~(pinned[:, None] & pinned)
    assert find_contacts(world._state).tolist() == np.argwhere(np.triu(touching, 1)).tolist()


def test_what_falls_as_a_whole_needs_no_new_list() -> None:
    # 5 s of free fall, 123 m, all at 3 m/s to the right, and far from each other in two heaps.
    world = pv.World(dtype=np.float64)
    lattice = points(np.arange(20.0), np.arange(20.0))
    world.add(position=np.concatenate((lattice, lattice + np.array((50.0, 7.0)))), velocity=(3, 0), radius=0.4)
    world.run(seconds=5)
    assert world.rebuilds <= 2  # one to look for circles on top of each other, one to begin with


def test_one_circle_that_comes_near_asks_for_a_new_list() -> None:
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    world.add(position=points(np.arange(20.0), np.arange(20.0)), radius=0.4)
    bullet = world.add(position=(-6, 10.2), velocity=(10, 0), radius=0.4)
    world.run(seconds=0.4)
    before = world.rebuilds
    world.run(seconds=0.4)
    assert world.rebuilds > before
    assert bullet.velocity[0, 0] < 9  # it has hit


# ---- Pairs within a range: the grid of cells against brute force, and Verlet lists against lists of now ----


ROOMS = {
    "open": NONE,
    "both": Periodicity(-1.0, 2.0, 10.0, 7.0),
    "x": Periodicity(-1.0, 0.0, 10.0, 0.0),
    "y": Periodicity(0.0, 2.0, 0.0, 7.0),
    "narrow": Periodicity(-1.0, 2.0, 1.7, 2.5),  # of one and of two cells
}


def brute_force(position: Any, reach: float, periodic: Periodicity) -> set[tuple[int, int]]:
    way = periodic.nearest((position[None, :] - position[:, None]).astype(float))
    i, j = np.nonzero((way**2).sum(axis=2) < reach * reach)
    return {(a, b) for a, b in zip(i.tolist(), j.tolist(), strict=True) if a < b}


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("count", [0, 1, 2, 300])
def test_the_cells_miss_no_pair(room: str, dtype: Any, count: int) -> None:
    rng = np.random.default_rng(count)
    # Beyond the room by some periods, as positions may be within a frame; some far away, so that cells are many.
    position = rng.uniform(-15, 15, (count, 2)).astype(dtype)
    position[: count // 3] *= dtype(0.1)
    for reach in (0.05, 0.8):
        i, j = list_pairs(position, reach, ROOMS[room])
        assert list(zip(i, j, strict=True)) == sorted(brute_force(position, reach, ROOMS[room]))
        assert i.dtype == j.dtype == np.int32


def test_more_pairs_than_eight_a_particle_and_far_outliers() -> None:
    position = np.random.default_rng(0).normal(0, 1e-3, (200, 2))
    position[0] = 1e6, -1e6
    position[1] = np.nan
    i, j = list_pairs(position, 1.0)
    assert len(i) == 198 * 197 // 2
    assert {0, 1}.isdisjoint({*i.tolist(), *j.tolist()})


@pytest.mark.parametrize("room", ["open", "both"])
def test_verlet_lists_give_the_pairs_of_now(room: str) -> None:
    rng, periodic = np.random.default_rng(1), ROOMS[room]
    position, order = rng.uniform(0, 8, (400, 2)).astype(np.float32), np.zeros(1)
    kept = VerletList(0.7)
    for _ in range(60):
        position += rng.normal(0, 0.01, position.shape).astype(np.float32)
        if periodic:
            periodic.wrap(position)  # a jump of a whole period is no way
        ours, now = kept.within(position, order, periodic, 0.7), near(position, 0.7, periodic)
        for a, b in zip((*ours,), (*now,), strict=True):
            assert np.asarray(a).tobytes() == np.asarray(b).tobytes()
    # A step is 0.045 for the one of 400 that moves most, and half the skin 0.07: not in every step, but often.
    assert 5 < kept.made < 40
    kept.within(position, np.zeros(1), periodic, 0.7)
    made = kept.made
    kept.within(position + np.float32(0.05), np.zeros(1), periodic, 0.7)
    assert kept.made == made + 1  # sorted anew


def test_a_world_tells_its_neighbours() -> None:
    world = pv.World(boundary=pv.Periodic(lower=(0, 0), upper=(10, 10)), collisions=None)
    world.add(position=[(0.5, 5), (9.5, 5), (3, 3), (3, 3), (3, 3.6)], radius=0.1)
    i, j, distance, way = world.neighbours(1.5)
    assert i.tolist() == [0, 2, 3]
    assert j.tolist() == [1, 4, 4]  # 2 and 3 are at the same place
    assert distance == pytest.approx([1.0, 0.6, 0.6], rel=1e-6)
    assert way[0] == pytest.approx([-1, 0])  # through the periodic boundary
    refused("range is 6; allowed in this periodic room is at most 5", world.neighbours, 6.0)
    refused("range is 0", world.neighbours, 0.0)
    assert len(pv.World().neighbours(1.0).i) == 0
