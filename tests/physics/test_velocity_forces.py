"""Forces that depend on the velocity: terminal speeds however strong the drag is, and magnetic forces that do no work."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.integrators import BY_NAME

DT = 1 / 60


def magnet(x: float, y: float, vx: float, vy: float, mass: float, t: float) -> tuple[float, float]:
    return 20 * vy, -20 * vx


class Magnet:
    """The same as an object of the user's own."""

    velocity_dependent = True

    def apply(self, state: Any, t: float) -> None:
        state.force[:, 0] += 20 * state.velocity[:, 1]
        state.force[:, 1] -= 20 * state.velocity[:, 0]


@pytest.mark.parametrize("name", BY_NAME)
@pytest.mark.parametrize("substeps", [1, 8])
def test_a_fall_through_honey_ends_at_the_terminal_speed(name: str, substeps: int) -> None:
    # c h / m from 0.06 to 2e5, linear and quadratic, each alone and both, in wind; m g = (c + q u) u.
    world = pv.World(dtype=np.float64, integrator=BY_NAME[name](), substeps=substeps)
    world.add(position=[(3.0 * k, 0.0) for k in range(4)], mass=[0.1, 1.0, 10.0, 3.0])
    for c, q in [(60.0, 0.0), (4800.0, 0.0), (1e7, 0.0), (0.0, 30.0), (0.0, 1e6), (500.0, 4e4)]:
        world.velocity[:] = (3.0, 0.0)
        world.forces[:] = [pv.Drag(linear=c / 2, quadratic=q), pv.Wind((0.25, 0.5), linear=c / 2)]
        world.run(seconds=3 if c == 60 else 1 if c == 0 else 0.5)
        wind = np.array((0.25, 0.5)) * (0.5 if c else 0.0)
        speed = world.velocity.copy()
        if q == 0:
            assert speed - wind == pytest.approx(np.column_stack((np.zeros(4), -world.mass * 9.81 / c)), rel=0.01, abs=1e-6)
        elif c == 0:
            assert -speed[:, 1] == pytest.approx(np.sqrt(world.mass * 9.81 / q), rel=0.01)


@pytest.mark.parametrize(
    ("name", "own", "frames"),
    [
        *((name, False, 120) for name in ("position-verlet", "time-corrected-verlet", "velocity-verlet", "rk4", "yoshida4")),
        ("position-verlet", True, 120),
        ("rk4", True, 120),
        pytest.param("position-verlet", False, 3600, marks=pytest.mark.slow),
    ],
)
def test_a_magnetic_force_does_no_work(name: str, own: bool, frames: int) -> None:
    world = pv.World(gravity=(0, 0), dtype=np.float64, integrator=BY_NAME[name](), collisions=None)
    ball = world.add(position=(0, 0), velocity=(1, 0))
    world.forces.append(Magnet() if own else pv.force(magnet))
    speeds, places = [], []
    for _ in range(frames):
        world.step(DT)
        speeds.append(float(np.hypot(*ball.velocity[0])))
        places.append(ball.position[0].copy())
    assert np.abs(np.square(speeds) - 1).max() < 1e-3
    assert np.ptp(places, axis=0) == pytest.approx([2 / 20, 2 / 20], rel=0.03)  # the gyration radius m v / B


def test_it_does_not_matter_who_integrates() -> None:
    worlds = []
    for look in (None, lambda moment: None):
        world = pv.World(boundary=pv.Box((-3, -3), (3, 3)), dtype=np.float64)
        world.add(position=[(-1, 0), (1, 0), (0, 1.5)], velocity=[(1, 0), (0, 2), (-1, 0)], radius=0.3)
        world.forces += [pv.Drag(linear=0.3), pv.force(magnet), pv.Drag(quadratic=900.0)]
        world.onlooker = look
        world.run(seconds=1)
        worlds.append(world.position.copy())
    assert np.array_equal(worlds[0], worlds[1])


def test_the_ledger_knows_what_strong_drag_takes() -> None:
    world = pv.World(dtype=np.float64, ledger=True)
    world.add(position=(0, 0), mass=2.0)
    world.forces.append(pv.Drag(linear=4800))
    world.run(seconds=2)
    assert world.ledger.drag == pytest.approx(world.energy().total, rel=0.01)
    assert world.ledger.total == pytest.approx(world.energy().total, rel=1e-9)
