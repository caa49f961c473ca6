"""Circles that begin in each other: they part within two or three seconds, at moderate speed, no farther than they must."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import G, each_frame, grid

import pyverlet as pv
from pyverlet.lab.physics import energy as rows

SECONDS = 2.0
PARTED, PARTED_FREELY = 0.03, 0.05  # of the contact distance: what is left then; without forces hundreds take longer
FASTEST = 20.0  # m/s: overlaps are pushed out with 8 radii/s each, which adds up over a row


def part(world: pv.World, seconds: float = SECONDS) -> None:
    """So many seconds of a crowd, and what is promised of it."""
    fastest = 0.0
    for _ in each_frame(world, round(seconds * 60)):
        fastest = max(fastest, float(np.hypot(*np.asarray(world.velocity).T).max()))
    assert world.overlap().max < (PARTED if any(world.gravity) else PARTED_FREELY)
    assert fastest < FASTEST


@pytest.mark.parametrize("gravity", [0.0, -G])
@pytest.mark.parametrize(
    ("law", "dtype"), [({}, np.float32), ({"friction": 0.3}, np.float64), ({"restitution": 0.5}, np.float32)]
)
@pytest.mark.parametrize(("side", "growth"), [(6, 1.1), (10, 1.5), pytest.param(20, 1.25, marks=pytest.mark.slow)])
def test_circles_that_are_enlarged_in_place_part(side: int, growth: float, law: Any, dtype: Any, gravity: float) -> None:
    room: pv.Boundary = pv.Box((-40, 0), (60, 60)) if gravity else pv.Open()
    world = pv.World(gravity=(0, gravity), boundary=room, collisions=pv.Collisions(**law), dtype=dtype)
    row, column = np.divmod(np.arange(side * side), side)
    world.add(position=np.column_stack((0.8 * column, 0.8 * row + 0.5)), radius=0.4)
    world.step(1 / 60)
    world.radius[:] = 0.4 * growth
    # Without forces friction holds up hundreds: 18 such crowds of 300 to 500 overlap by 0.02 to 0.12 after two seconds, and
    # by at most 0.04 after three.
    part(world, 3.0 if side == 20 and "friction" in law and not gravity else SECONDS)
    if not gravity:  # nothing holds them together, but nothing throws them either
        assert np.ptp(world.position[:, 0]) < 1.07 * 0.8 * growth * (side - 1)


@pytest.mark.parametrize("gravity", [0.0, -G])
@pytest.mark.parametrize("spread", [0.0, 1e-3, 1.5])
def test_crowds_put_on_top_of_each_other_part(spread: float, gravity: float) -> None:
    world = pv.World(gravity=(0, gravity), boundary=pv.Box((-10, 0), (10, 20)))
    place = np.random.default_rng(0).uniform((-spread, 3 - spread), (spread, 3 + spread), (100, 2))
    world.add(position=place, radius=0.2, on_overlap="push")
    part(world)


@pytest.mark.parametrize("radius", [0.05, 0.2, 0.5])
@pytest.mark.parametrize(
    ("count", "law"), [(2, {}), (2, {"friction": 0.5}), (3, {}), (10, {}), (30, {"friction": 0.5}), (30, {"restitution": 0.9})]
)
def test_few_and_many_on_a_floor_part_however_high_the_room(count: int, law: Any, radius: float) -> None:
    # What of them is raised was bounded by 8e-5 of m g H in a frame, and who parted slowly was left alone: two had not parted
    # after three seconds, nor had thirty.
    world = pv.World(boundary=pv.Box((-5, 0), (5, 10)), collisions=pv.Collisions(**law))
    place = np.random.default_rng(0).normal((0, radius), 1e-3, (count, 2))
    world.add(position=np.maximum(place, (-5, radius)), radius=radius, on_overlap="push")
    allowed, before = rows.to_part(world), world.energy().total
    part(world)
    assert world.energy().total - before < allowed


def heap_that_is_entered(way: str, rows: int, room: float, friction: float = 0.0) -> pv.World:
    """A heap at rest into which twenty circles have just been put, or in which one has been made three times as large."""
    world = pv.World(boundary=pv.Box((-3, 0), (3, room)), collisions=pv.Collisions(friction=friction))
    world.add(position=grid(12, rows, 0.41, (-2.5, 0.3)), radius=0.2)
    world.run(seconds=4)
    if way == "added":
        world.add(position=np.full((20, 2), (0.0, 0.5)), radius=0.2, on_overlap="push")
    elif way == "moved":
        world.position[:20] = 0.0, 0.5
    else:
        world.radius[5] = 0.6
    return world


@pytest.mark.parametrize("way", ["added", "moved", "enlarged"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_who_comes_into_a_heap_parts_from_it(way: str, friction: float) -> None:
    part(heap_that_is_entered(way, rows=12, room=12, friction=friction))


@pytest.mark.parametrize("mass", [1.0, 10.0])
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("count", [100, pytest.param(300, marks=pytest.mark.slow)])
def test_crowds_without_gravity_part_from_inside_too(count: int, friction: float, mass: float) -> None:
    # A crowd parts at its rim first. Once three hundred at one place still overlapped by 12 per cent in the mean after two
    # seconds if they were rough, by 2 per cent if not: those within waited for those outside.
    random = np.random.default_rng(0)
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(friction=friction))
    place = random.uniform((-1e-3, -1e-3), (1e-3, 1e-3), (count, 2))
    world.add(position=place, radius=0.2, mass=mass ** random.random(count), on_overlap="push")
    before, fastest = world.position.copy(), 0.0
    for _ in each_frame(world, round(SECONDS * 60)):
        now = world.position.copy()
        fastest, before = max(fastest, 60 * float(np.hypot(*(now - before).T).max())), now
    assert world.overlap().mean < (0.03 if mass > 1 else 0.01 if friction else 1e-3)
    assert fastest < 10.0  # 50 radii a second
    # As wide as a dense pack of all of them, and a sixth.
    assert np.ptp(world.position, axis=0).max() < 7 / 6 * 2 * 0.2 * np.sqrt(count * 2 * np.sqrt(3) / np.pi)


def test_circles_in_each_other_part_before_they_fall_asleep() -> None:
    # Pushed out slowly, for the energy of a frame is bounded, they show no speed.
    world = pv.World(boundary=pv.Box((-5, 0), (5, 10)), sleep=True)
    world.add(position=[(0, 0.5), (0, 1.1)], radius=0.5)
    for _ in range(1200):
        world.step(1 / 60)
        if world.asleep.all():
            break
    assert world.asleep.all()
    assert world.overlap().max < 0.01
    assert world.time < 5.0  # by 8e-5 m g H a frame it takes 4 s, and 0.5 s until they sleep
