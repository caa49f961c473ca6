"""Circles wider than the gap between two pinned ones do not pass it, at any speed that the list of pairs can follow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

PEGS = [(-0.4, 0.0), (0.4, 0.0)]
PEG = 0.3
GAP = 0.8 - 2 * PEG
TOO_LARGE = 1.05 * GAP / 2


def corner(radius: float) -> float:
    """Height at which a circle touches both pegs: the distance to each is PEG + radius, and 0.4 of it along the line."""
    return float(np.sqrt((PEG + radius) ** 2 - 0.4**2))


def sieve(speed: float, *, above: float = 2.0, radius: float = TOO_LARGE, x: float = 0.0, **options: Any) -> tuple[pv.World, Any]:
    options = {"collisions": pv.Collisions(restitution=0.1, friction=0.2), "threads": 1, **options}
    world = pv.World(**options)
    world.add(position=PEGS, radius=PEG).pin()
    return world, world.add(position=(x, above), velocity=(0, -speed), radius=radius)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("speed", [1, 4, 8, 16, 32, 64])
@pytest.mark.parametrize("x", [0.0, 0.002])
def test_a_circle_too_large_does_not_pass_between_pegs(speed: float, x: float, dtype: Any) -> None:
    world, ball = sieve(speed, x=x, dtype=dtype)
    lowest = 2.0
    for _ in range(90):
        world.step(1 / 60)
        lowest = min(lowest, float(ball.position[0, 1]))
    assert lowest == pytest.approx(corner(TOO_LARGE), abs=1e-6)
    assert ball.position[0, 1] == pytest.approx(corner(TOO_LARGE), abs=1e-3)
    assert ball.velocity[0] == pytest.approx(0, abs=1e-6)


def test_nor_from_below() -> None:
    world, ball = sieve(-16, above=-2.0, gravity=(0, 0))
    world.run(seconds=0.5)
    assert ball.position[0, 1] <= -0.99 * corner(TOO_LARGE)


def test_one_that_fits_falls_through() -> None:
    world, ball = sieve(8, radius=0.95 * GAP / 2)
    world.run(seconds=1)
    assert ball.position[0, 1] < -2


@pytest.mark.parametrize(("mass", "friction"), [(1.0, 0.3), (20.0, 0.0)])
def test_nor_under_a_pile_of_twenty_layers(mass: float, friction: float) -> None:
    room = pv.Box((-0.7, -3), (0.7, 12))
    world, ball = sieve(0, above=0.075, boundary=room, collisions=pv.Collisions(friction=friction))
    x, y = np.meshgrid([-0.35, 0.0, 0.35], 0.5 + 0.42 * np.arange(20))
    pile = world.add(position=np.column_stack((x.ravel() + 0.03 * (np.arange(60) % 2), y.ravel())), radius=0.17, mass=mass)
    world.run(seconds=5)
    assert ball.position[0, 1] == pytest.approx(corner(TOO_LARGE), abs=1e-3)
    assert (pile.position[:, 1] > -0.17).all()


def test_pegs_that_move_push_nobody_through_a_wall() -> None:
    # Two of infinite mass on their way down, nearer to each other than what lies under them is wide: the room wins.
    world = pv.World(boundary=pv.Box((-3, 0), (3, 6)), dtype=np.float64, threads=1)
    world.add(position=[(-0.5, 1.6), (0.5, 1.6)], velocity=(0, -1.0), radius=0.3, mass=np.inf)
    disc = world.add(position=[(0, 0.5)], radius=0.5)
    for _ in range(90):
        world.step(1 / 60)
        assert disc.position[0, 1] > 0.5 * (1 - 1e-3)
