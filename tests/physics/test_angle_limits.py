"""Limits of angles: free within, a stop at the ends that carries what leans on it."""

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

G = 9.81  # m/s^2
DTYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])
M, LENGTH = 2.0, 1.0


def pendulum(least: float, most: float, *, heading: float = 0.0, **settings: Any) -> tuple[pv.World, pv.Group, pv.AngleLimit]:
    """A stick of LENGTH from a pivot, to the right at first. Angles are against a pinned particle in direction `heading`, rad."""
    world = pv.World(**{"boundary": pv.Open(), "dtype": np.float64, "ledger": True, **settings})
    far = (2 * np.cos(heading), 2 * np.sin(heading))
    group = world.add(position=[far, (0, 0), (LENGTH, 0)], radius=0.1, mass=[1.0, 1.0, M])
    group.pin([0, 1])
    world.links.append(pv.Stick(group, 1, 2))
    limit = world.links.append(pv.AngleLimit(group, 0, 1, 2, least=least, most=most))
    return world, group, limit


def angle_of(group: pv.Group) -> float:
    return float(np.arctan2(group.position[2, 1], group.position[2, 0]))


@DTYPES
@pytest.mark.parametrize(("heading", "dt"), [(0.0, 1 / 60), (np.pi, 1 / 30), (2.0, 1 / 240), (2.0, None)])
def test_a_pendulum_stops_at_its_limit_and_rests_there(heading: float, dt: float | None, dtype: Any) -> None:
    """It falls as a free one does, stops at -30 degrees, and presses with the torque m g l cos(30 degrees)."""
    stop, rng = -np.pi / 6, np.random.default_rng(0)
    world, group, limit = pendulum(stop - heading, 2.0 - heading, heading=heading, dtype=dtype)
    free, other, _ = pendulum(-3.0 - heading, 3.0 - heading, heading=heading, dtype=dtype)
    eps, falls = float(np.finfo(dtype).eps), True
    while world.time < 2.0:
        step = dt or float(rng.uniform(1 / 240, 1 / 30))
        world.step(step)
        free.step(step)
        assert angle_of(group) > stop - 20 * eps
        falls &= angle_of(other) > stop + 0.2
        if falls:
            assert np.array_equal(group.position, other.position)
            assert limit.force[0] == 0.0
    assert angle_of(group) == pytest.approx(stop, abs=20 * eps)
    assert np.abs(group.velocity).max() < 40 * eps
    # `force` is what the link pulls with: negative where it pushes the angle up
    assert limit.force[0] == pytest.approx(-M * G * LENGTH * np.cos(stop), rel=1e-5 if dtype == np.float32 else 1e-9)
    assert world.ledger.restitution == pytest.approx(M * G * LENGTH * np.sin(stop), rel=1e-5)  # what it fell
    assert world.energy().total == pytest.approx(world.ledger.total, abs=1e-4 if dtype == np.float32 else 1e-12)


def test_both_ends_stop_and_let_go() -> None:
    """Thrown up it stops at the end of its range, and falls again at once: a limit does not hold."""
    world, group, limit = pendulum(-0.5, 0.7)
    group.velocity[2] = (0, 8.0)
    highest = 0.0
    for _ in range(20):
        world.step(1 / 60)
        highest = max(highest, angle_of(group))
    assert highest < 0.7 + 1e-12
    assert highest > 0.7 - 0.5 * G / LENGTH / 60**2  # within the frame it falls by less
    assert angle_of(group) < 0.65
    world.run(seconds=1.0)
    assert angle_of(group) == pytest.approx(-0.5, abs=1e-12)
    limit.limits(-0.45, 0.1)  # moved while it leans on it: it is lifted there at once
    assert (limit.least[0], limit.most[0]) == (-0.45, pytest.approx(0.1))
    world.step(1 / 60)
    assert angle_of(group) == pytest.approx(-0.45, abs=1e-12)


def test_an_angle_that_is_changed_is_a_muscle() -> None:
    """It lifts a weight in worlds whose particles collide, too: the limiter takes that for no gain of contacts."""
    world, group, _ = pendulum(-3.0, 3.0)
    angle = world.links.append(pv.Angle(group, 0, 1, 2))
    for n in range(1, 61):
        angle.angle = n / 60
        world.step(1 / 60)
        assert angle_of(group) == pytest.approx(n / 60, abs=1e-12)
    assert world.energy().potential == pytest.approx(M * G * LENGTH * np.sin(1.0), rel=1e-12)
    assert world.ledger.limiter == 0.0


def test_without_gravity_momenta_are_kept() -> None:
    """Two sticks that fold up until their limit stops them: they turn on as one. The torque of a limit is internal.

    Sticks and limit are solved in turn, and lengths and the angle are off by what that leaves: 1e-6.
    """
    world = pv.World(boundary=pv.Open(), gravity=(0, 0), dtype=np.float64)
    group = world.add(position=[(-1, 0), (0, 0), (1, 0)], radius=0.1, mass=[1.0, 2.0, 3.0], velocity=[(0, 0), (0, 0), (0, 3.0)])
    world.links.append(pv.Stick(group, [0, 1], [1, 2]))
    limit = world.links.append(pv.AngleLimit(group, 0, 1, 2, least=np.pi, most=np.pi + 1.0))
    before, whole = world.angular_momentum(), world.momentum()
    for _ in range(120):
        world.step(1 / 60)
        assert world.angular_momentum() == pytest.approx(before, rel=1e-5)
        assert world.momentum() == pytest.approx(whole, abs=1e-10)
        a, b = group.position[0] - group.position[1], group.position[2] - group.position[1]
        angle = np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b) % (2 * np.pi)
        assert np.pi - 1e-5 < angle < np.pi + 1.0 + 1e-5
    assert limit.intact[0]


def test_what_is_stronger_breaks_it() -> None:
    world, group, _ = pendulum(-0.5, 0.7)
    world.links.remove(world.links[1])
    limit = world.links.append(pv.AngleLimit(group, 0, 1, 2, least=-0.5, most=0.7, breaking_torque=0.5 * M * G * LENGTH))
    world.run(seconds=1.0)
    assert not limit.intact[0]
    assert angle_of(group) < -0.6


@pytest.mark.parametrize("start", [0.02, 0.06, 0.3])
def test_a_limit_outside_its_range_is_reached_again(start: float) -> None:
    """What begins outside is brought to the nearer end, and is not thrown: the speed of that is taken in the same substep."""
    world, group, _ = pendulum(start, 1.5, gravity=(0, 0))
    world.step(1 / 60)
    assert angle_of(group) == pytest.approx(start, abs=0.05**2 / 2)  # steps along tangents, of 0.05 rad at most
    assert np.abs(group.velocity).max() < 1e-9 * 0.05 * 480  # of the speed at which it came


@DTYPES
def test_in_a_periodic_room(dtype: Any) -> None:
    world = pv.World(boundary=pv.Periodic((-1.5, -5), (1.5, 5)), dtype=dtype)
    group = world.add(position=[(0.5, 0), (1.4, 0), (-0.8, 0)], radius=0.1)
    group.pin([0, 1])
    world.links.append(pv.Stick(group, 1, 2))
    world.links.append(pv.AngleLimit(group, 0, 1, 2, least=np.pi - 0.5, most=np.pi + 0.4))
    world.run(seconds=2.0)
    way = world.boundary.seam.nearest((group.position[2] - group.position[1]).astype(float)[None])[0]
    assert abs(np.arctan2(way[1], way[0])) == pytest.approx(0.5, abs=1e-5)
