"""A free particle stays on its closed form while gravity, the length of frames or the number of substeps change."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

FRAME, G = 1 / 60, 9.81
SECOND_ORDER = [None, pv.TimeCorrectedVerlet(), pv.VelocityVerlet(), pv.RK4(), pv.Yoshida4()]


@pytest.mark.parametrize("integrator", SECOND_ORDER, ids=repr)
@pytest.mark.parametrize("dt", [np.tile([1 / 240, FRAME], 60), np.tile([FRAME, 1 / 30, 0.25], 20)])
def test_a_throw_is_a_parabola_whatever_the_clock(integrator: Any, dt: Any) -> None:
    world = pv.World(dtype=np.float64, integrator=integrator)
    ball = world.add(position=(0, 0), velocity=(10, 20))
    for k, each in enumerate(dt):
        world.substeps = 4 if k % 7 == 3 else 8
        world.step(float(each))
    t = world.time
    # y = v t - g t^2 / 2 is of degree 2: methods of order 2 have no error but rounding.
    assert ball.position[0] == pytest.approx((10 * t, 20 * t - G * t**2 / 2), abs=1e-9)
    assert ball.velocity[0] == pytest.approx((10, 20 - G * t), abs=1e-10)


@pytest.mark.parametrize("integrator", [*SECOND_ORDER, pv.PositionVerlet()], ids=repr)
@pytest.mark.parametrize("gravity", [(0.0, 0.0), (3.0, 9.81), (0.0, -98.1)])
def test_gravity_changed_in_flight(integrator: Any, gravity: tuple[float, float]) -> None:
    world = pv.World(dtype=np.float64, integrator=integrator)
    ball = world.add(position=(0, 0), velocity=(3, 5))
    world.run(seconds=0.5)
    start, speed = ball.position[0].copy(), ball.velocity[0].copy()
    world.gravity = gravity
    world.run(seconds=1.0)
    assert ball.position[0] == pytest.approx(start + speed + np.array(gravity) / 2, abs=1e-9)
    assert ball.velocity[0] == pytest.approx(speed + np.array(gravity), abs=1e-9)


def test_gravity_changed_before_anything_moved() -> None:
    world = pv.World(dtype=np.float64)
    ball = world.add(position=(0, 0))
    ball.pin(0)
    world.add(position=(5, 0))
    world.gravity = (0, -1.0)
    world.run(seconds=1.0)
    assert world.position.ravel() == pytest.approx([0, 0, 5, -0.5], abs=1e-9)
