"""A round room that turns: Coulomb friction against closed forms, the work of the wall, and grains that flow."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import bits_after, each_frame, of_ones_own

import pyverlet as pv
from pyverlet import scenes

G, MU, MASS, SPEED = 9.81, 0.2, 2.0, 1.0
WIDE = 1000.0
"""Radius of a drum whose floor is flat, m: within the 0.03 m of these tests it pulls back by g x / R = 3e-4 m/s^2."""


@pytest.mark.parametrize("way", [1, -1])
def test_a_disc_at_rest_is_taken_along_and_spun_up(way: int) -> None:
    # Friction mu m g accelerates the disc by mu g and its rim by 2 mu g (I = m r^2 / 2), until they add up to the speed u of the
    # wall, at t = u / (3 mu g): v = u / 3, r w = 2 u / 3. The wall does the work J u = m u^2 / 3; half of it becomes heat.
    room = pv.Circle(radius=WIDE, friction=MU, angular_velocity=way * SPEED / WIDE)
    world = pv.World(boundary=room, dtype=np.float64, ledger=True)
    disc = world.add(position=(0, 0.5 - WIDE), radius=0.5, mass=MASS)
    start = world.energy().total
    h = 1 / 60 / world.substeps
    grips = SPEED / (3 * MU * G)
    for _ in each_frame(world, 30):
        slips = min(world.time, grips)
        # A step's error in the velocity, mu g h, and what the bend of the floor pulls back by.
        least = MU * G * h + 3e-4 * world.time
        assert way * disc.velocity[0, 0] == pytest.approx(MU * G * slips, abs=least)
        assert way * disc.spin[0] * 0.5 == pytest.approx(2 * MU * G * slips, abs=2 * least)
    account = world.ledger
    assert account is not None
    assert account.walls == pytest.approx(MASS * SPEED**2 / 3, rel=1e-3)
    assert account.friction == pytest.approx(-MASS * SPEED**2 / 6, rel=1e-3)
    assert world.energy().total - start == pytest.approx(MASS * SPEED**2 / 6, rel=1e-3)
    assert account.total == pytest.approx(world.energy().total, rel=1e-12)
    assert abs(account.residual) < 1e-9 * abs(start)


def test_a_bounce_on_a_running_wall_rubs_as_coulomb_says() -> None:
    # Falling at v on a wall that runs at u: the impulse along the normal is (1 + e) m v, so friction gives mu (1 + e) v at most.
    room = pv.Circle(radius=WIDE, restitution=0.5, friction=MU, angular_velocity=100 / WIDE)
    world = pv.World(gravity=(0, 0), boundary=room, dtype=np.float64)
    disc = world.add(position=(0, 1 - WIDE), velocity=(0, -2), radius=0.5)
    world.run(seconds=0.5)
    given = MU * (1 + 0.5) * 2
    assert disc.velocity[0] == pytest.approx([given, 0.5 * 2], rel=1e-3)
    assert disc.spin[0] == pytest.approx(2 * given / 0.5, rel=1e-3)


def test_without_friction_it_is_a_cage() -> None:
    def bits(speed: float) -> str:
        world = pv.World(boundary=pv.Circle(radius=3, angular_velocity=speed))
        world.add(position=np.random.default_rng(1).uniform(-1, 1, (20, 2)), radius=0.1, on_overlap="push")
        return bits_after(world, 0.5)

    assert bits(0.0) == bits(7.0)


def test_who_does_not_touch_it_keeps_every_bit_of_its_spin() -> None:
    world = pv.World(gravity=(0, 0), boundary=pv.Circle(radius=3, friction=1.0, angular_velocity=1 / 3))
    free = world.add(position=(0, 0), radius=0.1, spin=np.float32(0.1))
    world.run(seconds=0.2)
    assert free.spin[0] == np.float32(0.1)


def test_grains_flow_down_a_slope_that_the_torque_of_the_wall_holds_up() -> None:
    world = scenes.get("drum").world(particles=200, ledger=True)
    room, mass = world.boundary, world.mass.astype(float)
    assert isinstance(room, pv.Circle)
    world.run(seconds=4.0)
    account, start, turning = world.ledger, world.time, world.angular_momentum()
    assert account is not None
    worked, across, angles = account.walls, [], []
    for _ in each_frame(world, 240):
        x, y = mass @ world.position / mass.sum()
        across.append(x)
        angles.append(np.degrees(np.arctan2(x, -y)))
    # The moment of all that acts on the grains is what their angular momentum changes by: P / w - M g x, averaged over the time.
    account, seconds = world.ledger, world.time - start
    assert account is not None
    wall = (account.walls - worked) / room.angular_velocity / seconds
    weight = mass.sum() * G * np.mean(across)
    # What is left: forces of a substep are taken at its end, mean positions of frames at theirs.
    assert wall - weight == pytest.approx((world.angular_momentum() - turning) / seconds, abs=0.01 * abs(weight))
    assert 15 < -np.mean(angles) < 40  # the slope of heaps of rough discs in a drum that turns slowly, clockwise
    assert abs(account.residual) < 1e-4 * account.walls
    assert world.escaped() == 0


# ---- Rooms of a user's own that are made of those of the library: their walls confine circles after each substep ----


RADIUS = 0.5


def room(kind: str, **law: Any) -> Any:
    return of_ones_own(pv.Box((-20, 0), (20, 40), **law) if kind == "box" else pv.Circle(center=(0, 20), radius=20, **law))


def test_a_drum_takes_a_disc_along() -> None:
    # The rim of the disc comes to run with the wall, v_t + r w = R W. Along a round wall a straight substep of length v h ends
    # with 1 - cos(v h / R), 4e-7, less speed, of which friction has given back all but the last.
    world = pv.World(gravity=(0, 0), boundary=room("cage", friction=0.9, angular_velocity=0.5), dtype=np.float64)
    world.add(position=(0, RADIUS), velocity=(8.0, 0), radius=RADIUS)
    world.run(seconds=2.0)
    x, y = world.position[0] - (0, 20)
    (vx, vy), spin = world.velocity[0], world.spin[0]
    assert np.hypot(x, y) == pytest.approx(20 - RADIUS, abs=1e-9)
    assert (x * vy - y * vx) / np.hypot(x, y) + RADIUS * spin == pytest.approx(10.0, abs=1e-5)


@pytest.mark.parametrize("kind", ["box", "cage"])
def test_what_does_not_bounce_lies_on_the_wall(kind: str) -> None:
    # It falls 1 m and stays: one begin with sqrt(2 g), no end, and m g H is taken, all of it by the impact with e = 0, which such
    # walls do not tell from pushing.
    world = pv.World(boundary=(mine := room(kind)), events=True, ledger=True, dtype=np.float64)
    world.add(position=(0, RADIUS + 1.0), radius=RADIUS, mass=2.0)
    begun: list[tuple[Any, ...]] = []
    for _ in each_frame(world, 180):
        begun += [tuple(row) for row in world.events.begin[["a", "b", "wall", "speed"]].tolist()]
        assert len(world.events.end) == 0
    assert begun == [(0, -1, 2 if kind == "box" else 0, pytest.approx(np.sqrt(2 * G), rel=1e-9))]
    assert world.position[0] == pytest.approx([0, RADIUS], abs=1e-12)
    assert world.velocity[0] == pytest.approx([0, 0], abs=1e-12)
    assert world.ledger.restitution == pytest.approx(-2.0 * G, abs=1e-9)
    assert world.ledger.residual == pytest.approx(0.0, abs=1e-9)
    assert world.ledger.total == pytest.approx(world.energy().total, abs=1e-9)
    assert mine.asked == 180 * world.substeps


def test_own_numbers_of_circles_count() -> None:
    # The larger e, and the geometric mean of the frictions: sqrt(0.4 * 0.1) g = 0.2 g slows the first down; sqrt(0.4 * 0.625) g
    # has the last roll at v = 2 v_0 / 3, as m r v + I w about the point of contact is kept (I = m r^2 / 2).
    world = pv.World(boundary=room("box", restitution=0.2, friction=0.4), dtype=np.float64)
    first = world.add(position=(-10, RADIUS), velocity=(5.0, 0), radius=RADIUS, friction=0.1)
    second = world.add(position=(10, RADIUS + 1.0), radius=RADIUS, restitution=0.7)
    third = world.add(position=(-19, RADIUS), velocity=(3.0, 0), radius=RADIUS, friction=0.625)
    world.run(seconds=0.5)
    assert first.velocity[0, 0] == pytest.approx(5.0 - 0.5 * 0.2 * G, abs=1e-9)
    (_, y), (_, v) = second.position[0], second.velocity[0]
    assert y - RADIUS + v * v / (2 * G) == pytest.approx(0.49, rel=1e-9)
    assert third.velocity[0] == pytest.approx([2.0, 0], abs=1e-9)
    assert third.spin[0] == pytest.approx(-2.0 / RADIUS, abs=1e-9)
