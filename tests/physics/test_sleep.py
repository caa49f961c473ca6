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


GOES: dict[str, tuple[int, Callable[[pv.World], object]]] = {
    "removed": (1, lambda world: world.remove(0)), "moved": (1, lambda world: world.groups[0].move_to((9, 9))),
    "let go": (0, lambda world: world.mass.__setitem__(0, 1.0)),
    "category of the upper one": (3, lambda world: world.category.__setitem__(3, 0)),
    "mask of the upper one": (3, lambda world: world.mask.__setitem__(3, 0)),
    "collisions": (3, lambda world: setattr(world, "collisions", None)),
    "a rule": (3, lambda world: world.actors.append(pv.contact_rule(lambda world, new: True))),
    "category of the obstacle": (4, lambda world: setattr(world.obstacles[0], "category", 2)),
    "a sensor": (4, lambda world: setattr(world.obstacles[0], "sensor", True)),
    "its own filter": (4, lambda world: (world.mask.__setitem__(4, 2), world.category.__setitem__(4, 2))),
    "mask of the room": (5, lambda world: setattr(world.boundary, "mask", 2)),
}  # fmt: skip


@pytest.mark.parametrize("change", GOES)
@pytest.mark.parametrize("sleep", [False, True])
def test_what_lies_on_something_falls_when_that_goes(change: str, sleep: bool) -> None:
    """By g t^2 / 2 from the middle of a substep on: on a pinned circle, on another, on an obstacle, on the floor."""
    who, changed = GOES[change]
    world = pv.World(boundary=pv.Box((-20, 0), (20, 20)), dtype=np.float64, threads=1, sleep=sleep)
    world.obstacles.append(pv.Segment((4, 6), (8, 6), category=1))
    for at in ((-9, 6), (-9, 7), (0, 0.5), (0, 1.5), (6, 6.5), (12, 0.5)):
        world.add(position=at, radius=RADIUS, mask=1)
    world.mass[0] = np.inf
    world.run(seconds=4)
    assert not sleep or world.asleep[1:].all()
    before = world.position[who, 1]
    changed(world)
    world.run(seconds=0.25)
    who -= len(world) < 6
    assert not sleep or not world.asleep[who]
    assert world.position[who, 1] == pytest.approx(before - G / 32, abs=1.01 * 0.5 * G * 0.25 / 480 + 1e-9)


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
