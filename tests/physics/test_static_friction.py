"""Friction at rest: what stands by it stands still, however the list of pairs comes and goes, and what cannot stand falls."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.kernels.tables import NEW

RADIUS = 0.5
LIMIT = np.tan(np.radians(15))  # 0.268


def pyramid(friction: float, **options: object) -> tuple[pv.World, pv.Group]:
    """One circle on two that touch, on a floor.

    It stands if mu >= tan 15 deg between circles: a lower one has two points of contact that carry, 150 degrees apart as seen
    from its centre. Without a torque the friction at both is the same, and with the weight and the two normal forces it
    balances only if it is tan 15 deg of the upper normal force. The floor, which carries more, needs less.
    """
    world = pv.World(
        boundary=pv.Box((-20, 0), (20, 20), friction=friction),
        collisions=pv.Collisions(friction=friction, **options),  # type: ignore[arg-type]
    )
    height = RADIUS + RADIUS * np.sqrt(3)
    circles = world.add(position=[(-RADIUS, RADIUS), (RADIUS, RADIUS), (0, height)], radius=RADIUS)
    return world, circles


def test_a_pyramid_falls_apart_below_tan_15_degrees() -> None:
    world, circles = pyramid(0.9 * LIMIT)
    world.run(seconds=5)
    assert np.ptp(circles.position[:, 1]) < 0.1 * RADIUS


@pytest.mark.parametrize("substeps", [8, *(pytest.param(each, marks=pytest.mark.slow) for each in (4, 16))])
@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_a_pyramid_stands_above_tan_15_degrees(name: str, substeps: int) -> None:
    world, circles = pyramid(1.1 * LIMIT)
    world.integrator = pv.integrators.BY_NAME[name]()
    world.substeps = substeps
    world.run(seconds=2)
    start = circles.position.astype(float)
    world.run(seconds=10)
    assert np.abs(circles.position - start).max() < 1e-4 * RADIUS
    assert np.abs(circles.spin).max() < 1e-2  # rad/s


@pytest.mark.parametrize("method", [pv.Fast(skin=0.0), pv.BruteForce()])
@pytest.mark.slow
def test_a_pyramid_stands_while_the_list_is_made_anew(method: pv.Fast | pv.BruteForce) -> None:
    world, circles = pyramid(1.1 * LIMIT, method=method)
    start = circles.position.astype(float)
    world.run(seconds=10)
    # Each starts without overlap and without slip: h^2 g is 4e-5 m, and the weight of three rests on a few of those.
    assert np.abs(circles.position - start).max() < 2e-3 * RADIUS


def test_a_pyramid_stands_while_others_come_and_go() -> None:
    world, circles = pyramid(1.1 * LIMIT)
    world.run(seconds=2)
    start = circles.position.astype(float)
    for k in range(120):
        others = world.add(position=np.array([(5, RADIUS), (7, 1)]) + 0.01 * k, radius=RADIUS)
        world.step(1 / 60)
        world.remove(others)
    assert np.abs(circles.position - start).max() < 1e-3 * RADIUS


def test_the_slip_of_a_pair_follows_its_particles() -> None:
    world, circles = pyramid(1.1 * LIMIT)
    gone = world.add(position=[(5, RADIUS), (9, RADIUS)], radius=RADIUS)
    more = world.add(position=circles.position + np.array([12, 0]), radius=RADIUS)
    world.run(seconds=2)

    def slips() -> dict[tuple[int, int], float]:
        kept = world.save().contacts[1]
        assert (kept.slip < NEW).all()
        return {(int(a), int(b)): float(s) for a, b, s in zip(*kept, strict=True)}

    before = slips()
    assert {(0, 2), (1, 2), (5, 7), (6, 7)} <= set(before)
    assert before[0, 2] * before[1, 2] < 0  # mirrored
    world.remove(gone)
    # Two fewer before them, and the same slips.
    assert slips() == {(a - 2 * (a > 2), b - 2 * (b > 2)): s for (a, b), s in before.items()}
    assert len(circles) == len(more) == 3


def test_friction_that_begins_later_starts_without_slip() -> None:
    world, circles = pyramid(1.1 * LIMIT)
    world.run(seconds=1)
    world.collisions = pv.Collisions()
    world.run(seconds=0.1)
    assert world.save().contacts[1].slip.size == 0
    circles.friction = 1.1 * LIMIT
    world.step(1 / 60)
    assert world.save().contacts[1].slip.size > 0
