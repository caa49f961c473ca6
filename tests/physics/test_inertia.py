"""Moments of inertia of their own: rings, balls and flywheels that are circles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

G = 9.81  # m/s^2
RINGS = pytest.mark.parametrize("k", [1.0, 0.4, 0.5, 3.0])  # I / (m r^2) of a ring, a ball, a disc, a spool
DTYPES = pytest.mark.parametrize("dtype", [np.float32, np.float64])
M, R = 2.0, 0.3


def slope(angle: float, **settings: Any) -> pv.World:
    room = pv.Box((-100, 0), (100, 50), friction=2.0, rolling_resistance=settings.pop("c", 0.0))
    gravity = (G * np.sin(angle), -G * np.cos(angle))
    return pv.World(**{"boundary": room, "gravity": gravity, "dtype": np.float64, "ledger": True, **settings})


@DTYPES
@RINGS
def test_it_rolls_down_a_slope(k: float, dtype: Any) -> None:
    """a = g sin(angle) / (1 + k); the floor begins to push in the second substep. Energy is kept: it does not slip."""
    angle, t = 0.3, 2.0
    world = slope(angle, dtype=dtype)
    ring = world.add(position=(0, R), radius=R, mass=M, inertia=k * M * R * R)
    world.run(seconds=t)
    a = G * np.sin(angle) / (1 + k)
    assert ring.velocity[0, 0] == pytest.approx(a * t, abs=G * np.sin(angle) / 480 + 1e-5 * a * t)
    assert ring.spin[0] * R == pytest.approx(-ring.velocity[0, 0], rel=1e-5)
    energy = world.energy()
    assert energy.spin == pytest.approx(0.5 * k * M * float(ring.velocity[0, 0]) ** 2, rel=1e-5)
    assert energy.total == pytest.approx(world.ledger.total, rel=1e-5)
    # what it slips in the first substep: m (g sin h)^2 / 2, and as much again
    assert abs(world.ledger.friction) < 2 * M * (G * np.sin(angle) / 480) ** 2


@RINGS
def test_rolling_resistance_stops_it(k: float) -> None:
    """m (1 + k) a = -c m g: after v0^2 (1 + k) / (2 c g); what it takes is all the energy."""
    c, v0 = 0.1, 2.0
    world = slope(0.0, c=c)
    ring = world.add(position=(0, R), velocity=(v0, 0), spin=-v0 / R, radius=R, mass=M, inertia=k * M * R * R)
    world.run(seconds=1.1 * (1 + k) * v0 / (c * G))
    assert ring.position[0, 0] == pytest.approx(v0**2 * (1 + k) / (2 * c * G), rel=1e-4)
    assert world.ledger.rolling == pytest.approx(-0.5 * M * (1 + k) * v0**2, rel=1e-3)


@DTYPES
@RINGS
def test_an_oblique_impact(k: float, dtype: Any) -> None:
    """A floor of enough friction stops the rim: J_t = -m s k / (1 + k), s = u + r w the slip (Walton and Braun 1986)."""
    world = slope(0.0, dtype=dtype, gravity=(0, 0))
    world.boundary = pv.Box((-100, 0), (100, 50), friction=5.0, restitution=0.8)
    ring = world.add(position=(0, 1), velocity=(3, -5), spin=2.0, radius=R, mass=M, inertia=k * M * R * R)
    world.run(seconds=0.3)
    slip = 3 + R * 2.0
    assert ring.velocity[0, 0] == pytest.approx(3 - slip * k / (1 + k), rel=1e-5)
    assert ring.spin[0] == pytest.approx(2.0 - slip / (1 + k) / R, rel=1e-4, abs=1e-5)
    assert world.energy().total == pytest.approx(world.ledger.total, rel=1e-5)


@pytest.mark.parametrize("dx", [0.0, 0.3])
@pytest.mark.parametrize("inertia", [(0.5, 0.05), (0.02, 1.0)])
def test_a_rough_impact_of_two_keeps_momenta(inertia: tuple[float, float], dx: float) -> None:
    """Momentum and angular momentum to rounding; friction takes m' s^2 / 2 with the slip s, if it stops the rims."""
    laws = pv.Collisions(friction=50.0, restitution=0.3)
    world = pv.World(boundary=pv.Open(), gravity=(0, 0), collisions=laws, dtype=np.float64, ledger=True)
    mass, radius, spin = np.array([1.0, 2.0]), np.array([0.5, 0.3]), np.array([3.0, -8.0])
    places, speeds = [(0, 0), (2, dx)], [(1, 0.5), (-1.5, 0)]
    group = world.add(position=places, velocity=speeds, spin=spin, mass=mass, radius=radius, inertia=inertia)
    before, whole = world.angular_momentum(), world.momentum()
    world.run(seconds=0.2)
    way, apart = group.position[1] - group.position[0], group.velocity[1] - group.velocity[0]  # straight, until they meet
    square = apart @ apart
    time = (-(way @ apart) - np.sqrt((way @ apart) ** 2 - square * (way @ way - 0.64))) / square
    n = (way + apart * time) / 0.8
    slip = apart[0] * n[1] - apart[1] * n[0] + radius @ spin
    inverse = (1 / mass + radius**2 / np.array(inertia)).sum()
    world.run(seconds=1.8)
    assert world.angular_momentum() == pytest.approx(before, abs=1e-12)
    assert world.momentum() == pytest.approx(whole, abs=1e-12)
    assert world.ledger.friction == pytest.approx(-0.5 * slip**2 / inverse, rel=1e-9)
    assert world.energy().total == pytest.approx(world.ledger.total, rel=1e-12)


@pytest.mark.parametrize("c", [0.0, 0.3])
def test_the_ledger_of_a_rough_crowd_closes(c: float) -> None:
    """Rings, balls and discs that hit each other, rub and roll. They keep their turn: friction of an impact acts at the middle
    of the distance of centres, which is not r_i + r_j where several meet at about the same time.
    """
    rng = np.random.default_rng(0)
    laws = pv.Collisions(friction=0.7, restitution=0.3, rolling_resistance=c)
    world = pv.World(boundary=pv.Open(), gravity=(0, 0), collisions=laws, dtype=np.float64, ledger=True)
    places = np.stack(np.meshgrid(np.arange(5.0), np.arange(5.0)), axis=-1).reshape(-1, 2)
    mass, radius = rng.uniform(1, 3, 25), rng.uniform(0.3, 0.45, 25)
    group = world.add(position=places, velocity=-1.5 * (places - 2), spin=rng.normal(0, 5, 25), mass=mass, radius=radius)
    group.inertia[:10] = mass[:10] * radius[:10] ** 2 * rng.uniform(0.2, 3, 10)
    before, whole = world.angular_momentum(), world.momentum()
    world.run(seconds=2.0)
    assert world.angular_momentum() == pytest.approx(before, rel=2e-5)
    assert world.momentum() == pytest.approx(whole, abs=1e-12)
    assert world.ledger.friction < -0.1
    assert world.energy().total == pytest.approx(world.ledger.total, rel=1e-12)
    assert abs(world.ledger.residual) < 1e-6 * world.energy().total


def test_a_motor_spins_up_a_flywheel() -> None:
    world = slope(0.0, gravity=(0, 0))
    ring = world.add(position=(0, 5), radius=R, mass=M, inertia=0.8)
    world.links.append(pv.Motor(ring, 0, speed=100.0, max_torque=2.0))
    world.run(seconds=1.0)
    assert ring.spin[0] == pytest.approx(2.0 / 0.8, rel=1e-12)
    assert world.ledger.motors == pytest.approx(0.5 * 0.8 * 2.5**2, rel=1e-12)


def test_it_can_be_changed() -> None:
    world = slope(0.2)
    group = world.add(position=[(0, R), (1, R), (2, R)], radius=R, mass=M, inertia=[0.1, 0.2, 0.3])
    group.inertia[1] = 0.0  # a disc again
    other = slope(0.2)
    other.add(position=[(1, R)], radius=R, mass=M)
    for each in (world, other):
        each.run(seconds=0.5)
    assert np.array_equal(group.velocity[1], other.velocity[0])
