"""The ledger under the contact law: what contacts take and give, against closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

G = 9.81


def world_of(e: float = 0.0, mu: float = 0.0, **options: Any) -> pv.World:
    law = pv.Collisions(restitution=e, friction=mu)
    return pv.World(**{"ledger": True, "dtype": np.float64, "collisions": law, **options})


def heap(threads: int = 1, dtype: Any = np.float64, *, ledger: bool = True) -> pv.World:
    world = world_of(0.3, 0.5, boundary=pv.Box((-5, 0), (5, 20)), ledger=ledger, dtype=dtype, threads=threads)
    x, y = np.meshgrid(np.arange(-4, 4.1, 0.8), np.arange(1, 10, 0.8))
    places = np.column_stack((x.ravel(), y.ravel()))
    world.add(position=places + np.random.default_rng(1).uniform(-0.1, 0.1, places.shape), radius=0.3)
    return world


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9])
def test_a_bounce_takes_its_part_of_the_fall(e: float) -> None:
    # (1 - e^2) m g H with m = 2 kg, H = 2 m; rounded in each of 480 substeps a second.
    world = world_of(boundary=pv.Box((-5, 0), (5, 10), restitution=e))
    ball = world.add(position=(0, 2.5), mass=2.0)
    while ball.velocity[0, 1] <= 0 and world.time < 1:
        world.step(1 / 60)
    assert world.ledger.restitution == pytest.approx(-(1 - e * e) * 2 * G * 2, rel=1e-6 if e else 1e-3)
    assert abs(world.ledger.residual) < 1e-11


@pytest.mark.parametrize("integrator", [pv.PositionVerlet(), pv.VelocityVerlet()])
def test_a_disc_that_slides_into_rolling_gives_a_third_of_its_energy_to_friction(integrator: pv.Integrator) -> None:
    # From v0 to 2/3 v0 with I = m r^2 / 2: m v0^2 / 6, over 4,800 substeps that round at 1e-16 of 55 J.
    world = world_of(boundary=pv.Box((-50, 0), (50, 10), friction=0.5), integrator=integrator)
    world.add(position=(-40, 0.5), velocity=(10, 0))
    world.run(seconds=10)
    books = world.ledger
    assert books.friction == pytest.approx(-100 / 6, abs=1e-11)
    assert abs(books.residual) + abs(books.restitution) + abs(books.projection) < 1e-10


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


def test_a_turning_drum_has_work_of_its_own() -> None:
    # A disc at rest in a cage whose surface turns is spun up: walls give it energy, half of which is lost to friction.
    world = world_of(boundary=pv.Circle(radius=5, friction=0.5, angular_velocity=2.0), gravity=(0, -G))
    world.add(position=(0, -4.5), radius=0.5)
    world.run(seconds=1)
    books = world.ledger
    assert books.walls > 0 > books.friction
    assert abs(books.residual) < 1e-10
    assert books.total == pytest.approx(world.energy().total, abs=1e-11)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_any_number_of_threads_has_the_same_accounts_and_moves(dtype: type) -> None:
    one, two, without = heap(1, dtype), heap(2, dtype), heap(1, dtype, ledger=False)
    for world in (one, two, without):
        world.run(seconds=1)
    assert one.ledger.as_dict() == two.ledger.as_dict()
    assert one.state_hash() == two.state_hash() == without.state_hash()
