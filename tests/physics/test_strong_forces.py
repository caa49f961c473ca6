"""Contacts of a particle rest below 4 |a| h of its own acceleration: a strong force on one changes no bounce of another.

|a| was once the largest in the world: a force of 1000 m/s^2 on a single circle took three quarters of the energy of an elastic
gas beside it, and drag on what had been thrown made all contacts of a crowd soft, so that a cloth in it was thrown to infinity.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.integrators import BY_NAME


@pv.force
def hook(x: float, y: float, vx: float, vy: float, m: float, t: float) -> tuple[float, float]:
    """A stiff spring that holds whatever is right of x = 16 at (18, 18)."""
    return (-1e4 * (x - 18), -1e4 * (y - 18)) if x > 16 else (0.0, 0.0)


FORCES: dict[str, Callable[[pv.Group], Any]] = {
    "weak": lambda one: pv.ConstantForce((1.0, 0.0), group=one),
    "strong": lambda one: pv.ConstantForce((1e3, 0.0), group=one),
    "very strong": lambda one: pv.ConstantForce((0.0, -1e5), group=one),
    "hook": lambda one: hook,
}


def gas(force: str | None, **options: Any) -> tuple[pv.World, pv.Group]:
    """An elastic gas among pegs in the left part of a room; right of a wall there is one more, on which the force acts."""
    rng = np.random.default_rng(0)
    room = {"boundary": pv.Box((0, 0), (20, 20), restitution=1), "dtype": np.float64, "gravity": (0, 0), **options}
    world = pv.World(collisions=pv.Collisions(restitution=1), **room)
    x, y = np.meshgrid(1.0 + np.arange(12), 1.0 + np.arange(12))
    group = world.add(position=np.column_stack((x.ravel(), y.ravel())), radius=0.3, velocity=rng.normal(0, 1, (144, 2)))
    one = world.add(position=(18.5, 18), radius=0.3)
    world.obstacles += [pv.Segment((15, 0), (15, 20), restitution=1), pv.Disc((6.5, 6.5), 0.15, restitution=1)]
    if force:
        world.forces.append(FORCES[force](one))
    return world, group


@pytest.mark.parametrize(
    ("force", "integrator"),
    [
        *((force, "position-verlet") for force in FORCES),
        *(("hook", name) for name in ("time-corrected-verlet", "velocity-verlet")),
        ("very strong", "yoshida4"),
    ],
)
def test_an_elastic_gas_keeps_its_energy_beside_one_who_is_pushed_hard(force: str, integrator: str) -> None:
    world, group = gas(force, integrator=BY_NAME[integrator]())
    before = float((group.velocity**2).sum())
    world.run(seconds=1.5)
    assert float((group.velocity**2).sum()) == pytest.approx(before, rel=1e-11)


def test_its_bounces_are_told_as_without_the_force() -> None:
    counts = []
    for force in (None, "strong"):
        world, group = gas(force, events=True)
        bounces = 0
        for _ in range(60):
            world.step(1 / 60)
            begin = world.events.begin
            bounces += int(np.count_nonzero(begin["a"] < len(group)))
        counts.append(bounces)
    assert counts[0] > 150
    # Rounding, which the gas magnifies, makes another gas of it in the end.
    assert counts[1] == pytest.approx(counts[0], rel=0.02)


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
def test_who_is_pressed_hard_rests_and_shows_the_force(e: float) -> None:
    # Statics: two discs of 1 kg that are pressed to a floor by 1000 N each; others bounce beside them, on which no force acts.
    world = pv.World(
        boundary=pv.Box((0, 0), (20, 20), restitution=e),
        collisions=pv.Collisions(restitution=e),
        dtype=np.float64,
        gravity=(0, 0),
        contacts=True,
    )
    world.obstacles.append(pv.Segment((4, 3), (6, 3)))
    pressed = world.add(position=[(5, 3.5), (5, 4.5)], radius=0.5)
    world.add(position=[(10, 0.5 + 1.1 * k) for k in range(5)], radius=0.5, velocity=(0, 1.0))
    world.forces.append(pv.ConstantForce((0, -1e3), group=pressed))
    world.run(seconds=2)
    assert np.abs(pressed.velocity).max() < 1e-3
    assert world.force_on(world.obstacles[0])[1] == pytest.approx(-2e3, rel=1e-6)


def test_drag_on_what_is_thrown_leaves_a_crowd_its_bounces() -> None:
    # Pinned circles that move at up to 40 m/s sweep a cloth through a crowd. Impacts add at most twice their speed each;
    # nobody gets much faster than that, where speeds once went to 1e12 m/s.
    rng, n = np.random.default_rng(41), 143
    world = pv.World(
        boundary=pv.Box((-10, -10), (10, 10), restitution=0.76), collisions=pv.Collisions(restitution=0.69), dtype=np.float64
    )
    place, radius = rng.uniform(-6.66, 6.66, (n, 2)), 0.483 * 50 ** -rng.random(n)
    crowd = world.add(
        position=place, radius=radius, velocity=rng.normal(0, 13.6, (n, 2)), mass=3 ** rng.random(n), on_overlap="push"
    )
    crowd.mass[rng.random(n) < 0.1] = np.inf
    pv.cloth(world, (-1.98, 3.38), width=3, height=2, columns=6, rows=5)
    world.forces += [pv.Drag(quadratic=0.0863), pv.Attractor(strength=9.88, softening=1.0)]
    for _ in range(40):
        world.step(1 / 60)
        assert np.abs(world.velocity).max() < 400
