"""Which circles touch, and how far they overlap: against all pairs, one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.contacts.collisions import touching


def crowd(room: pv.Boundary, dtype: Any) -> pv.World:
    """Circles of radii from 1 mm to 2 m in [-8, 8]^2, some of them pinned, some that touch few others by their marks."""
    chance = np.random.default_rng(7)
    world = pv.World(boundary=room, collisions=None, dtype=dtype)
    radius = 2.0 ** chance.uniform(-10, 1, 400)
    world.add(position=chance.uniform(-6, 6, (400, 2)), radius=radius)
    world.mass[::9] = np.inf
    world.category[::4], world.mask[::3] = 2, 1
    return world


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("room", [pv.Open(), pv.Periodic((-8, -8), (8, 8))], ids=repr)
def test_all_pairs_that_overlap_are_found_once(room: pv.Boundary, dtype: Any) -> None:
    world = crowd(room, dtype)
    x, r = world.position.astype(float), world.radius.astype(float)
    i, j = np.triu_indices(len(world), 1)
    far = np.hypot(*room.seam.nearest(x[i] - x[j]).T)
    may = (world.category[i] & world.mask[j] != 0) & (world.category[j] & world.mask[i] != 0)
    touch = may & ~(np.isinf(world.mass[i]) & np.isinf(world.mass[j])) & (far < r[i] + r[j])
    found = touching(world._state)
    assert sorted(map(tuple, found.tolist())) == list(zip(i[touch].tolist(), j[touch].tolist(), strict=True))
    depth = 1 - far[touch] / (r[i] + r[j])[touch]
    overlap = world.overlap()
    assert (overlap.contacts, overlap.mean, overlap.max) == pytest.approx((len(depth), depth.mean(), depth.max()), rel=1e-5)


def test_those_that_links_keep_apart_do_not_count() -> None:
    world = pv.World()
    group = world.add(position=[(0, 0), (0.5, 0), (5, 0), (5.8, 0)], radius=0.5)
    world.links.append(pv.Stick(group, 1, 0, collide=False))
    assert world.overlap() == pytest.approx((0.2, 0.2, 1), rel=1e-6)
