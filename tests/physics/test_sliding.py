"""Discs that slide on obstacles, rest in their corners and are pushed against the wall: in float32 too, far from the origin."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from tests.worlds import each_frame, points, refused

import pyverlet as pv

pytestmark = pytest.mark.filterwarnings("ignore::pyverlet.CoarseCoordinatesWarning")  # so far away on purpose

G, DT = 9.81, 1 / 60
PLACES = [(100, 0.1), (100, 0.01), (100, 0.001)]
"""|coordinate| and radius, m: up to 1e5 radii."""


def along(position: Any, direction: Any) -> float:
    return float(np.asarray(position, float) @ direction)


@pytest.mark.parametrize("substeps", [1, 8, 32])
@pytest.mark.parametrize(("far", "radius"), [*PLACES, (1000, 0.01)])
@pytest.mark.parametrize(("pieces", "steep"), [(1, 0.2), (1600, 0.2), (16, 1.0), (16, 3.0)])
def test_a_disc_slides_down_a_ramp_as_on_paper(far: float, radius: float, pieces: int, steep: float, substeps: int) -> None:
    # s = a t^2 / 2 and v = a t, a = g sin(slope): without friction nothing else acts along the ramp.
    slope, seconds = np.arctan(steep), 2.0
    way, normal = np.array([np.cos(slope), -np.sin(slope)]), np.array([np.sin(slope), np.cos(slope)])
    world = pv.World(substeps=substeps, threads=1)
    world.obstacles.append(pv.Chain(far + np.linspace(-20, 20, pieces + 1)[:, None] * way))
    disc = world.add(position=far - 15 * way + radius * normal, radius=radius)
    start = disc.position[0].copy()
    world.run(seconds=seconds, dt=DT)
    a = G * np.sin(slope)
    # Each substep rounds the way by half of what coordinates are spaced by: 3e-5 of 1 cm at 1 km, often to the same side.
    rounding = float(np.finfo(np.float32).eps) * far
    missed = 0.25 * rounding * substeps * seconds / DT
    assert along(disc.position[0].astype(float) - start, way) == pytest.approx(0.5 * a * seconds**2, rel=1e-3, abs=missed)
    assert along(disc.velocity[0], way) == pytest.approx(a * seconds, rel=1e-3)
    # It lies on the ramp: nearer than what its coordinates are rounded by, and what it falls before that is seen.
    assert along(disc.position[0].astype(float) - far, normal) == pytest.approx(radius, abs=2 * rounding)


@pytest.mark.parametrize("substeps", [1, 8, 32])
@pytest.mark.parametrize(("far", "radius"), PLACES)
@pytest.mark.parametrize("inside", [True, False])
def test_a_disc_slides_along_an_arc_of_1600_segments_as_on_paper(inside: bool, far: float, radius: float, substeps: int) -> None:
    # A pendulum of length R -+ r, upside down on the outside: angle'' = -+ g / L sin(angle). Each joint takes 1 - cos of its
    # angle from the speed of who rolls over it inwards: 1.6e-3 rad, 1e-6 a joint.
    size, seconds = 10.0, 1.0
    length, sign = (size - radius, 1.0) if inside else (size + radius, -1.0)
    first = -1.0 if inside else 0.3
    t = np.linspace(-1.3, 1.3, 1601)
    arc = far + size * np.column_stack((np.sin(t), -sign * np.cos(t)))
    world = pv.World(substeps=substeps, threads=1)
    world.obstacles.append(pv.Chain(arc))
    disc = world.add(position=far + length * np.array([np.sin(first), -sign * np.cos(first)]), radius=radius)
    world.run(seconds=seconds, dt=DT)
    paper = solve_ivp(lambda _, y: [y[1], -sign * G / length * np.sin(y[0])], (0, seconds), [first, 0], rtol=1e-9, atol=1e-12)
    # A substep of 1/60 s crosses seven joints inwards at once: their angles add up, and 1 - cos of half the sum is lost.
    rel = 2e-3 if inside and substeps == 1 else 1e-3
    angle, turn = paper.y[:, -1]
    x, y = disc.position[0].astype(float) - far
    now = np.arctan2(x, -sign * y)
    assert now - first == pytest.approx(angle - first, rel=1e-3)
    assert along(disc.velocity[0], [np.cos(now), sign * np.sin(now)]) == pytest.approx(length * turn, rel=rel)
    assert np.hypot(x, y) == pytest.approx(length, rel=1e-4)


def test_many_joints_in_one_substep_take_no_way() -> None:
    # A straight chain of 1600 segments of a quarter of a radius, crossed at 70 of them in a substep, is a straight line.
    x = np.linspace(0, 80, 1601)
    world = pv.World(dtype=np.float64, substeps=1, threads=1)
    world.obstacles.append(pv.Chain(np.column_stack((x, 0.1 * x))))
    way = np.array([1, 0.1]) / np.hypot(1, 0.1)
    disc = world.add(position=0.2 * np.array([-way[1], way[0]]) + 70 * way, velocity=-200 * way, radius=0.2)
    start = disc.position[0].copy()
    world.run(seconds=0.2, dt=DT)
    seconds, a = world.time, -G * way[1]
    assert along(disc.position[0] - start, way) == pytest.approx(-200 * seconds + 0.5 * a * seconds**2, rel=1e-9)
    assert along(disc.velocity[0], way) == pytest.approx(-200 + a * seconds, rel=1e-9)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("half", [80, 60, 45, 30, 8, 4, 2])
def test_a_disc_at_rest_in_a_corner_has_no_velocity(half: float, dtype: type) -> None:
    a = np.deg2rad(half)
    side = 6 * np.array([np.sin(a), np.cos(a)])
    world = pv.World(dtype=dtype, threads=1)
    world.obstacles.append(pv.Chain(np.array([side * [-1, 1], 0 * side, side])))
    # It touches both sides where its centre is r / sin(a) above the corner.
    disc = world.add(position=(0.01, 0.2 / np.sin(a) + 0.1), radius=0.2)
    world.run(seconds=5, dt=DT)
    # A substep of gravity is what no rest can be told from; and how far it goes with that in a few of them.
    h = DT / 8
    assert np.hypot(*disc.velocity[0]) < G * h
    assert disc.position[0, 0] == pytest.approx(0, abs=8 * G * h * h)
    assert disc.position[0, 1] == pytest.approx(0.2 / np.sin(a), abs=8 * G * h * h)
    if half <= 60:  # 2 degrees: single precision leaves what the sides do not agree on
        assert world.energy().kinetic < (1e-8 if half == 2 else 1e-9)
    world.obstacles.clear()
    world.run(seconds=0.5, dt=DT)
    # Half a substep late: on a wall v belongs to the time of x, while falling to half a substep before.
    assert disc.velocity[0, 1] == pytest.approx(-G * 0.5, abs=2 * G * h)


@pytest.mark.parametrize("room", [pv.Box((0, -1), (9, 9)), pv.Circle(radius=5)])
def test_a_disc_rests_between_an_obstacle_and_the_wall(room: pv.Boundary) -> None:
    world = pv.World(boundary=room, threads=1)
    steep = pv.Segment((0.05, 0), (1.0, 4)) if isinstance(room, pv.Box) else pv.Segment((4.3, -2.2), (4.4, 1))
    world.obstacles.append(steep)
    disc = world.add(position=(0.4, 3.0) if isinstance(room, pv.Box) else (4.5, 1.3), radius=0.15)
    world.run(seconds=4, dt=DT)
    assert world.energy().kinetic < 1e-6
    held = disc.position[0].copy()
    world.run(seconds=1, dt=DT)
    assert disc.position[0] == pytest.approx(held, abs=1e-5)
    assert not world.escaped()


def test_a_disc_between_parallel_lines_that_are_too_near_slides_in_the_middle() -> None:
    world = pv.World(gravity=(1, 0), dtype=np.float64, threads=1)
    world.obstacles += [pv.Segment((-9, -0.19), (90, -0.19)), pv.Segment((-9, 0.19), (90, 0.19))]
    disc = world.add(position=(0, 0.003), radius=0.2)
    world.run(seconds=2, dt=DT)
    assert disc.position[0] == pytest.approx([2, 0], abs=1e-9)  # a t^2 / 2
    assert disc.velocity[0] == pytest.approx([2, 0], abs=1e-9)


def beyond(world: pv.World) -> float:
    """How far the rim that stands out most is beyond the wall, in radii."""
    x, r, room = world.position.astype(float), world.radius.astype(float), world.boundary
    if isinstance(room, pv.Circle):
        return float(((np.hypot(*(x - room.center).T) + r - room.radius) / r).max())
    assert isinstance(room, pv.Box)
    low, high = np.asarray(room.lower) - x, x - np.asarray(room.upper)
    return float(((np.maximum(low, high).max(axis=1) + r) / r).max())


def closing_in(e: float, speed: float = 1.0) -> list[pv.Obstacle]:
    """Obstacles that come from all sides of a room of 10 m and leave wedges that close, some through each other."""
    return [
        pv.Segment((-7, -8), (7, -7), velocity=(0, 3 * speed), restitution=e),
        pv.Polygon([(-9, -2), (-6, -2), (-6, 2), (-9, 2)], velocity=(4 * speed, 0), angular_velocity=speed, restitution=e),
        pv.Capsule((0, 0), (4, 0), radius=0.3, angular_velocity=-6 * speed, restitution=e),
        pv.Disc((0, 9), 1.5, velocity=(0, -5 * speed)),
    ]


SELDOM = [(1.0, 0.0), (1.0, 0.5), (0.5, 0.5), (0.0, 0.5)]


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
@pytest.mark.parametrize("substeps", [8, pytest.param(2, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("e", "mu"), [(0.0, 0.0), *(pytest.param(*each, marks=pytest.mark.slow) for each in SELDOM)])
@pytest.mark.parametrize("room", [pv.Box((-5, -5), (5, 5)), pv.Circle(radius=5)])
def test_walls_that_close_in_throw_no_one_out(room: pv.Boundary, e: float, mu: float, substeps: int, dtype: type) -> None:
    # Of such worlds a fifth lost a disc or ended with NaN: what the sides of a wedge remembered grew, and threw discs as the
    # sides turned; discs that had been pressed into one point had no normal; and what a wedge threw had no wall in sight.
    for seed, ratio in enumerate([1.0, 1.0, 100.0, 100.0] if mu or e else [1.0]):
        rng = np.random.default_rng(seed)
        world = pv.World(
            boundary=room, collisions=pv.Collisions(restitution=e, friction=mu), threads=1, substeps=substeps, dtype=dtype
        )
        world.obstacles += closing_in(e, rng.uniform(0.6, 1.4))
        at = points(np.arange(-3, 3.1, 0.7), np.arange(-3, 3.1, 0.7)) + rng.uniform(-0.02, 0.02, (81, 2))
        radius = rng.uniform(0.08, 0.3, 81) if seed % 2 else 0.25
        world.add(position=at, radius=radius, mass=ratio ** rng.uniform(0, 1, 81), on_overlap="push")
        for _ in each_frame(world, 200):
            assert beyond(world) < 1e-3  # what physics.md promises


def test_a_squeezed_disc_stays_in_the_room_and_calm() -> None:
    # A wall of the room and a piston that goes through it: the piston passes over the disc, which is not thrown about.
    world = pv.World(gravity=(0, 0), boundary=pv.Box((-5, -5), (5, 5)), threads=1)
    world.obstacles.append(pv.Segment((2, -9), (2, 9), velocity=(2, 0)))
    disc = world.add(position=(4, 0), radius=0.5)
    for _ in each_frame(world, 240):
        assert beyond(world) < 1e-6
        # Its coordinates are spaced by 5e-7 m: 2e-4 m/s in a substep. Wall and piston hold it by turns.
        assert np.hypot(*disc.velocity[0]) <= 2 * (1 + 5e-3)
    assert disc.velocity[0] == pytest.approx([0, 0], abs=1e-6)  # the piston has left


def test_who_is_added_inside_an_obstacle_beside_the_wall_stays_in_the_room() -> None:
    world = pv.World(boundary=pv.Box((-5, -5), (5, 5)), threads=1)
    world.obstacles += [pv.Polygon([(3.5, -4), (5.5, -4), (5.5, 4), (3.5, 4)]), pv.Disc((-5, 0), 1.0)]
    world.add(position=[(4.8, 0), (-4.9, 0.1), (4.2, 3)], radius=0.4, on_overlap="push")
    for _ in each_frame(world, 120):
        assert beyond(world) < 1e-6
    assert np.abs(world.velocity).max() < np.sqrt(2 * G * 10)


REFUSED = {
    "disc": (pv.Disc((0, 0), 1.0), (0.5, 0.5), r"position\[1\] is \(0.5, 0.5\) m, inside the Disc at \(0, 0\) m; allowed are"),
    "capsule": (pv.Capsule((-1, 0), (1, 0), radius=0.2), (0.9, 0.1), r"inside the Capsule at \(0, 0\) m"),
    "polygon": (pv.Polygon([(-1, -1), (1, -1), (0, 1)]), (0, 0.5), r"inside the Polygon"),
    "turned": (pv.Capsule((-2, 0), (2, 0), radius=0.2, angular_velocity=np.pi / 2 / DT), (0, 1.9), r"inside the Capsule"),
    "room": (pv.Segment((0, 0), (1, 0)), (-6, 0), r"outside the room, Box\(\(-5.0, -5.0\).*on_overlap='push'"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_circles_inside_obstacles_or_outside_the_room_are_refused_or_asked_for(case: str) -> None:
    obstacle, where, says = REFUSED[case]
    world = pv.World(boundary=pv.Box((-5, -5), (5, 5)), collisions=None, threads=1)
    world.obstacles.append(obstacle)
    world.step(DT)
    assert world.is_free([(4, 4), where]).tolist() == [True, False]
    refused(says, world.add, position=[(4, 4), where], radius=0.1)
    assert len(world) == 0
    world.add(position=[(4, 4), where], radius=0.1, on_overlap="push")
    world.run(seconds=0.1, dt=DT)
    assert not world.escaped()
    assert np.isfinite(world.position).all()
    world.add(position=where, mass=np.inf, radius=0.1)  # who is pinned goes nowhere


def test_emitters_leave_obstacles_out() -> None:
    world = pv.World(gravity=(0, 0), threads=1)
    world.obstacles.append(pv.Disc((0, 0), 2.0))
    pv.Emitter(pv.Box((-3, -3), (3, 3)), rate=100, radius=0.1).act(world, 1.0)  # not stepped: nobody has been let out
    assert len(world) > 50
    assert (np.hypot(*world.position.T) > 2).all()


@pytest.mark.parametrize("substeps", [1, 8])
def test_the_velocity_of_who_slides_along_a_wall_is_that_of_now(substeps: int) -> None:
    # Under a tilted gravity: v = g_x t along a smooth floor. Steps keep velocities of half a substep ago, 4e-3 to 3e-2 m/s less.
    world = pv.World(boundary=pv.Box((-100, -10), (100, 10)), gravity=(4, -G), substeps=substeps, dtype=np.float64, threads=1)
    world.add(position=[[0, -9.5]], radius=0.5)
    world.run(seconds=1.0, dt=DT)
    assert world.velocity[0] == pytest.approx([4.0, 0.0], abs=1e-12)
    assert world.position[0] == pytest.approx([2.0, -9.5], abs=1e-12)
