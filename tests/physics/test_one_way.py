"""One-way lines: passable in one direction, solid from the other side; against closed forms and against solid lines."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from tests.worlds import bits_after, each_frame, points, world_with

import pyverlet as pv

DT, G, R, UP = 1 / 60, 9.81, 0.2, (0.0, 1.0)

PLATFORMS: dict[str, tuple[Callable[..., pv.Obstacle], float]] = {
    "segment": (lambda **how: pv.Segment((-3, 0), (3, 0), **how), 0.0),
    "reversed": (lambda **how: pv.Segment((3, 0), (-3, 0), **how), 0.0),
    "joint": (lambda **how: pv.Chain([(-3, 0), (0, 0), (3, 0)], **how), 0.0),
    "fine": (lambda **how: pv.Chain(np.column_stack((np.linspace(-3, 3, 61), np.zeros(61))), **how), 0.0),
    "thick": (lambda **how: pv.Chain([(-3, -0.1), (0, -0.1), (3, -0.1)], radius=0.1, **how), 0.0),
    "capsule": (lambda **how: pv.Capsule((-3, -0.1), (3, -0.1), radius=0.1, **how), 0.0),
}
"""Platforms whose upper side is at y = 0, by name."""


@pytest.mark.parametrize("name", PLATFORMS)
@pytest.mark.parametrize(("dtype", "substeps"), [(np.float64, 1), (np.float32, 8), (np.float64, 16)])
def test_a_disc_lands_on_what_it_was_thrown_through_if_it_rises_high_enough(name: str, dtype: Any, substeps: int) -> None:
    # It rises by v^2 / 2g. Starting a depth d below, it gets through if v^2 / 2g > d + 2r, and lies on top in the end. Else it
    # falls back, as if nothing were there: after t it is at y0 + v t - g t^2 / 2, which velocities of order 2 have exactly.
    make, _ = PLATFORMS[name]
    world = world_with(make(one_way=UP), dtype=dtype, substeps=substeps)
    start, rise = -1.0, np.array([1.0 + R + 0.05, 1.0 + R - 0.05, 0.9, 0.5, 3.0])
    speed = np.sqrt(2 * G * rise)
    balls = world.add(position=[(-2 + k, start) for k in range(5)], velocity=np.column_stack((0 * speed, speed)), radius=R)
    top = np.full(5, -np.inf)
    frames = 70
    for _ in each_frame(world, frames):
        top = np.maximum(top, balls.position[:, 1])
    t = frames * DT
    assert top == pytest.approx(start + rise, abs=G * DT**2 / 8 + 1e-4)  # a frame may miss the top by g (dt / 2)^2 / 2
    through = np.array([True, False, False, False, True])
    assert balls.position[~through, 1] == pytest.approx((start + speed * t - G * t * t / 2)[~through], abs=1e-4)
    world.run(seconds=1.0, dt=DT)
    assert balls.position[through, 1] == pytest.approx(R, abs=1e-6)
    assert balls.velocity[through] == pytest.approx(0.0, abs=1e-6)
    assert (balls.position[~through, 1] < -8).all()


@pytest.mark.parametrize("name", PLATFORMS)
@pytest.mark.parametrize("speed", [5.0, 1000.0])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_without_gravity_nothing_is_felt_from_below_and_all_from_above(name: str, speed: float, dtype: Any) -> None:
    make, _ = PLATFORMS[name]
    world = world_with(make(one_way=UP, restitution=1.0), gravity=(0, 0), dtype=dtype, substeps=4)
    free = world_with(gravity=(0, 0), dtype=dtype, substeps=4)
    for each in (world, free):
        each.add(position=[(0.1, -2), (1.3, -4)], velocity=[(0, speed), (-1, speed)], radius=R)
    down = world.add(position=(2.0, 2.0), velocity=(0, -speed), radius=R)
    for each in (world, free):
        each.run(seconds=8 / speed + 2 * DT, dt=DT)
    assert world.position[:2].tobytes() == free.position.tobytes()
    assert world.velocity[:2].tobytes() == free.velocity.tobytes()
    assert down.velocity[0] == pytest.approx((0, speed), rel=1e-6)  # elastic
    assert down.position[0, 1] > R


@pytest.mark.parametrize("depth", [-0.15, -0.05, 0.05, 0.15])
def test_what_begins_on_a_line_passes(depth: float) -> None:
    world, free = world_with(PLATFORMS["joint"][0](one_way=UP)), world_with()
    for each in (world, free):
        each.add(position=[(0.05, depth), (1.0, depth)], radius=R)
        each.run(seconds=1.0, dt=DT)
    assert world.state_hash() == free.state_hash()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_is_put_on_it_a_little_too_deep_lies_on_it(dtype: Any) -> None:
    world = world_with(PLATFORMS["joint"][0](one_way=UP), dtype=dtype)
    discs = world.add(position=[(-1.0, 0.92 * R), (0.0, R), (1.0, 0.999 * R)], radius=R)
    world.run(seconds=1.0, dt=DT)
    assert discs.position[:, 1] == pytest.approx(R, abs=1e-6)


@pytest.mark.parametrize("steep", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_disc_rolls_over_a_ridge_as_over_a_solid_one(steep: float, order: int, dtype: Any) -> None:
    # Up one slope, over its corner and down the other one, whichever of the two the corner belongs to.
    hashes = []
    for way in (None, UP):
        ridge = pv.Chain([(-4, -4 * steep), (0, 0), (4, -4 * steep)][::order], one_way=way, friction=0.5)
        world = world_with(ridge, dtype=dtype)
        out, along = np.array([-steep, 1]) / np.hypot(steep, 1), np.array([1, steep]) / np.hypot(steep, 1)
        world.add(position=-1.0 * along + 1.001 * R * out, velocity=1.02 * np.sqrt(2 * G * (steep + 1.2 * R)) * along, radius=R)
        world.run(seconds=0.9, dt=DT)
        assert world.position[0, 0] > 0
        hashes.append(world.state_hash())
    assert hashes[0] == hashes[1]


@pytest.mark.parametrize("motion", [{"velocity": (0, 2)}, {"velocity": (0.5, -1)}, {"velocity": (0, 30)}])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_lift_carries_what_is_on_it_and_passes_what_is_not(motion: dict[str, Any], dtype: Any) -> None:
    hashes, moves = [], np.array(motion["velocity"], float)
    for way in (None, UP):
        lift = pv.Segment((-2, 0), (2, 0), one_way=way, friction=1.0, **motion)
        world = world_with(lift, dtype=dtype)
        world.add(position=(0, R), velocity=moves, radius=R)
        hashes.append(bits_after(world, 0.5))
    assert hashes[0] == hashes[1]
    assert world.position[0] == pytest.approx(0.5 * moves + (0, R), abs=1e-4)
    # A platform that comes down over a disc at rest goes by: seen from it, the disc rises.
    sinking, free = (
        world_with(pv.Segment((-2, 2), (2, 2), one_way=UP, velocity=(0, -8)), gravity=(0, 0)),
        world_with(gravity=(0, 0)),
    )
    for each in (sinking, free):
        each.add(position=(0, 0), radius=R)
        each.run(seconds=1.0, dt=DT)
    assert sinking.state_hash() == free.state_hash()


def test_the_direction_turns_with_the_obstacle() -> None:
    # Turned by half a turn, a floor for what comes from above is one for what comes from below.
    world = world_with(pv.Segment((-3, 0), (3, 0), one_way=UP), gravity=(0, 0))
    (line,) = world.obstacles
    line.angle = np.pi
    balls = world.add(position=[(-1, -2), (1, 2)], velocity=[(0, 5), (0, -5)], radius=R)
    world.run(seconds=1.0, dt=DT)
    assert balls.position[0, 1] == pytest.approx(-R, abs=1e-6)
    assert balls.position[1, 1] == pytest.approx(-3, abs=1e-6)


def test_it_is_drawn_with_an_arrow_that_turns_with_it() -> None:
    line = pv.Segment((-3, 0), (3, 0), one_way=(0, 2))
    for angle, way in ((0.0, (0, 1)), (np.pi / 2, (-1, 0))):
        line.angle = angle
        body, arrow = line.drawn()
        assert np.array_equal(body.points, line.points)
        head = arrow.points[1] - 0.5 * (arrow.points[0] + arrow.points[2])
        assert head / np.hypot(*head) == pytest.approx(way)


def test_any_direction_of_gravity_and_a_periodic_room() -> None:
    # The platform lies across the periodic boundary of a room, and gravity points to the right.
    room = pv.Periodic((0, 0), (10, 10), axes="y")
    world = world_with(pv.Segment((6, 8), (6, 12), one_way=(-1, 0)), gravity=(G, 0), boundary=room)
    balls = world.add(position=[(5.0, 9.5), (4.0, 0.5), (8.0, 0.1)], velocity=[(0, -0.1), (0, -0.1), (-8, -0.1)], radius=R)
    world.run(seconds=3.0, dt=DT)
    assert balls.position[:, 0] == pytest.approx(6 - R, abs=1e-6)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_is_thrown_far_beyond_what_it_saw_passes_upwards_only(dtype: Any) -> None:
    # A light disc at rest is struck by a heavy one, and leaves with twice its speed, 1.3 m a substep.
    for sign in (1, -1):
        law = pv.Collisions(restitution=1)
        world = world_with(pv.Segment((-9, 0), (9, 0), one_way=UP), gravity=(0, 0), substeps=1, collisions=law, dtype=dtype)
        light = world.add(position=(0, -sign * 0.5), radius=R, mass=1e-3)
        world.add(position=(0, -sign * 1.4), velocity=(0, sign * 40), radius=R, mass=1e3)
        for _ in each_frame(world, 3):
            assert sign > 0 or light.position[0, 1] > 0
        assert sign < 0 or light.position[0, 1] > 2


def test_sleepers_stay_on_it_and_wake_on_it() -> None:
    walls = [pv.Segment((x, -0.5), (x, 9), friction=0.3) for x in (-2.5, 2.5)]
    line = pv.Segment((-3, 0), (3, 0), one_way=UP, friction=0.4)
    world = world_with(line, *walls, collisions=pv.Collisions(restitution=0.2, friction=0.4), sleep=True)
    radius = 0.02 * 10 ** np.random.default_rng(3).random(72)
    world.add(position=points(np.linspace(-2.1, 2.1, 9), 0.5 + 0.5 * np.arange(8)), radius=radius, density=1.0)
    world.run(seconds=12.0, dt=DT)
    assert world.asleep.all()
    world.add(position=(0, 4), radius=0.3, density=1.0)
    world.run(seconds=3.0, dt=DT)
    assert world.position[:, 1].min() > 0
    world.obstacles[0].one_way = (0, -1)  # now they are beyond it on the wrong side
    world.run(seconds=2.0, dt=DT)
    assert not world.asleep.any()
    assert (world.position[:, 1] < 0).all()


@pytest.mark.parametrize("seed", [0, 1, 3, 4, *(pytest.param(each, marks=pytest.mark.slow) for each in (2, 5))])
def test_on_jagged_ground_all_have_the_bits_of_solid_ground(seed: int) -> None:
    # Sharp summits and clefts, masses of 1:1000, fast discs, links: what comes from above cannot tell, nor whether sensors watch.
    chance = np.random.default_rng(seed)
    corners = np.column_stack((np.linspace(-6, 6, 15 + 3 * seed), chance.normal(0, 0.3, 15 + 3 * seed)))
    law, dtype, hashes = pv.Collisions(friction=0.3, restitution=0.3), (np.float32, np.float64)[seed % 2], []
    dt, substeps = ((1 / 60, 4), (1 / 20, 4), (1 / 60, 1))[seed // 2]
    for way, watched in ((None, False), (UP, False), (UP, True)):
        ground = pv.Chain(corners, one_way=way, friction=0.3)
        watch = [pv.Segment((-6, k), (6, k), sensor=True, velocity=(0, 0.3 * k)) for k in range(3 * watched)]
        room = pv.Box((-6, -30), (6, 40))
        world = world_with(*watch, ground, dtype=dtype, collisions=law, boundary=room, substeps=substeps, events=True)
        again = np.random.default_rng(seed + 100)
        world.add(
            position=points(np.linspace(-5.3, 5.3, 9), 2.0 + 0.75 * np.arange(6)), radius=0.05 * 6 ** again.random(54),
            mass=1000 ** again.random(54), velocity=again.normal(0, 3, (54, 2)),
        )  # fmt: skip
        if seed % 3 == 0:
            pv.soft_body(world, pv.builders.box((-1, 10), (1, 11)), spacing=0.4)
            pv.chain(world, (-3, 10), (-2, 11), links=8)
        hashes.append(bits_after(world, 1.5, dt=dt))
        assert world.position[:, 1].min() > -1
    assert hashes[0] == hashes[1] == hashes[2]


def test_a_disc_may_be_added_inside_a_thick_one() -> None:
    world = world_with(pv.Capsule((-3, 0), (3, 0), radius=0.5, one_way=UP))
    assert world.is_free((0, 0)).all()
    world.add(position=(0, 0), radius=R)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("passing", [(), (6,), (6, 7), (5, 8, 11)])
def test_a_line_that_lets_a_rolling_disc_pass_for_a_moment_takes_no_more_of_its_roll(
    passing: tuple[int, ...], dtype: Any
) -> None:
    # Rolling resistance takes dv = -(2/3) c J of a disc that rolls, J being the normal impulse over its mass. Lying
    # on the line before and after, J = g t, whether or not the line let it fall for some frames and caught it again,
    # as long as it is caught too slowly to bounce.
    c, h = 0.3, 1 / 960
    line = pv.Segment((-9, 0), (9, 0), one_way=UP, friction=1.0, rolling_resistance=c)
    world = world_with(line, dtype=dtype, substeps=1)
    disc = world.add(position=[(0, R)], velocity=[(1, 0)], spin=[-1 / R], radius=R)
    frames = 20
    for frame in range(frames):
        line.one_way = (0.0, -1.0) if frame in passing else UP
        world.step(h)
    speed = 1 - 2 / 3 * c * G * frames * h
    assert disc.velocity == pytest.approx(np.array([[speed, 0]]), abs=20 * frames * float(np.finfo(dtype).eps))
    assert disc.spin == pytest.approx(-speed / R, abs=20 * frames * float(np.finfo(dtype).eps) / R)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_events_change_nothing(seed: int) -> None:
    # Discs fly about among three lines that turn; some are inside a line when a frame ends, and which way they came is kept.
    def run(*, events: bool) -> str:
        rng = np.random.default_rng(seed)
        world = world_with(boundary=pv.Box((-6, -6), (6, 6), restitution=0.5), events=events)
        for ends in rng.uniform(-6, 6, (3, 2, 2)):
            world.obstacles.append(pv.Segment(*ends, one_way=tuple(rng.normal(size=2)), angular_velocity=0.5))
        world.add(position=rng.uniform(-5, 5, (40, 2)), velocity=rng.normal(0, 5, (40, 2)), radius=0.3, on_overlap="push")
        return bits_after(world, 1.0)

    assert run(events=True) == run(events=False)
