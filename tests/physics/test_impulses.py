"""The contact law: frames of any length, heaps at rest, unequal masses, impacts in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws import naive

FRAME, G = 1 / 60, 9.81


def law(**more: Any) -> pv.Collisions:
    return pv.Collisions(**more)


def heap(
    count: int, *, restitution: float = 0.0, friction: float = 0.0, ratio: float = 1.0, spread: float = 1.0, **more: Any
) -> tuple[pv.World, float]:
    """Discs on a loose grid in a cage that they fill by 0.6; and m g R, J."""
    chance, radius = np.random.default_rng(3), 0.5 * np.sqrt(count / 0.6)
    row, column = np.mgrid[-60:60, -60:60]
    place = np.column_stack((((column + 0.5 * (row & 1)) * 1.02).ravel(), (row * 0.94).ravel()))
    place = chance.permutation(place[np.hypot(*place.T) < radius - 0.52])[:count]
    size = 0.5 / spread + 0.5 * (1 - 1 / spread) * (chance.random(count) if spread > 1 else np.ones(count))
    world = pv.World(
        boundary=pv.Circle(radius=radius, restitution=restitution, friction=friction),
        collisions=law(restitution=restitution, friction=friction),
        **more,
    )
    world.add(position=place, radius=size, mass=4 * size**2 * ratio ** chance.random(count))
    return world, float(world.mass.sum()) * G * radius


def column(top: float, count: int = 20) -> pv.World:
    """Discs of 1 kg on each other between walls, the last of `top` kg."""
    world = pv.World(boundary=pv.Box((0, 0), (1, 60)), collisions=law(), dtype=np.float64)
    mass = np.where(np.arange(count) == count - 1, top, 1.0)
    world.add(position=np.column_stack((np.full(count, 0.5), 0.5 + 1.001 * np.arange(count))), radius=0.5, mass=mass)
    return world


def worst_rise(world: pv.World, clock: Any) -> float:
    """The largest rise of energy in a frame, J."""
    energy = [world.energy().total]
    for dt in clock:
        world.step(float(dt))
        energy.append(world.energy().total)
    return float(np.diff(energy).max())


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
    world = pv.World(boundary=pv.Box((0, 0), (5.2, 250)), collisions=law(), threads=1)
    jitter = np.random.default_rng(5).uniform(-0.03, 0.03, 5 * layers)
    world.add(position=np.column_stack((0.55 + (count % 5) * 1.02 + jitter, 0.5 + (count // 5) * 1.02)), radius=0.5)
    world.run(seconds=0.3 * layers)
    assert world.energy().kinetic < 1e-7 * 5 * layers * G * layers


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 0, 2)])
def test_a_ball_onto_two_alike_gives_both_the_same(order: tuple[int, ...], dtype: Any) -> None:
    # Momentum and energy with equal impulses J along both normals, at 30 degrees: J = 2 sqrt(3) / 5.
    place, speed = np.array([(0, 3.0), (-0.5, 0), (0.5, 0)]), np.array([(0, -1.0), (0, 0), (0, 0)])
    world = pv.World(gravity=(0, 0), collisions=law(restitution=1.0), dtype=dtype)
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
    world = pv.World(gravity=(0, 0), collisions=law(restitution=1.0), dtype=dtype)
    x = 0.1 * (np.arange(count) * (1.0 + gap) - np.where(come, 1.5, 0.0))
    world.add(position=x[:, None] * along, velocity=1.0 * come[:, None] * along, radius=0.05)
    world.run(seconds=1.0)
    assert world.velocity @ along == pytest.approx(
        np.where(np.arange(count) >= count - incoming, 1.0, 0.0), abs=1e-5 if dtype == np.float32 else 1e-9
    )


def test_a_smooth_cage_lets_a_disc_swing() -> None:
    # Sliding on a round wall along normals that turn by v h / R a substep keeps energy to second order in that.
    world = pv.World(boundary=pv.Circle(radius=5), collisions=law(), dtype=np.float64)
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
    world = pv.World(boundary=room, integrator=integrator, collisions=law(friction=0.3), dtype=np.float64)
    world.add(position=[[1, 0.5]], radius=0.5, velocity=[[5, 0]])
    for _ in range(20):
        world.step(FRAME)
    late = 2 * 0.3 * G * FRAME / 8 if integrator.order == 1 else 1e-12
    assert world.velocity[0, 0] == pytest.approx(5 - 0.3 * G * world.time, abs=late)
    assert world.spin[0] == pytest.approx(-2 * 0.3 * G * world.time / 0.5, abs=2 * late / 0.5)


@pytest.mark.parametrize("integrator", [*INTEGRATORS[:3], pv.TimeCorrectedVerlet(), pv.PositionVerlet()], ids=repr)
def test_integrators_fly_freely_between_contacts(integrator: pv.Integrator) -> None:
    def ball(**more: Any) -> pv.World:
        world = pv.World(integrator=integrator, dtype=np.float64, **more)
        world.forces.append(pv.Drag(linear=0.3))
        world.add(position=[[0, 3], [4, 3]], radius=0.5, velocity=[[1, 0], [0, 1]])
        for _ in range(30):
            world.step(FRAME)
        return world

    free, held = ball(collisions=None), ball(collisions=law(), boundary=pv.Circle(radius=50))
    # Rounding: positions of 4 m at 1e-16, over h of 2 ms.
    np.testing.assert_allclose(held.position, free.position, rtol=0, atol=1e-12)
    np.testing.assert_allclose(held.velocity, free.velocity, rtol=0, atol=1e-11)


def test_a_room_of_the_users_own_confines() -> None:
    room = pv.Box((-1, 0), (1, 10), restitution=1)
    world = pv.World(boundary=naive.ClampAndFlip(room), collisions=law(), dtype=np.float64)
    world.add(position=[(0.0, 2.0), (0.2, 4.0)], radius=0.5)
    for _ in range(200):
        world.step(FRAME)
        assert (world.position[:, 1] >= 0.5 - 1e-9).all()
