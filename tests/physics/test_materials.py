"""Circles with restitution, friction, category and mask of their own."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv


def rebound(own: float | None, wall: float) -> float:
    """Height of the first rebound over the drop, of a circle dropped on a floor."""
    world = pv.World(boundary=pv.Box((-5, 0), (5, 10), restitution=wall), dtype=np.float64)
    ball = world.add(position=(0, 2.5), radius=0.5, restitution=own)
    while ball.velocity[0, 1] <= 0:
        world.step(1 / 60)
    v, y = ball.velocity[0, 1], ball.position[0, 1] - 0.5
    return float(y + v * v / (2 * 9.81)) / 2.0


@pytest.mark.parametrize(("own", "wall", "counts"), [(None, 0.6, 0.6), (0.8, 0.3, 0.8), (0.3, 0.8, 0.8), (0.7, 0.0, 0.7)])
def test_the_larger_restitution_of_circle_and_wall_counts(own: float | None, wall: float, counts: float) -> None:
    # h' / h = e^2, h' from the energy after the impact, y + v^2 / 2 g. The impact is solved at its time: the rest is rounding.
    assert rebound(own, wall) == pytest.approx(counts**2, abs=1e-12)


def test_friction_of_two_circles_is_the_geometric_mean() -> None:
    # Coulomb's cone: an oblique impact turns spin by at most mu (1 + e) v_n 2 / r for each, I = m r^2 / 2.
    for a, b, mu in ((None, None, 0.1), (0.4, 0.1, 0.2), (0.4, None, 0.2)):
        world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=0.5, friction=0.1), dtype=np.float64)
        world.add(position=(-0.6, -0.3), velocity=(1, 3), friction=a)
        world.add(position=(0.6, 0.3), velocity=(-1, -3), friction=b)
        world.run(seconds=0.5)
        spin = mu * 1.5 * 1.0 * 2 / 0.5
        assert np.abs(world.spin) == pytest.approx(spin, rel=0.05)  # the frictional impulse acts where the substep ends


@pytest.mark.parametrize("method", [pv.Fast(), pv.BruteForce()])
@pytest.mark.parametrize(
    ("a", "b", "collide"),
    [({}, {}, True), ({"category": 2}, {}, True), ({"category": 2, "mask": 2}, {}, False),
     ({"category": 2, "mask": 4}, {"category": 4}, True), ({"category": 2, "mask": 4}, {"category": 4, "mask": 1}, False),
     ({"category": 0}, {}, False)],
)  # fmt: skip
def test_circles_collide_if_each_accepts_the_other(method: object, a: dict[str, Any], b: dict[str, Any], collide: bool) -> None:
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1, method=method), dtype=np.float64)  # type: ignore[arg-type]
    world.add(position=(-1, 0), velocity=(1, 0), **a)
    world.add(position=(1, 0), velocity=(-1, 0), **b)
    world.run(seconds=2)
    assert np.sign(world.velocity[0, 0]) == (-1 if collide else 1)


def test_a_filter_changed_while_running_counts_at_once() -> None:
    # Circles 1.2 m apart stand in the neighbour list from the first frame on.
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1, method=pv.Fast(skin=1.0)), dtype=np.float64)
    balls = world.add(position=[(-0.6, 0), (0.6, 0)], velocity=[(1, 0), (-1, 0)])
    world.step(1 / 60)
    balls.mask[0] = 2
    world.run(seconds=1)
    assert world.velocity[:, 0].tolist() == [1, -1]


@pytest.mark.parametrize(
    ("argument", "value", "says"),
    [("restitution", 1.5, "restitution[0] is 1.5; allowed is a number from 0 to 1"),
     ("restitution", float("nan"), "restitution[0] is nan; allowed is a number from 0 to 1"),
     ("friction", -0.1, "friction[0] is -0.1; allowed is a finite number of at least 0"),
     ("mask", 2**32, "mask is 4294967296; allowed are whole numbers of 32 bits, 0 to 4294967295"),
     ("category", 0.5, "category is 0.5; allowed are whole numbers of 32 bits, 0 to 4294967295"),
     ("mask", [1, 2, 3], "mask has shape (3,); allowed is one number or (1,), one for each particle")],
)  # fmt: skip
def test_bad_materials_are_refused(argument: str, value: object, says: str) -> None:
    world = pv.World()
    with pytest.raises(pv.InputError) as error:
        world.add(position=(0, 0), **{argument: value})  # type: ignore[arg-type]
    assert str(error.value) == says
    assert len(world) == 0
