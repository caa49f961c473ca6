"""The ledger under the contact law: what contacts take and give, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv


def world_of(e: float = 0.0, mu: float = 0.0, **options: Any) -> pv.World:
    law = pv.Collisions(restitution=e, friction=mu)
    return pv.World(**{"ledger": True, "dtype": np.float64, "collisions": law, **options})


def heap(threads: int = 1, dtype: Any = np.float64, *, ledger: bool = True) -> pv.World:
    world = world_of(0.3, 0.5, boundary=pv.Box((-5, 0), (5, 20)), ledger=ledger, dtype=dtype, threads=threads)
    x, y = np.meshgrid(np.arange(-4, 4.1, 0.8), np.arange(1, 10, 0.8))
    places = np.column_stack((x.ravel(), y.ravel()))
    world.add(position=places + np.random.default_rng(1).uniform(-0.1, 0.1, places.shape), radius=0.3)
    return world


def test_an_elastic_gas_has_no_accounts() -> None:
    # e = 1 and no friction: energy is kept to rounding, and none of the accounts has anything.
    world = world_of(1.0, gravity=(0, 0), boundary=pv.Box((0, 0), (10, 10), restitution=1.0))
    places = np.stack(np.meshgrid(np.arange(1, 10), np.arange(1, 10)), axis=-1).reshape(-1, 2)
    world.add(position=places, velocity=np.random.default_rng(2).normal(0, 3, places.shape), radius=0.2)
    world.run(seconds=2)
    books = world.ledger.as_dict()
    assert books.pop("outside") == pytest.approx(world.energy().total, rel=1e-12)
    assert max(map(abs, books.values())) < 1e-12 * world.energy().total


def test_a_heap_loses_its_energy_to_impacts_and_friction_and_then_nothing() -> None:
    world = heap()
    world.run(seconds=12)
    settled = world.ledger.as_dict()
    assert settled["restitution"] < 0 > settled["friction"]
    assert abs(settled["residual"]) < 1e-13 * settled["outside"] * 5760  # substeps
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-12)
    world.run(seconds=1)
    later = world.ledger.as_dict()
    scale = 1e-4 * settled["outside"]
    assert all(later[name] == pytest.approx(settled[name], abs=scale) for name in later)
