"""Circles at rest report that they are, whatever velocity the solver keeps to carry their weight with."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv

G = 9.81
H = 1 / 480


def slot(count: int, **options: object) -> tuple[pv.World, pv.Group]:
    """A column of circles in a slot one diameter wide."""
    world = pv.World(boundary=pv.Box((0, 0), (1, 2 * count + 2)), **options)  # type: ignore[arg-type]
    return world, world.add(position=np.column_stack((np.full(count, 0.5), 0.5 + np.arange(count))), radius=0.5)


@pytest.mark.parametrize("integrator", [pv.PositionVerlet(), pv.integrators.TimeCorrectedVerlet()])
@pytest.mark.parametrize("settings", [{}, {"friction": 0.5}, {"restitution": 0.5}, {"restitution": 0.5, "friction": 0.5}])
@pytest.mark.parametrize("count", [1, 5, pytest.param(2, marks=pytest.mark.slow)])
def test_a_column_at_rest_reports_no_velocity(count: int, settings: dict[str, float], integrator: pv.Integrator) -> None:
    # Inside, a substep ends with (1 - PUSHED / FED) g h upwards, 0.6 or 0.7 g h, which the next one's gravity takes. A floor
    # without friction leaves the lowest circle with 0, so that the one above has up to 0.17 g h less.
    world, circles = slot(count, collisions=pv.Collisions(**settings), integrator=integrator)  # type: ignore[arg-type]
    world.run(seconds=10)
    speed = []
    for _ in range(60):
        world.step(1 / 60)
        speed.append(np.hypot(*circles.velocity.T))
    least = 0.05 if "friction" in settings else 0.2
    assert np.mean(speed, axis=0).max() < least * G * H
    assert world.energy().kinetic < 0.5 * count * (least * G * H) ** 2


def test_light_circles_under_a_heavy_one_report_no_velocity() -> None:
    world, circles = slot(6)
    circles.mass[5] = 1000.0
    world.run(seconds=20)
    assert np.hypot(*circles.velocity.T).max() < 0.1 * G * H


def test_a_rough_pile_reports_no_velocity() -> None:
    fastest = []
    for count in range(297, 302):
        world = pv.scenes.get("cage").world(particles=count, friction=0.5)
        world.run(seconds=25)
        fastest.append(np.hypot(*world.velocity.T).max())
        assert abs(float(np.median(world.velocity[:, 1]))) < 0.01 * G * H
    # One circle, wedged between four others, may show a velocity with which it does not move, in one pile of eight or so.
    assert sorted(fastest)[-2] < 0.1 * G * H


def test_what_is_not_reported_is_not_forgotten() -> None:
    # The weight is carried from frame to frame by what is not shown: no contact gives way when a frame begins.
    world, circles = slot(5, dtype=np.float64)
    world.run(seconds=40)
    height = circles.position.copy()
    world.run(seconds=1)
    assert circles.position == pytest.approx(height, abs=1e-9)


@pytest.mark.parametrize("mass", [1.0, 1000.0])
@pytest.mark.parametrize("substeps", [1, 8])
def test_circles_that_fall_in_touch_report_how_fast_they_fall(substeps: int, mass: float) -> None:
    # They rest against each other, but on nothing: v = -g t to rounding.
    world = pv.World(dtype=np.float64, substeps=substeps)
    circles = world.add(position=[(0, 0), (0.999, 0), (0.5, 0.86)], radius=0.5, mass=[1.0, mass, 1.0])
    world.run(seconds=2)  # what they overlap moves them by up to 1e-3 m / h at first
    speed = circles.mass @ circles.velocity / circles.mass.sum()
    assert speed == pytest.approx([0, -2 * G], abs=1e-12)
