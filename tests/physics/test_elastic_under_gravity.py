"""Circles, rooms and obstacles with e = 1 keep their energy under gravity, whatever rests or is thrown at what."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

G, DT = 9.81, 1 / 60

PEGS = [pv.Disc((x, 0.5), 0.05, restitution=1.0) for x in (0.5, 1.5, 2.5, 3.3)]
SLOPES = [
    pv.Segment((0, 0.5), (2, 0), restitution=1.0),
    pv.Polygon([(2, 0), (4, 0), (4, 0.6)], restitution=1.0),
]

CASES: dict[str, dict[str, Any]] = {
    "box": {},
    "float32": {"dtype": np.float32},
    "frames of 1/30 s": {"dt": 1 / 30},
    "from rest": {"speed": 0.0},
    "cage": {"boundary": pv.Circle(center=(2, 2), radius=2.6, restitution=1.0)},
    "masses": {"mass": 100.0},
    "radii": {"radius": 3.0},
    "pegs": {"obstacles": PEGS},
    "slopes": {"obstacles": SLOPES},
}


@pytest.mark.parametrize("name", CASES)
def test_circles_that_bounce_without_loss_keep_their_energy(name: str) -> None:
    """sum(m v^2 / 2 + m g y) is kept but for bounces slower than 4 g h, which end: each costs m (4 g h)^2 / 2.

    With h = 1/480 s that is 3e-3 J/kg of the 20 J/kg that each has.
    """
    case = dict(CASES[name])
    rng, k = np.random.default_rng(1), np.arange(40)
    world = pv.World(
        boundary=case.get("boundary", pv.Box((0, 0), (4, 4), restitution=1.0)),
        dtype=case.get("dtype", np.float64),
        collisions=pv.Collisions(restitution=1.0),
    )
    world.obstacles.extend(case.get("obstacles", []))
    place = np.column_stack((0.35 + 0.37 * (k % 10), 1.0 + 0.32 * (k // 10))) + rng.uniform(-0.02, 0.02, (40, 2))
    world.add(
        position=place,
        velocity=case.get("speed", 1.0) * rng.normal(0, 1, (40, 2)),
        radius=0.1 * case.get("radius", 1.0) ** rng.uniform(-1, 0, 40),
        mass=case.get("mass", 1.0) ** rng.uniform(0, 1, 40),
    )
    start = world.energy().total
    moves = world.energy().kinetic + float((world.mass * G * (world.position[:, 1] - world.position[:, 1].min())).sum())
    world.run(seconds=8.0, dt=case.get("dt", DT))
    assert world.energy().total == pytest.approx(start, abs=1e-3 * moves)


@pytest.mark.parametrize("aside", [0.0, 0.05, 0.12])
@pytest.mark.parametrize("support", ["floor", "slab", "peg", "pinned", "cage"])
def test_a_blow_on_what_rests_bounces_back_from_below(support: str, aside: float) -> None:
    """A ball falls onto a disc that lies on something elastic: the disc is thrown at that, comes back, and nothing is lost.

    What the disc lies with is: at most the blow of m g h that it is held by in a substep, m v g h of energy for a speed v.
    """
    room: pv.Boundary | None = pv.Circle(center=(0, 3), radius=3.0, restitution=1.0) if support == "cage" else None
    room = pv.Box((-3, 0), (3, 6), restitution=1.0) if support == "floor" else room
    world = pv.World(boundary=room, dtype=np.float64, collisions=pv.Collisions(restitution=1.0))
    if support == "slab":
        world.obstacles.append(pv.Polygon([(-3, -1), (3, -1), (3, 0), (-3, 0)], restitution=1.0))
    elif support == "peg":
        world.obstacles.append(pv.Disc((0, -0.5), 0.5, restitution=1.0))
    elif support == "pinned":
        world.add(position=(0, -0.5), radius=0.5, mass=1.0).pin()
    rests = world.add(position=(0.0, 0.1), radius=0.1, mass=1.0)
    world.run(seconds=0.3, dt=DT)
    assert abs(rests.velocity[0, 1]) < 1e-3
    world.add(position=(aside, 0.6), velocity=(0.0, -3.0), radius=0.1, mass=1.0)
    start, speed = world.energy().total, np.hypot(3.0, np.sqrt(2 * G * 0.4))
    world.run(seconds=0.3, dt=DT)
    assert world.velocity[-1, 1] > -3.0 - G * 0.3 + 0.1, "it has struck"
    assert world.energy().total == pytest.approx(start, abs=2 * speed * G * DT / 8)


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_a_blow_goes_down_a_stack_and_comes_back(count: int) -> None:
    """Equal elastic discs hand a blow on to the next, the floor gives it back: the last one leaves as fast as it came.

    At the height at which it began, v = -v_0, but for the time that the blow takes: g of a substep for each disc.
    """
    world = pv.World(
        boundary=pv.Box((-3, 0), (3, 9), restitution=1.0), dtype=np.float64, collisions=pv.Collisions(restitution=1.0)
    )
    for k in range(count):
        world.add(position=(0, 0.1 + 0.2 * k), radius=0.1, mass=1.0)
    world.run(seconds=0.5, dt=DT)
    top = 0.2 * count + 0.4
    ball = world.add(position=(0, top), velocity=(0, -3.0), radius=0.1, mass=1.0)
    while ball.velocity[0, 1] <= 0:
        world.step(DT)
        assert world.time < 1.0, "the blow does not come back"
    y, v = float(ball.position[0, 1]), float(ball.velocity[0, 1])
    assert np.sqrt(v**2 - 2 * G * (top - y)) == pytest.approx(3.0, abs=(count + 1) * G * DT / 8)
    np.testing.assert_allclose(world.velocity[:-1], 0.0, atol=(count + 1) * G * DT / 8)
