"""Friction at rest: what stands by it stands still, however the list of pairs comes and goes, and what cannot stand falls."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv

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
    world.run(seconds=1)
    start = circles.position.astype(float)
    world.run(seconds=5)
    # Those of order 4 are several steps a substep, each rounded: 5,000 substeps by 6e-8 m.
    assert np.abs(circles.position - start).max() < (5e-4 if name in ("rk4", "yoshida4") else 5e-5) * RADIUS
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
