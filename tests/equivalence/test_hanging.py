"""Who hangs together, followed from substep to substep, against the same found anew from the pairs that touch."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv


def lowest_of_each(n: int, i: Any, j: Any) -> Any:
    """(n,) the lowest member of everyone's cluster: it is handed on until nothing changes."""
    lowest = np.arange(n)
    while True:
        least = np.minimum(lowest[i], lowest[j])
        now = lowest.copy()
        np.minimum.at(now, i, least)
        np.minimum.at(now, j, least)
        if (now == lowest).all():
            return lowest
        lowest = now


def heap(n: int, seed: int, *, pinned: bool) -> pv.World:
    world = pv.scenes.get("cage").world(particles=n, threads=1)
    rng = np.random.default_rng(seed)
    world.mass = 100 ** rng.random(n)
    if pinned:
        world.mass[rng.random(n) < 0.02] = np.inf
    return world


@pytest.mark.parametrize("pinned", [False, True])
@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_clusters_are_those_of_the_pairs_that_touch(friction: float, *, pinned: bool) -> None:
    # From the fall, in which all changes and all is joined anew, to a heap, where hardly anything does.
    world = heap(1500, 0, pinned=pinned)
    world.collisions = pv.Collisions(friction=friction)
    parts = set()
    for frame in range(300):
        world.step(1 / 60)
        if frame == 200:
            world.velocity[::7] += (0.0, 1.5)  # some leave it for a while
        contacts = world._contacts
        assert contacts
        assert contacts.lends
        begin, lanes, lane_i, lane_j, normal = contacts.wide.touching()
        k = np.concatenate([np.arange(a, a + count) for a, count in zip(begin, lanes, strict=False)])
        k = k[(normal[:, k] != 0).any(axis=0)]
        root, heads, sets = contacts.lent()[1].arrays[:3]
        expected = lowest_of_each(len(world), lane_i[k], lane_j[k])
        assert (root == expected).all()
        assert sorted(set(heads[: sets[0]])) == sorted(set(expected))
        parts.add(int(sets[0]))
    assert len(parts) > 20
