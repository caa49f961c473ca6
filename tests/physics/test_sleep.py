"""Sleep: what rests costs little, wakes exactly when touched, and nothing else is different."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

G, RADIUS = 9.81, 0.5


def troughs(**options: Any) -> pv.World:
    """Two V-shaped troughs, in which circles without friction come to rest."""
    world = pv.World(boundary=pv.Box((0, 0), (60, 60)), **{"sleep": True, **options})
    for x in (10, 45):
        world.obstacles.append(pv.Chain([(x - 8, 8), (x, 0.5), (x + 8, 8)]))
    return world


def fill(world: pv.World, *x: float) -> list[pv.Group]:
    """Six circles into the troughs there."""
    return [
        world.add(position=[(at + 1.02 * k - 1.02 * row, 3 + 1.1 * row + k) for row in range(3) for k in range(2)], radius=RADIUS)
        for at in x
    ]


def settle(world: pv.World, seconds: float = 15.0) -> None:
    world.run(seconds=seconds)


def test_an_island_wakes_in_the_frame_it_is_touched_and_the_other_sleeps_on() -> None:
    world = troughs(dtype=np.float64)
    a, _ = fill(world, 10, 45)
    settle(world)
    assert world.asleep.all()
    still = a.position.copy()
    highest = int(np.argmax(a.position[:, 1]))
    ball = world.add(position=still[highest] + (0.0, 6.0), velocity=(0.0, 0.0), radius=RADIUS)
    reached = 6.0 - 2 * RADIUS  # m to fall until it touches
    start = world.time
    while 0.5 * G * (world.time + 1 / 60 - start) ** 2 < reached:
        world.step(1 / 60)
        assert world.asleep.tolist() == [True] * 12 + [False]
    assert (a.position == still).all()
    world.step(1 / 60)
    # Awake in the very frame that closes the gap, and moved already.
    assert not world.asleep[:6].any()
    assert world.asleep[6:12].all()
    assert np.hypot(*a.velocity[highest]) > 0.1
    assert ball.velocity[0, 1] > -np.sqrt(2 * G * reached)


@pytest.fixture(scope="module")
def sleepers() -> tuple[pv.World, pv.Group, Any]:
    """Two islands of six asleep, the first group, and the state to go back to; a pinned circle high above."""
    world = troughs()
    a, _ = fill(world, 10, 45)
    world.add(position=(30, 50), mass=np.inf)
    settle(world)
    assert world.asleep[:12].all()
    return world, a, world.save()


Change = Callable[[pv.World, pv.Group], object]

OWN = {
    "velocity": (0, 3), "spin": 5, "restitution": 0.5, "friction": 0.5, "mass": 2.0, "category": 2, "mask": 2, "radius": 0.4,
    "position": (10, 9),
}  # fmt: skip
WORLDWIDE: dict[str, Change] = {
    "gravity": lambda world, a: setattr(world, "gravity", (1, -9)),
    "wall": lambda world, a: setattr(world.boundary, "friction", 0.3),
    "boundary": lambda world, a: setattr(world, "boundary", pv.Circle(center=(30, 30), radius=50)),
    "size": lambda world, a: setattr(world, "boundary", pv.Box((0, 0), (60, 60.0000001))),
    "force": lambda world, a: world.forces.append(pv.Wind(velocity=(5, 0), linear=1.0)),
    "collisions": lambda world, a: setattr(world, "collisions", pv.Collisions(friction=0.5)),
    "link": lambda world, a: world.links.append(pv.Stick(a, 0, 1)),
    "pinned": lambda world, a: world.position[12].__isub__((0, 0.1)),
    "add obstacle": lambda world, a: world.obstacles.append(pv.Disc((30, 30), 1)),
    "remove obstacle": lambda world, a: world.obstacles.pop(1),
    "move obstacle": lambda world, a: setattr(world.obstacles[1], "pivot", (45, 4)),
}


@pytest.mark.parametrize("removes", [False, True])
@pytest.mark.parametrize("change", [*OWN, *WORLDWIDE])
def test_what_the_user_does_wakes(sleepers: tuple[pv.World, pv.Group, Any], change: str, removes: bool) -> None:
    # With and without a removal before the same frame: columns of the sleepers must survive it.
    world, a, saved = sleepers
    world.gravity, world.boundary, world.collisions = (0, -G), pv.Box((0, 0), (60, 60)), pv.Collisions()
    world.forces.clear()
    world.restore(saved)
    extra = world.add(position=(55, 55))
    world.step(1 / 60)
    assert world.asleep[:12].all()
    if removes:
        extra.remove()
    if change in OWN:
        getattr(a, change)[5] = OWN[change]
    else:
        WORLDWIDE[change](world, a)
    world.step(1 / 60)
    assert not world.asleep[:6].any()
    assert world.asleep[6:12].all() == (change in OWN)


@pytest.mark.parametrize("change", ["mask", "category", "unpin", "remove", "move"])
def test_sleepers_fall_when_what_bore_them_goes(change: str) -> None:
    # Ten in a row on ten, on the floor; or one pinned under a column.
    world = pv.World(boundary=pv.Box((0, 0), (20, 20)), sleep=True)
    pinned = world.add(position=(2, 5), mass=np.inf)
    world.add(position=[(2, 6)])
    row = world.add(position=[(4.5 + k, 0.5 + j) for j in range(2) for k in range(10)])
    world.boundary = pv.Box((0, 0), (14.5, 20))
    world.run(seconds=2)
    assert world.asleep[1:].all()
    if change == "mask":
        row.mask[10:] = 0
    elif change == "category":
        row.category[10:] = 0
    elif change == "unpin":
        pinned.mass[0] = 1.0
    elif change == "remove":
        pinned.remove()
    else:
        pinned.position[0] = (1, 15)
    world.run(seconds=2)
    if change in ("mask", "category"):
        assert row.position[:, 1].max() < 0.6
    else:
        assert world.position[-21, 1] < 2.6


AWAKE: dict[str, Change] = {
    "link": lambda world, a: world.links.append(pv.Stick(a, 0, 1)),
    "motor": lambda world, a: world.links.append(pv.Motor(a, 0, speed=0.0, max_torque=3.0)),
    "moving obstacle": lambda world, a: world.obstacles.append(pv.Segment((0, 30), (10, 30), velocity=(0, 0.1))),
    "drum": lambda world, a: setattr(
        world, "boundary", pv.Circle(center=(30, 30), radius=50, friction=0.5, angular_velocity=1e-3)
    ),
    "heat bath": lambda world, a: world.forces.append(pv.Langevin(temperature=0.0, friction=50.0)),
    "fluid": lambda world, a: world.forces.append(pv.Fluid(a, rest_density=1.0, stiffness=1.0)),
}


@pytest.mark.parametrize("kind", AWAKE)
def test_linked_circles_and_worlds_that_move_do_not_sleep(kind: str) -> None:
    world = troughs()
    (group,) = fill(world, 10)
    AWAKE[kind](world, group)
    settle(world)
    assert not world.asleep.any()
