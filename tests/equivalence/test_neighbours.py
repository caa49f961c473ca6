"""Pairs within a range: the grid of cells against brute force, and Verlet lists against lists of now."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.state.neighbours import VerletList, list_pairs, near
from pyverlet.state.seam import NONE, Seam

ROOMS = {
    "open": NONE,
    "both": Seam(-1.0, 2.0, 10.0, 7.0),
    "x": Seam(-1.0, 0.0, 10.0, 0.0),
    "y": Seam(0.0, 2.0, 0.0, 7.0),
    "narrow": Seam(-1.0, 2.0, 1.7, 2.5),  # of one and of two cells
}


def brute_force(position: Any, reach: float, seam: Seam) -> set[tuple[int, int]]:
    way = seam.nearest((position[None, :] - position[:, None]).astype(float))
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
    rng, seam = np.random.default_rng(1), ROOMS[room]
    position, order = rng.uniform(0, 8, (400, 2)).astype(np.float32), np.zeros(1)
    kept = VerletList(0.7)
    for _ in range(60):
        position += rng.normal(0, 0.01, position.shape).astype(np.float32)
        if seam:
            seam.wrap(position)  # a jump of a whole period is no way
        ours, now = kept.within(position, order, seam, 0.7), near(position, 0.7, seam)
        for a, b in zip((*ours,), (*now,), strict=True):
            assert np.asarray(a).tobytes() == np.asarray(b).tobytes()
    # A step is 0.045 for the one of 400 that moves most, and half the skin 0.07: not in every step, but often.
    assert 5 < kept.made < 40
    kept.within(position, np.zeros(1), seam, 0.7)
    made = kept.made
    kept.within(position + np.float32(0.05), np.zeros(1), seam, 0.7)
    assert kept.made == made + 1  # sorted anew


def test_a_world_tells_its_neighbours() -> None:
    world = pv.World(boundary=pv.Periodic(lower=(0, 0), upper=(10, 10)), collisions=None)
    world.add(position=[(0.5, 5), (9.5, 5), (3, 3), (3, 3), (3, 3.6)], radius=0.1)
    i, j, distance, way = world.neighbours(1.5)
    assert i.tolist() == [0, 2, 3]
    assert j.tolist() == [1, 4, 4]  # 2 and 3 are at the same place
    assert distance == pytest.approx([1.0, 0.6, 0.6], rel=1e-6)
    assert way[0] == pytest.approx([-1, 0])  # through the seam
    with pytest.raises(pv.InputError, match="range is 6; allowed in this periodic room is at most 5"):
        world.neighbours(6.0)
    with pytest.raises(pv.InputError, match="range is 0"):
        world.neighbours(0.0)
    assert len(pv.World().neighbours(1.0).i) == 0
