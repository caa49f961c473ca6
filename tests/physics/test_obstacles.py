"""Obstacles: exact bounces, no leaks at any speed, belts and moving walls, against closed forms."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from tests.worlds import FRAME, each_frame, points, refused, world_with

import pyverlet as pv

H = FRAME / 8
R = 0.25


def inside(points: Any, position: Any) -> Any:
    """Even-odd rule, in NumPy."""
    a, b = points, np.roll(points, -1, axis=0)
    x, y = position[:, 0, None], position[:, 1, None]
    crosses = ((a[:, 1] <= y) != (b[:, 1] <= y)) & (
        x < a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1] + 1e-300) * (b[:, 0] - a[:, 0])
    )
    return crosses.sum(axis=1) % 2 == 1


@pytest.mark.parametrize("e", [0.0, 1.0])
@pytest.mark.parametrize("radii_a_substep", [0.3, 5, 100])
def test_a_closed_chain_is_a_closed_room(radii_a_substep: float, e: float) -> None:
    # A star with points as sharp as 30 degrees, pinned at no side by a boundary: whoever leaves is gone.
    rng = np.random.default_rng(1)
    angle = np.arange(14) * np.pi / 7
    size = np.where(np.arange(14) % 2, 4.0, 9.0)
    room = np.column_stack((size * np.cos(angle), size * np.sin(angle)))
    world = world_with(pv.Chain(room, closed=True, restitution=e, friction=0.2), dtype=np.float32)
    heading = rng.uniform(0, 2 * np.pi, 60)
    speed = radii_a_substep * 0.1 / H
    centres = np.column_stack([g.ravel() for g in np.meshgrid(np.linspace(-2, 2, 10), np.linspace(-1.5, 1.5, 6))])
    grains = world.add(position=centres, radius=0.1, velocity=speed * np.column_stack((np.cos(heading), np.sin(heading))))
    for _ in each_frame(world, 60):
        assert inside(room, grains.position).all()
    assert np.isfinite(world.energy().total)


def test_a_heap_does_not_leak_through_the_joints_of_a_hopper() -> None:
    # Thin walls of many short segments carry a pile of small grains with heavy ones on top.
    t = np.linspace(-1, 1, 41)
    wall = np.concatenate(([(-6, 40)], np.column_stack((6 * t, 5 * t * t)), [(6, 40)]))
    world = world_with(pv.Chain(wall), dtype=np.float32)
    world.add(position=points(np.arange(-4, 4, 0.42), np.arange(4.5, 9, 0.42)), radius=0.2, mass=0.1)
    world.add(position=[(-2, 11), (2, 11)], radius=1.0, mass=20.0)
    start = world.energy().total
    world.run(seconds=20, dt=FRAME)  # nothing rubs: for so long the heavy ones sink and the heap sloshes
    assert (np.abs(world.position[:, 0]) < 6).all()
    assert (world.position[:, 1] > 5 * (world.position[:, 0] / 6) ** 2).all()
    # When the heavy ones find their way down is luck, and stirs the heap: of the energy that has gone, some per cent at most.
    assert world.energy().kinetic < 0.05 * (start - world.energy().total)


@settings(max_examples=30, deadline=None)
@given(
    x=st.floats(-3, 3), slope=st.floats(-0.5, 0.5), speed=st.floats(0.1, 300), across=st.floats(-30, 30),
    radius=st.floats(0.05, 0.6),
)  # fmt: skip
def test_a_single_wall_stops_whoever_comes(x: float, slope: float, speed: float, across: float, radius: float) -> None:
    world = world_with(pv.Segment((-9, -9 * slope), (9, 9 * slope), restitution=0.3), gravity=(0, 0), collisions=None)
    ball = world.add(position=(x, slope * x + 1.5), velocity=(across, -speed), radius=radius)
    for _ in each_frame(world, 12):
        x, y = ball.position[0]
        if abs(x) > 9:
            break
        # The distance from the line is never less than the radius.
        assert (y - slope * x) / np.hypot(1, slope) > radius * (1 - 1e-6)


def test_who_is_inside_a_polygon_is_let_out_by_the_nearest_face() -> None:
    block = pv.Polygon([(-10, 0), (10, 0), (10, 8), (-10, 8)])
    world = world_with(block, gravity=(0, 0))
    balls = world.add(position=[(0, 5), (9, 4), (-2, 1)], radius=R, on_overlap="push")
    world.step(FRAME)
    assert balls.position == pytest.approx(np.array([(0, 8 + R), (10 + R, 4), (-2, -R)]), abs=1e-9)
    assert np.hypot(*balls.velocity.T).max() < 1e-9


def test_thin_planks_do_not_pull() -> None:
    # Thinner than the ball: the lower face is within reach too, but the ball is not inside.
    world = world_with(pv.Polygon([(-5, -0.1), (5, -0.1), (5, 0), (-5, 0)]))
    ball = world.add(position=(0, 0.8), radius=0.5)
    world.run(seconds=2, dt=FRAME)
    assert ball.position[0] == pytest.approx([0, 0.5], abs=1e-9)


@pytest.mark.parametrize("speed", [1.0, 30.0, 400.0])
def test_an_elastic_wall_that_moves_gives_twice_its_speed(speed: float) -> None:
    # v' = 2 u - v, also when the wall passes 3 radii in a substep.
    world = world_with(pv.Segment((-10, -3), (-10, 3), restitution=1.0, velocity=(speed, 0)), gravity=(0, 0))
    ball = world.add(position=(0, 0), velocity=(-2, 0), radius=R)
    while ball.velocity[0, 0] < 0:
        world.step(FRAME)
        assert world.time < 10
    assert ball.velocity[0] == pytest.approx([2 * speed + 2, 0], rel=1e-9)
    assert world.obstacles[0].points[0] == pytest.approx([-10 + speed * world.time, -3])


def test_a_belt_takes_along() -> None:
    # A disc laid on a belt of speed u ends rolling at u / 3: m v = J and I w = J r share the impulse, v + w r = u, I = m r^2 / 2.
    for belt in (
        pv.Segment((-50, 0), (50, 0), surface_speed=3.0, friction=0.4),
        pv.Capsule((-50, -1), (50, -1), radius=1.0, surface_speed=-3.0, friction=0.4),  # clockwise: to the right on top
        pv.Polygon([(-50, -1), (50, -1), (50, 0), (-50, 0)], surface_speed=-3.0, friction=0.4),
    ):
        world = world_with(belt)
        ball = world.add(position=(0, R), radius=R)
        world.step(FRAME)
        assert ball.velocity[0, 0] == pytest.approx(0.4 * 9.81 * FRAME, abs=0.4 * 9.81 * H)  # slipping: a = mu g
        world.run(seconds=3, dt=FRAME)
        assert ball.velocity[0] == pytest.approx([1, 0], abs=1e-9)
        assert ball.spin[0] == pytest.approx((3.0 - 1.0) / R, rel=1e-9)


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_the_ends_and_corners_of_a_smooth_belt_push_nobody(e: float) -> None:
    # Without friction a belt of any speed is a wall at rest: v' = -e v at its ends, and nothing moves what lies on its corners.
    belt = pv.Segment((0, 0), (5, 0), surface_speed=20.0, restitution=e)
    world = world_with(belt, gravity=(0, 0))
    discs = world.add(position=[(-2 * R, 0), (5 + 2 * R, 0)], radius=R, velocity=[(0.3, 0), (-0.3, 0)])
    world.run(seconds=2)
    assert discs.velocity == pytest.approx(np.array([(-0.3 * e, 0), (0.3 * e, 0)]), abs=1e-9)
    for speed in (-20.0, 20.0):
        world = world_with(pv.Chain([(-3, -1), (0, 0), (3, -1)], surface_speed=speed, restitution=e))
        disc = world.add(position=(0, R), radius=R)
        world.step(FRAME)
        assert disc.velocity[0] == pytest.approx([0, 0], abs=1e-6)


@pytest.mark.parametrize("bend", [0.5, 1.5, 2.5])
@pytest.mark.parametrize("speed", [-20.0, 20.0])
def test_a_belt_carries_around_its_joints(bend: float, speed: float) -> None:
    # On the outer side of a joint, all over the circle about it, a disc that slips gets mu g t along the belt in a frame.
    half = 0.5 * bend
    ends = 5 * np.array([(-np.cos(half), -np.sin(half)), (np.cos(half), -np.sin(half))])
    for angle in (-0.9 * half, 0.0, 0.9 * half):  # of the normal, from that of the middle
        away = np.array([np.sin(angle), np.cos(angle)])
        chain = pv.Chain([ends[0], (0, 0), ends[1]], surface_speed=speed, friction=0.4)
        world = world_with(chain, gravity=tuple(-9.81 * away))
        disc = world.add(position=R * away, radius=R)
        world.step(FRAME)
        along = np.sign(speed) * np.array([away[1], -away[0]])
        assert disc.velocity[0] == pytest.approx(0.4 * 9.81 * FRAME * along, abs=1e-3)


@pytest.mark.parametrize(
    "ridge",
    [
        pv.Chain([(-3, -1), (0, 0), (3, -1)]),
        pv.Chain([(3, -1), (0, 0), (-3, -1)]),
        pv.Polygon([(-3, -1), (3, -1), (0, 0)]),
        pv.Chain([(-3, -1), (0, 0), (3, -1)], radius=0.1),
    ],
)
@pytest.mark.parametrize("speed", [-1.0, 1.0])
def test_nothing_hops_where_it_leaves_a_joint(ridge: pv.Obstacle, speed: float) -> None:
    # It slides around the joint and down either side, in touch all the time: v^2 = v_0^2 + 2 g times the way down.
    reach = R + getattr(ridge, "radius", 0.0)
    world = world_with(ridge)
    disc = world.add(position=(0, reach), radius=R, velocity=(speed, 0))
    for _ in each_frame(world, 30):
        (x, y), v = disc.position[0], disc.velocity[0]
        on_face = abs(x) > reach / np.sqrt(10)
        gap = (3 * y + abs(x)) / np.sqrt(10) - reach if on_face else np.hypot(x, y) - reach
        assert gap == pytest.approx(0, abs=1e-4)
        assert v @ v == pytest.approx(speed**2 + 2 * 9.81 * (reach - y), rel=0.02)


@pytest.mark.parametrize(
    "obstacle", [pv.Disc((0, 0), 1.0, angular_velocity=20.0), pv.Capsule((0, -3), (0, 0), radius=1.0, surface_speed=20.0)]
)
def test_round_surfaces_that_run_carry_as_those_at_rest(obstacle: pv.Obstacle) -> None:
    # m g, whatever runs below without friction: a path bends with the shape, which does not move.
    world = world_with(obstacle, contacts=True)
    disc = world.add(position=(0, 1 + R), radius=R)
    for _ in each_frame(world, 6):
        assert world.force_on(obstacle) == pytest.approx([0, -9.81], abs=1e-9)
    assert disc.position[0] == pytest.approx([0, 1 + R], abs=1e-9)
    world = pv.World(boundary=pv.Circle(radius=2, angular_velocity=10.0), contacts=True, dtype=np.float64)
    disc = world.add(position=(0, R - 2), radius=R)
    world.run(seconds=0.1)
    assert world.force_on(world.boundary) == pytest.approx([0, -9.81], abs=1e-9)
    assert disc.position[0] == pytest.approx([0, R - 2], abs=1e-9)


def test_changes_are_noticed() -> None:
    floor = pv.Segment((-5, 0), (5, 0))
    world = world_with(floor)
    ball = world.add(position=(0, 1), radius=R)
    world.run(seconds=1)
    assert ball.velocity[0, 1] == pytest.approx(0)
    ball.position = (0, 1)
    floor.restitution = 1.0
    world.run(seconds=1)
    assert world.energy().total == pytest.approx(9.81, abs=(9.81 * H) ** 2)  # it lay there with up to g h
    ball.radius = 0.5  # a larger one has a larger reach
    world.run(seconds=5)
    assert ball.position[0, 1] >= 0.5 - 1e-9


def test_outlines() -> None:
    world = world_with(pv.Segment((0, 0), (1, 0)), pv.Disc((3, 3), 2.0), pv.Polygon([(0, 0), (2, 0), (0, 2)], radius=0.5))
    line, disc, rounded = world.obstacles.outlines()
    assert line.points.tolist() == [[0, 0], [1, 0]]
    assert not line.filled
    assert disc.filled
    assert np.hypot(*(disc.points - (3, 3)).T) == pytest.approx(np.full(len(disc.points), 2.0))
    assert rounded.points.min(axis=0) == pytest.approx([-0.5, -0.5])


def test_an_obstacle_that_flies_off_the_end_of_all_numbers_is_named() -> None:
    world = pv.World()
    world.add(position=(0, 0))
    world.obstacles += [pv.Segment((-5, -5), (5, -5)), pv.Disc((3, 3), 1, velocity=(1e300, 0))]
    refused(r"obstacles\[1\] is farther away than numbers reach", world.step, 1e9)
    assert world.frames == 0


def test_who_asks_before_the_first_frame_changes_no_bit() -> None:
    # A moving obstacle drives its world from the first frame on, whether or not somebody has asked where it is.
    hashes = set()
    for asks in (False, True):
        world = pv.World()
        circles = world.add(position=np.random.default_rng(253).uniform(-6.9, 6.9, (7, 2)))
        world.links.append(pv.Spring(circles, range(6), range(1, 7), stiffness=1.43))
        world.obstacles += [pv.Disc((3.58, 3.01), 1.72), pv.Segment((3.06, 2.16), (-4.7, -4.26), velocity=(-0.413, 0.793))]
        if asks:
            world.is_free((0.0, 0.0))
        world.step(1 / 60)
        hashes.add(world.state_hash())
    assert len(hashes) == 1


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("turning", [1.0, -10.0, 100.0])
@pytest.mark.parametrize("place", [(0.3, 2.5), (0.0, 2.5), (-0.7, 2.5)])
def test_a_smooth_disc_throws_back_as_if_it_did_not_turn(place: tuple[float, float], turning: float, dtype: Any) -> None:
    # v' = v - 2 (v . n) n, with the normal n where the centre is as far from that of the disc as both radii.
    world = pv.World(gravity=(0, 0), dtype=dtype)
    world.obstacles.append(pv.Disc((0, 0), 1.0, angular_velocity=turning, restitution=1))
    ball = world.add(position=place, velocity=(0, -3), radius=0.2)
    world.run(seconds=1.0)
    across = place[0] / 1.2
    n = np.array((across, np.sqrt(1 - across**2)))
    assert ball.velocity[0] == pytest.approx(np.array((0, -3)) + 6 * n[1] * n, abs=20 * float(np.finfo(dtype).eps) * 3 * 480)


def test_a_disc_that_turns_about_a_point_outside_it_throws_back_as_it_moves() -> None:
    # Its centre is on a circle of radius a = 0.5 m: the impact is when it and the ball are as far apart as both radii, and
    # v' = v - 2 ((v - u) . n) n with the velocity u of the point of contact, of which only that of the centre is along n.
    a, w, start, v = 0.5, 3.0, np.array((0.3, 2.5)), np.array((0.0, -3.0))
    world = pv.World(gravity=(0, 0), dtype=np.float64)
    world.obstacles.append(pv.Disc((a, 0), 0.5, angular_velocity=w, pivot=(0, 0), restitution=1))
    ball = world.add(position=start, velocity=v, radius=0.2)
    world.run(seconds=1.0)

    def way(t: float) -> Any:
        return start + v * t - a * np.array((np.cos(w * t), np.sin(w * t)))

    t = brentq(lambda t: np.hypot(*way(t)) - 0.7, 0.3, 0.55, xtol=1e-15)
    n, u = way(t) / 0.7, a * w * np.array((-np.sin(w * t), np.cos(w * t)))
    assert ball.velocity[0] == pytest.approx(v - 2 * ((v - u) @ n) * n, abs=1e-6)  # (w h)^3
