"""What a world keeps in memory, and that what it lets go comes back when it is needed."""

from __future__ import annotations

import gc
import tracemalloc
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet import scenes


def beyond(particles: int) -> float:
    """Bytes a particle that a world of the scene `cage` holds after a second, beyond the arrays its user sees."""
    world = scenes.get("cage").world(particles=particles)
    world.threads = 1
    world.run(seconds=1)
    gc.collect()
    seen = sum(array.nbytes for _, array in world._state.arrays())
    return (tracemalloc.get_traced_memory()[0] - seen) / particles


def test_a_particle_takes_no_more_than_920_bytes_beside_what_the_user_sees() -> None:
    # Of these some 350 are its three pairs in the list, found, sorted and kept, with what contacts remember.
    tracemalloc.start()
    try:
        beyond(1000)  # compiled code and its like are counted here
        held = tracemalloc.get_traced_memory()[0]
        assert beyond(10_000) - held / 10_000 <= 920
    finally:
        tracemalloc.stop()


def row(**options: Any) -> tuple[pv.World, pv.Group]:
    """Two circles that come together at 1 m/s each, 0.1 m apart: for the list of pairs they are neighbours from the start."""
    world = pv.World(gravity=(0, 0), dtype=np.float64, **options)
    return world, world.add(position=[(0, 0), (1.1, 0)], velocity=[(1, 0), (-1, 0)], radius=0.5)


def test_circles_that_learn_to_bounce_in_flight_do() -> None:
    world, pair = row()
    world.step(1 / 60)
    pair.restitution[:] = 1
    world.run(seconds=0.1)
    assert pair.velocity == pytest.approx(np.array([(-1, 0), (1, 0)]), abs=1e-12)


def test_the_way_back_leads_across_a_change_of_material() -> None:
    rng = np.random.default_rng(0)
    world = pv.World(boundary=pv.Box((0, 0), (12, 20)), collisions=pv.Collisions(friction=0.3))
    x, y = np.meshgrid(np.arange(1, 11, 1.01), np.arange(1, 8, 1.01))
    group = world.add(position=np.column_stack((x.ravel(), y.ravel())) + rng.uniform(0, 0.01, (x.size, 2)), radius=0.5)
    world.run(seconds=0.5)
    saved = world.save()
    world.run(seconds=0.5)
    there = world.state_hash()
    world.collisions = pv.Collisions()
    world.run(seconds=0.2)
    world.collisions = pv.Collisions(friction=0.3)
    world.restore(saved)
    world.run(seconds=0.5)
    assert world.state_hash() == there
    # The same, but by the circles' own friction, where the solver stays who it is.
    group.friction[:] = 0.3
    world.collisions = pv.Collisions()
    world.step(1 / 60)
    saved = world.save()
    world.run(seconds=0.5)
    there = world.state_hash()
    group.friction[:] = -1
    world.run(seconds=0.2)
    world.restore(saved)
    world.run(seconds=0.5)
    assert world.state_hash() == there
