"""Category and mask of walls, obstacles and linked bodies: against worlds without what is filtered out, and by brute force."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import bits_after, each_frame, of_ones_own, points, refused, world_with

import pyverlet as pv

DT, G, R, EVERY = 1 / 60, 9.81, 0.2, 0xFFFFFFFF

OBSTACLES: dict[str, Callable[..., pv.Obstacle]] = {
    "segment": lambda **how: pv.Segment((-5, 0), (5, 0), **how),
    "chain": lambda **how: pv.Chain([(-5, 1), (0, 0), (5, 1)], radius=0.1, **how),
    "capsule": lambda **how: pv.Capsule((-5, 0), (5, 0.2), radius=0.2, **how),
    "disc": lambda **how: pv.Disc((0, -20), 20.0, **how),
    "polygon": lambda **how: pv.Polygon([(-5, -2), (5, -2), (5, 0), (-5, 0)], **how),
}
ROOMS: dict[str, Callable[..., Any]] = {
    "box": lambda **how: pv.Box((-5, 0), (5, 9), **how),
    "cage": lambda **how: pv.Circle(center=(0, 6), radius=6, **how),
    "channel": lambda **how: pv.Periodic((-5, 0), (5, 9), axes="x", **how),
}


def drop(world: pv.World, **marks: Any) -> Any:
    """Thirty discs of all sizes that fall, some of them fast and on top of each other."""
    chance = np.random.default_rng(4)
    speed = np.column_stack((chance.normal(0, 2, 30), chance.normal(0, 30, 30) - 5))
    radius = 0.04 * 5 ** chance.random(30)
    return world.add(
        position=points(np.linspace(-2.7, 2.7, 6), np.linspace(1.6, 6, 5)), radius=radius, velocity=speed, density=1.0, **marks
    )


@pytest.mark.parametrize("shape", OBSTACLES)
@pytest.mark.parametrize(
    ("dtype", "filters", "marks"),
    [
        *((np.float32, {"mask": 6}, {}), (np.float64, {"category": 8}, {"mask": 7})),
        (np.float64, {"category": 4, "mask": 2}, {"category": 2, "mask": 3}),
    ],
)
def test_an_obstacle_that_is_filtered_out_is_not_there(shape: str, dtype: Any, filters: Any, marks: Any) -> None:
    hashes = []
    for obstacles in ([OBSTACLES[shape](**filters, friction=0.3)], []):
        world = world_with(*obstacles, dtype=dtype, collisions=pv.Collisions(friction=0.3, restitution=0.5))
        drop(world, **marks)
        hashes.append(bits_after(world, 1.5))
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize("name", ROOMS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("own", [False, True])
def test_walls_that_are_filtered_out_are_not_there(name: str, dtype: Any, own: bool) -> None:
    # By the walls of the core, and by a room of a user's own whose walls are those of a library's.
    room = ROOMS[name](mask=6)
    if own:
        room = of_ones_own(room)
    world = world_with(boundary=room, dtype=dtype, collisions=None)
    free = world_with(boundary=pv.Periodic((-5, 0), (5, 9)) if name == "channel" else None, dtype=dtype, collisions=None)
    for each in (world, free):
        drop(each)
        each.run(seconds=1.5, dt=DT)
    where = world.boundary.periodic.nearest(world.position - free.position)
    where[:, 1] -= 9 * np.round(where[:, 1] / 9) if name == "channel" else 0
    assert where == pytest.approx(0.0, abs=1e-11 if dtype == np.float64 else 1e-3)
    assert np.abs(world.position[:, 1]).max() > 15
    assert world.escaped() == 0  # nobody that it holds


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
def test_two_collide_if_each_has_a_bit_in_the_others_mask(dtype: Any) -> None:
    # All pairs of some filters, by the formula; those that are held lie on the floor, and events and contacts tell of them alone.
    bits = np.array([(1, EVERY), (2, 1), (1, 2), (6, 5), (0x80000000, 0x80000001), (0, EVERY), (EVERY, 0), (4, 4)], np.uint32)
    for category, mask in bits:
        filters: dict[str, Any] = {"category": int(category), "mask": int(mask)}
        for kind in ("obstacle", "room"):
            obstacles = [pv.Segment((-5, 0), (15, 0), **filters)] if kind == "obstacle" else []
            room = pv.Box((-5, 0), (15, 9), **filters) if kind == "room" else None
            world = world_with(*obstacles, boundary=room, dtype=dtype, events=True, contacts=True)
            world.add(position=[(k, 0.5) for k in range(8)], radius=R, category=bits[:, 0], mask=bits[:, 1])
            held = ((bits[:, 0] & mask) != 0) & ((bits[:, 1] & category) != 0)
            begun: set[int] = set()
            for _ in each_frame(world, 30):
                begun |= set(world.events.begin["a"].tolist())
            assert begun == set(np.flatnonzero(held).tolist())
            assert world.position[held, 1] == pytest.approx(R, abs=1e-6)
            assert world.position[~held, 1] == pytest.approx(0.5 - G / 8, abs=1e-4)
            assert world.contacts["a"].tolist() == np.flatnonzero(held).tolist()
            assert world.contacts["impulse"] == pytest.approx(G * DT, rel=1e-4)
            what = world.obstacles[0] if obstacles else world.boundary
            assert world.force_on(what) == pytest.approx((0, -held.sum() * G), abs=1e-3)
            assert (world.is_free([(1, -1)], category=bits[1, 0], mask=bits[1, 1]) == [kind == "obstacle" or not held[1]]).all()


def test_contacts_are_told_apart_where_two_obstacles_are_at_the_same_place() -> None:
    floors = [pv.Segment((-5, 0), (5, 0), category=2**k) for k in range(3)]
    world = world_with(*floors, contacts=True, events=True)
    world.add(position=[(-1, R), (0, R), (1, R)], radius=R, mask=[1, 2, 4])
    world.run(seconds=0.5, dt=DT)
    assert [(each["a"], each["obstacle"]) for each in world.contacts] == [(0, 0), (1, 1), (2, 2)]


def test_changing_a_filter_while_it_runs() -> None:
    world = world_with(OBSTACLES["segment"](category=1), boundary=pv.Box((-9, -3), (9, 9), category=1))
    discs = world.add(position=[(-1, R), (1, R)], radius=R)
    world.run(seconds=0.5, dt=DT)
    assert discs.position[:, 1] == pytest.approx(R)
    discs.mask[0] = 2  # neither floor nor walls
    world.run(seconds=1.0, dt=DT)
    # It falls from the middle of a substep on: a contact holds for a half of it more or less.
    half = G / 2 * 1 / 480
    assert discs.position[:, 1] == pytest.approx([R - G / 2, R], abs=1.01 * half)
    world.obstacles[0].mask = 2
    world.run(seconds=2.0, dt=DT)
    assert discs.position[1, 1] == pytest.approx(-3 + R)
    world.boundary = pv.Box((-9, -3), (9, 9), category=4)
    discs.mask[1] = 1
    world.run(seconds=1.0, dt=DT)
    assert discs.position[1, 1] == pytest.approx(-3 + R - G / 2, abs=1.01 * half)


@pytest.mark.parametrize("change", ["a rule", "none collide"])
@pytest.mark.parametrize("sleep", [False, True])
def test_those_that_passed_each_other_part_when_they_collide_again(change: str, sleep: bool) -> None:
    world = world_with(boundary=pv.Box((-9, 0), (9, 9)), sleep=sleep)
    if change == "a rule":
        world.actors.append(pv.contact_rule(lambda world, new: True))
    else:
        world.collisions = None
    world.add(position=[(0, R), (1e-3, R)], radius=R, on_overlap="push")
    world.run(seconds=4.0, dt=DT)
    assert not sleep or world.asleep.all()
    assert world.position[:, 1] == pytest.approx(R, abs=1e-3)
    world.actors.clear()
    world.collisions = pv.Collisions()
    world.run(seconds=1.0, dt=DT)
    assert np.abs(np.diff(world.position[:, 0])) == pytest.approx(2 * R, abs=1e-4)


@pytest.mark.parametrize("make", ["rope", "chain", "cloth", "net", "soft_body", "bridge"])
def test_linked_bodies_have_filters(make: str) -> None:
    def built(world: pv.World, **marks: Any) -> Any:
        if make in ("cloth", "net"):
            return getattr(pv, make)(world, (-1, 3), width=2, height=1, columns=5, rows=4, **marks)
        if make == "soft_body":
            return pv.soft_body(world, pv.builders.box((-1, 1), (1, 2)), spacing=0.3, **marks)
        return getattr(pv, make)(world, (-1, 2), (1, 2), **marks)

    # Through a floor and out of a room as if they were not there; with a bit in common it lies on the floor.
    room, floor = pv.Box((-4, -1), (4, 9), category=4), pv.Segment((-4, 0), (4, 0), category=4)
    world, free = world_with(floor, boundary=room), world_with()
    for each in (world, free):
        body = built(each, category=6, mask=2)
        assert (body.group.category == 6).all()
        assert (body.group.mask == 2).all()
        body.group.mass[:] = 0.1
        each.run(seconds=1.5, dt=DT)
    assert world.position.tobytes() == free.position.tobytes()
    assert world.position[:, 1].max() < -1
    held = world_with(floor, boundary=room)
    body = built(held, category=6, mask=6)
    body.group.mass[:] = 0.1
    held.run(seconds=1.5, dt=DT)
    assert held.position[:, 1].min() > 0


def test_places_that_are_refused_depend_on_filters() -> None:
    world = world_with(pv.Disc((0, 0), 2.0, category=2), boundary=pv.Box((-5, -5), (5, 5), category=4))
    refused("inside the Disc", world.add, position=(0, 1), mask=2)
    refused("outside the room", world.add, position=(9, 0), mask=4)
    world.add(position=[(0, 1), (9, 0)], mask=1)
    assert world.position.tolist() == [[0, 1], [9, 0]]
    assert world.is_free([(0, 1), (9, 0)]).tolist() == [False, False]
    assert world.is_free([(0, 1), (9, 0)], mask=1).tolist() == [True, True]
    assert world.is_free([(0, 1), (9, 0)], mask=[4, 2]).tolist() == [True, True]


def test_what_is_thrown_far_passes_what_it_does_not_collide_with() -> None:
    # Struck at rest, it leaves so fast that it gets to lines that are in none of its contacts: see `core.surface_sides`.
    for mask, passes in ((2, True), (3, False)):
        wall = pv.Segment((1, -9), (1, 9), category=1)
        world = world_with(wall, gravity=(0, 0), substeps=1, collisions=pv.Collisions(restitution=1))
        light = world.add(position=(0.5, 0), radius=R, mass=1e-3, category=3, mask=mask)
        world.add(position=(-1.0, 0), velocity=(40, 0), radius=R, mass=1e3, category=2, mask=2)
        world.run(seconds=3 / 60)
        assert (light.position[0, 0] > 1) == passes


@pytest.mark.parametrize("value", [-1, 2**32, 1.0, "all"])
def test_what_is_no_filter_is_refused(value: Any) -> None:
    said = "allowed is a whole number from 0 to 4294967295"
    for name in ("category", "mask"):
        for make in (*OBSTACLES.values(), *ROOMS.values()):
            refused(f"{name} is .*; {said}", make, **{name: value})
        refused(said, setattr, OBSTACLES["disc"](), name, value)
