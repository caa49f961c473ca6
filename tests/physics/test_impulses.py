"""The contact law: frames of any length, heaps at rest, unequal masses, impacts in closed form."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from tests.worlds import each_frame, world_with, worst_rise

import pyverlet as pv

FRAME, G = 1 / 60, 9.81


def heap(count: int, *, restitution: float = 0.0, friction: float = 0.0) -> tuple[pv.World, float]:
    """Discs on a loose grid in a cage that they fill by 0.6; and m g R, J."""
    chance, radius = np.random.default_rng(3), 0.5 * np.sqrt(count / 0.6)
    row, column = np.mgrid[-60:60, -60:60]
    place = np.column_stack((((column + 0.5 * (row & 1)) * 1.02).ravel(), (row * 0.94).ravel()))
    place = chance.permutation(place[np.hypot(*place.T) < radius - 0.52])[:count]
    law: dict[str, Any] = {"restitution": restitution, "friction": friction}
    world = pv.World(boundary=pv.Circle(radius=radius, **law), collisions=pv.Collisions(**law))
    world.add(position=place, radius=0.5)
    return world, float(world.mass.sum()) * G * radius


def fastest(world: pv.World) -> float:
    return float(np.hypot(*world.velocity.T).max())


@pytest.mark.parametrize("lengths", [(1 / 240, FRAME), (FRAME, 1 / 30), (FRAME, 0.25)])
def test_a_settled_heap_rests_however_long_frames_are(lengths: tuple[float, float]) -> None:
    world, scale = heap(300, restitution=0.5, friction=0.3)
    world.run(seconds=10.0)  # after 5 s, one in fourteen heaps still has somebody who falls
    clock = np.random.default_rng(3).choice(lengths, 150)
    # No closed form: the bars are those of the issue, 1e-5 m g R (1e-3 with frames of 0.25 s) and 5 mm/s.
    assert worst_rise(world, clock) < (1e-3 if max(lengths) > 0.1 else 1e-5) * scale
    assert fastest(world) < 5e-3


@pytest.mark.parametrize(
    ("lengths", "bar"), [((1 / 240, FRAME), 1e-4), ((FRAME, 1 / 30), 1e-4), ((1 / 240, FRAME, 1 / 30), 2e-4)]
)
def test_falling_with_an_unsteady_clock_brings_no_energy(lengths: tuple[float, ...], bar: float) -> None:
    world, scale = heap(300, restitution=0.5, friction=0.3)
    assert worst_rise(world, np.random.default_rng(3).choice(lengths, 300)) < bar * scale


def test_a_slider_of_substeps_does_not_move_a_heap() -> None:
    world, scale = heap(300, friction=0.3)
    world.run(seconds=5.0)
    for substeps in (8, 2, 16, 4, 8):
        world.substeps = substeps
        assert worst_rise(world, [FRAME] * 30) < 1e-4 * scale, substeps


@pytest.mark.parametrize("layers", [80, pytest.param(200, marks=pytest.mark.slow)])
def test_many_layers_come_to_rest(layers: int) -> None:
    count = np.arange(5 * layers)
    world = pv.World(boundary=pv.Box((0, 0), (5.2, 250)), collisions=pv.Collisions(), threads=1)
    jitter = np.random.default_rng(5).uniform(-0.03, 0.03, 5 * layers)
    world.add(position=np.column_stack((0.55 + (count % 5) * 1.02 + jitter, 0.5 + (count // 5) * 1.02)), radius=0.5)
    world.run(seconds=0.3 * layers)
    assert world.energy().kinetic < 1e-7 * 5 * layers * G * layers


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_a_ball_onto_two_alike_gives_both_the_same(order: tuple[int, ...], dtype: Any) -> None:
    # Momentum and energy with equal impulses J along both normals, at 30 degrees: J = 2 sqrt(3) / 5.
    place, speed = np.array([(0, 3.0), (-0.5, 0), (0.5, 0)]), np.array([(0, -1.0), (0, 0), (0, 0)])
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1.0), dtype=dtype)
    world.add(position=place[list(order)], velocity=speed[list(order)])
    world.run(seconds=3.0)
    speeds = np.hypot(*world.velocity.T)[np.argsort(order)]
    assert speeds == pytest.approx([0.2, 0.4 * np.sqrt(3), 0.4 * np.sqrt(3)], abs=1e-5)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("angle", "gap"), [(0, 0.0), (30, 0.01), (45, 0.0), (90, 0.01), (135, 0.0), (200, 0.01)])
@pytest.mark.parametrize("incoming", [1, 2, 3])
def test_as_many_leave_a_row_as_come(incoming: int, angle: float, gap: float, dtype: Any) -> None:
    # Rounding of the coordinates leaves gaps and overlaps of a digit or two, and rows cross rows of cells.
    along, count = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))]), 20
    come = np.arange(count) < incoming
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=1.0), dtype=dtype)
    x = 0.1 * (np.arange(count) * (1.0 + gap) - np.where(come, 1.5, 0.0))
    world.add(position=x[:, None] * along, velocity=1.0 * come[:, None] * along, radius=0.05)
    world.run(seconds=1.0)
    assert world.velocity @ along == pytest.approx(
        np.where(np.arange(count) >= count - incoming, 1.0, 0.0), abs=1e-5 if dtype == np.float32 else 1e-9
    )


def test_a_smooth_cage_lets_a_disc_swing() -> None:
    # Sliding on a round wall along normals that turn by v h / R a substep keeps energy to second order in that.
    world = pv.World(boundary=pv.Circle(radius=5), collisions=pv.Collisions(), dtype=np.float64)
    world.add(position=(-3.18, -3.18), radius=0.5)
    world.run(seconds=0.2)
    before = world.energy().total
    world.run(seconds=20.0)
    assert world.energy().total == pytest.approx(before, rel=2e-4)


INTEGRATORS = [pv.VelocityVerlet(), pv.RK4(), pv.Yoshida4(), pv.ExplicitEuler(), pv.SemiImplicitEuler(), pv.TimeCorrectedVerlet()]


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=repr)
def test_friction_brakes_and_turns_a_disc_whatever_the_integrator(integrator: pv.Integrator) -> None:
    # mu m g brakes: v = v0 - mu g t, and turns: I w' = -mu m g r with I = m r^2 / 2, so w = -2 mu g t / r. Methods of order 1
    # hold the floor a substep later: 2 mu g h of both.
    room = pv.Box((0, 0), (100, 10), friction=0.3)
    world = pv.World(boundary=room, integrator=integrator, collisions=pv.Collisions(friction=0.3), dtype=np.float64)
    world.add(position=[[1, 0.5]], radius=0.5, velocity=[[5, 0]])
    world.run(seconds=20 / 60)
    late = 2 * 0.3 * G * FRAME / 8 if integrator.order == 1 else 1e-12
    assert world.velocity[0, 0] == pytest.approx(5 - 0.3 * G * world.time, abs=late)
    assert world.spin[0] == pytest.approx(-2 * 0.3 * G * world.time / 0.5, abs=2 * late / 0.5)


@pytest.mark.parametrize("integrator", [*INTEGRATORS[:3], pv.TimeCorrectedVerlet(), pv.PositionVerlet()], ids=repr)
def test_integrators_fly_freely_between_contacts(integrator: pv.Integrator) -> None:
    def ball(**more: Any) -> pv.World:
        world = pv.World(integrator=integrator, dtype=np.float64, **more)
        world.forces.append(pv.Drag(linear=0.3))
        world.add(position=[[0, 3], [4, 3]], radius=0.5, velocity=[[1, 0], [0, 1]])
        world.run(seconds=30 / 60)
        return world

    free, held = ball(collisions=None), ball(collisions=pv.Collisions(), boundary=pv.Circle(radius=50))
    # Rounding: positions of 4 m at 1e-16, over h of 2 ms.
    np.testing.assert_allclose(held.position, free.position, rtol=0, atol=1e-12)
    np.testing.assert_allclose(held.velocity, free.velocity, rtol=0, atol=1e-11)


# ---- Obstacles and pinned circles under the contact law, against closed forms and conservation laws ----


DT, H, R = 1 / 60, 1 / 480, 0.25


def tilted(angle: float, **surface: Any) -> tuple[pv.Segment, Any, Any]:
    """A long segment that falls to the right by an angle, with its direction and its normal."""
    way, normal = np.array([np.cos(angle), -np.sin(angle)]), np.array([np.sin(angle), np.cos(angle)])
    start, end = (-40 * way).tolist(), (40 * way).tolist()
    return pv.Segment(start, end, **surface), way, normal


@pytest.mark.parametrize("speed", [3.0, 200.0])
@pytest.mark.parametrize(("e", "mu"), [(1.0, 0.0), (0.5, 0.0), (0.3, 0.1), (0.6, 1.0)])
def test_a_disc_bounces_from_a_slanted_segment_as_on_paper(e: float, mu: float, speed: float) -> None:
    # v_n' = -e v_n. Along the tangent j_t / m = min(mu (1 + e) v_n, v_t / 3), for the rim of a disc has the inverse mass 3 / m;
    # it takes j_t from the speed along and gives the spin 2 j_t / (m r).
    segment, way, normal = tilted(0.4, restitution=e, friction=mu)
    world = world_with(segment, gravity=(0, 0))
    start = speed * np.array([0.6, -0.8])
    disc = world.add(position=2 * normal, velocity=start, radius=R)
    world.run(seconds=4.0 / speed + 2 * DT, dt=DT)
    into, along = -float(start @ normal), float(start @ way)
    tangent = min(mu * (1 + e) * into, along / 3)
    assert disc.velocity[0] @ normal == pytest.approx(e * into, rel=1e-12)
    assert disc.velocity[0] @ way == pytest.approx(along - tangent, rel=1e-12)
    assert disc.spin[0] == pytest.approx(-2 * tangent / R, rel=1e-12)


def test_a_field_of_round_pegs_keeps_the_energy_of_elastic_discs() -> None:
    # Impacts in closed form at their times: nothing but rounding changes the energy, for some 2,000 of them.
    x, y = np.meshgrid(np.arange(0.0, 9), np.arange(0.0, 6))
    pegs = [pv.Disc((a + 0.5 * (b % 2), b), 0.2, restitution=1.0) for a, b in zip(x.ravel(), y.ravel(), strict=True)]
    world = world_with(*pegs, boundary=pv.Box((-1, -1), (10, 7), restitution=1.0), collisions=pv.Collisions(restitution=1.0))
    world.add(position=[(0.7 + k, 5.5) for k in range(8)], radius=0.1, velocity=[(1.3, 0.3 * k) for k in range(8)])
    start = world.energy().total
    world.run(seconds=10, dt=DT)
    assert world.energy().total == pytest.approx(start, rel=1e-9)


@pytest.mark.parametrize("spin", [3.0, -7.0])
def test_a_paddle_hits_with_the_speed_of_the_point_it_hits_with(spin: float) -> None:
    # Elastic, an immovable paddle: v' = 2 (w x r) . n n; r = (x, y) of the point of contact, where the arm has turned by
    # w t. The disc at rest at (2, 0) touches the arm when the arm is asin(reach / 2) away from it.
    side = -np.sign(spin)
    arm = pv.Segment((-3, 0), (3, 0), pivot=(0, 0), angular_velocity=spin, restitution=1.0)
    world = world_with(arm, gravity=(0, 0))
    arm.angle = float(side * 0.6)
    disc = world.add(position=(2, 0), radius=R)
    away = np.arcsin(R / 2)
    world.run(seconds=(0.6 - away) / abs(spin) + 3 * DT, dt=DT)
    normal = np.array([np.sin(away), np.sign(spin) * np.cos(away)])
    assert disc.velocity[0] == pytest.approx(2 * abs(spin) * 2 * np.cos(away) * normal, rel=1e-4)


@pytest.mark.parametrize(("mu", "degrees"), [(0.0, 20), (0.1, 30), (0.3, 60), (0.5, 30)])
def test_a_disc_goes_down_an_incline_as_on_paper(mu: float, degrees: float) -> None:
    # a = g (sin - mu cos) where it slides; 2/3 g sin where it rolls, up to tan <= 3 mu.
    angle, seconds = np.radians(degrees), 1.5
    segment, way, normal = tilted(angle, friction=mu)
    world = world_with(segment)
    disc = world.add(position=-20 * way + R * normal, radius=R)
    world.run(seconds=seconds, dt=DT)
    rolls = mu > 0 and np.tan(angle) <= 3 * mu
    a = 2 / 3 * G * np.sin(angle) if rolls else G * (np.sin(angle) - mu * np.cos(angle))
    assert disc.velocity[0] @ way == pytest.approx(a * seconds, rel=1e-9)
    assert disc.position[0] @ way + 20 == pytest.approx(0.5 * a * seconds**2, rel=2 * H / seconds)
    assert disc.position[0] @ normal == pytest.approx(R, abs=1e-9)


@pytest.mark.parametrize("pinned", [False, True])
@pytest.mark.parametrize("half", [60, 30, 12])
def test_a_disc_in_a_v_weighs_what_it_weighs(half: float, pinned: bool) -> None:
    # Each side carries m g / (2 sin a), a being half the angle of the V: together along the vertical that is m g.
    a = np.radians(half)
    world = world_with(contacts=True)
    if pinned:
        ends = np.array([[-1, 0], [1, 0]]) * (1 + R) * np.cos(a)
        world.add(position=ends, radius=1.0).pin()
        place = (0.0, (1 + R) * np.sin(a))
    else:
        x, y = 6 * np.sin(a), 6 * np.cos(a)
        world.obstacles += [pv.Segment((0, 0), (x, y)), pv.Segment((0, 0), (-x, y))]
        place = (0.0, R / np.sin(a))
    disc = world.add(position=place, radius=R, mass=3.0)
    world.run(seconds=1, dt=DT)
    assert disc.position[0] == pytest.approx(place, abs=1e-9)
    assert np.hypot(*disc.velocity[0]) < 1e-9
    assert world.contacts["impulse"] / DT == pytest.approx([3.0 * G / (2 * np.sin(a))] * 2, rel=1e-6)


@pytest.mark.parametrize("capsules", [False, True])
def test_a_pile_on_obstacles_rests_however_long_frames_are(capsules: bool) -> None:
    # As in the room: frames of 1/240, 1/60 and 1/30 s by chance raise the energy by less than 1e-5 m g R.
    t = np.linspace(-1, 1, 21)
    valley = np.column_stack((6 * t, 4 * t * t))
    if capsules:
        floor: list[pv.Obstacle] = [pv.Capsule(a, b, radius=0.2, friction=0.3) for a, b in pairwise(valley)]
    else:
        floor = [pv.Chain(valley, friction=0.3)]
    world = world_with(*floor, collisions=pv.Collisions(friction=0.3), boundary=pv.Box((-6, -1), (6, 30)))
    x, y = np.meshgrid(np.arange(-3, 3.1, 0.55), np.arange(4.0, 9, 0.55))
    world.add(position=np.column_stack((x.ravel() + 0.05 * y.ravel(), y.ravel())), radius=R)
    world.run(seconds=8, dt=DT)
    clock = np.random.default_rng(2).choice([1 / 240, 1 / 60, 1 / 30], 120)
    assert worst_rise(world, clock) <= 1e-5 * float(world.mass.sum()) * G * 6


def test_a_disc_rolls_along_a_thousand_segments_as_over_one() -> None:
    x = np.linspace(-5, 45, 1001)
    floor = np.column_stack((x, 0 * x))
    ways = []
    for obstacle in (pv.Segment((-5, 0), (45, 0), friction=0.5), pv.Chain(floor, friction=0.5)):
        world = world_with(obstacle)
        disc = world.add(position=(0, R), velocity=(9, 0), spin=-9 / R, radius=R)
        for _ in each_frame(world, 180):
            assert disc.position[0, 1] == pytest.approx(R, abs=1e-12)
        ways.append((*disc.position[0], *disc.velocity[0], disc.spin[0]))
    assert ways[0] == pytest.approx((27, R, 9, 0, -9 / R), rel=1e-9, abs=1e-12)
    assert ways[1] == pytest.approx(ways[0], rel=1e-12, abs=1e-12)


def test_one_that_goes_leaves_the_others_what_they_carry() -> None:
    # A disc at rest on one segment does not notice that another is taken away, added or changed far from it.
    floor, other = pv.Segment((-1, 0), (1, 0)), pv.Segment((5, 0), (7, 0))
    world = world_with(other, floor)
    disc = world.add(position=(0, R), radius=R)
    world.run(seconds=0.5, dt=DT)
    changes: list[Callable[[], object]] = [
        lambda: world.obstacles.remove(other), lambda: world.obstacles.insert(0, pv.Disc((6, 3), 0.5)),
        lambda: setattr(floor, "friction", 0.1),
    ]  # fmt: skip
    for change in changes:
        held = disc.position[0].copy()
        change()
        world.step(DT)
        assert disc.position[0] == pytest.approx(held, abs=1e-14)
        assert np.hypot(*disc.velocity[0]) < 1e-12
