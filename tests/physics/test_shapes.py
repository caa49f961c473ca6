"""Obstacles of every shape push what touches them, not before it does, and never take or give energy if they are elastic."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

REACH, APART, DT = 0.3, 4.0, 1 / 60
"""Where a disc of radius 0.2 touches something round of radius 0.1, m; how far apart the round things are; a frame, s."""

OFFSETS = np.array([0.15, 0.5, 0.9, 0.999])
"""Of the reach: how far beside the centre the discs fall."""

GAPS = np.geomspace(1e-3, 2.0, 12)
"""Over where they would touch, m."""

ASIDE, ABOVE = (a.ravel() for a in np.meshgrid(OFFSETS, GAPS))
CENTRES = np.column_stack((APART * np.arange(len(ASIDE)), np.zeros(len(ASIDE))))


def discs(world: pv.World) -> None:
    world.obstacles.extend([pv.Disc(centre, 0.1) for centre in CENTRES.tolist()])


def ends(world: pv.World) -> None:
    world.obstacles.extend([pv.Capsule((x, y - 1.0), (x, y), radius=0.1) for x, y in CENTRES.tolist()])


def corners(world: pv.World) -> None:
    down = np.array(((0.0, 0.0), (-0.02, -1.0), (0.02, -1.0)))  # flat parts begin at 0.9998 of the reach
    world.obstacles.extend([pv.Polygon(centre + down, radius=0.1) for centre in CENTRES])


def pinned(world: pv.World) -> None:
    world.add(position=CENTRES, radius=0.1).pin()


def carried(world: pv.World) -> None:
    """Free ones, which a force holds against their weight."""
    world.add(position=CENTRES, radius=0.1, mass=1000.0)

    @pv.force
    def hold(x, y, vx, vy, mass, t):  # type: ignore[no-untyped-def]
        return np.zeros_like(x), np.where(mass > 10.0, 9.81 * mass, 0.0)

    world.forces.append(hold)


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize("put", [discs, ends, corners, pinned, carried])
def test_what_falls_past_something_round_is_not_pushed_before_it_is_there(
    put: Callable[[pv.World], None], friction: float
) -> None:
    """y = y0 - g t^2 / 2 while (REACH offset)^2 + y^2 > REACH^2: the two discs touch where y = sqrt(1 - offset^2) REACH."""
    world = pv.World(collisions=pv.Collisions(restitution=0.9, friction=friction), dtype="float64")
    put(world)
    height = np.sqrt(1.0 - ASIDE**2) * REACH + ABOVE
    falling = world.add(position=CENTRES + np.column_stack((ASIDE * REACH, height)), radius=0.2, mass=1.0)
    lands = np.sqrt(2.0 * ABOVE / 9.81)
    for _ in range(40):
        world.step(DT)
        free = world.time < lands - 1e-9
        np.testing.assert_allclose(falling.velocity[free, 0], 0.0, atol=1e-9)
        np.testing.assert_allclose(falling.velocity[free, 1], -9.81 * world.time, rtol=1e-9)
        touched = world.time > lands + 2 * DT
        assert (np.abs(falling.velocity[touched, 0]) > 1e-3).all(), "all have hit what is below them"


def test_what_turns_back_below_a_round_roof_does_not_bounce_there() -> None:
    """Thrown up inside a cage to heights h - gap below its roof: y = y0 + v t - g t^2 / 2 all the way."""
    for gap in GAPS[:8]:
        for x in (0.0, 1.5, 2.5):
            roof = np.sqrt(2.8**2 - x * x)
            world = pv.World(boundary=pv.Circle(center=(0, 0), radius=3.0), dtype="float64")
            up = np.sqrt(2 * 9.81 * (roof - gap))
            disc = world.add(position=(x, 0.0), velocity=(0.0, up), radius=0.2)
            while world.time < up / 9.81 + 0.2:
                world.step(DT)
                np.testing.assert_allclose(disc.velocity, [(0.0, up - 9.81 * world.time)], atol=1e-9)


@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("angle", [5.0, 20.0, 60.0, 89.0, 91.0, 150.0])
def test_pointed_corners_are_as_round_as_blunt_ones(angle: float, radius: float) -> None:
    """A disc that falls onto a corner touches it where it is r + radius away from its point, on either side of the point.

    All that do so within the angle between the normals of the two faces, which is that of the corner less than 180 degrees.
    """
    half, reach = np.radians(angle) / 2, 0.2 + radius
    sides = 1.5 * np.array(((0.0, 0.0), (-np.sin(half), -np.cos(half)), (np.sin(half), -np.cos(half))))
    aside = np.linspace(-0.98, 0.98, 15) * np.cos(half) * reach
    speed = np.repeat((1.0, 30.0), len(aside))
    aside = np.tile(aside, 2)
    centres = np.column_stack((4.0 * np.arange(len(aside)), np.zeros(len(aside))))
    world = pv.World(gravity=(0, 0), dtype="float64", collisions=pv.Collisions(restitution=1.0))
    world.obstacles.extend([pv.Polygon(c + sides, radius=radius, restitution=1.0) for c in centres])
    # They touch after 0.123 s, and bounce as from a disc: the normal is (sin b, cos b) with sin b = aside / reach.
    above = np.sqrt(reach**2 - aside**2) + 0.123 * speed
    discs = world.add(position=centres + np.column_stack((aside, above)), velocity=-speed[:, None] * (0, 1), radius=0.2)
    world.run(seconds=0.15, dt=DT)
    turn = 2 * np.arcsin(aside / reach)
    np.testing.assert_allclose(discs.velocity, speed[:, None] * np.column_stack((np.sin(turn), np.cos(turn))), atol=1e-6 * 30)


def shape_of(rng: np.random.Generator) -> pv.Obstacle:
    """A disc, capsule, line or polygon about the origin, elastic."""
    centre, kind, radius = rng.uniform(-1, 1, 2), rng.integers(5), rng.choice([0.0, 0.1])
    if kind == 0:
        return pv.Disc(tuple(centre), rng.uniform(0.1, 1.0), restitution=1.0)
    if kind == 1:
        ends = centre + rng.uniform(-1, 1, (2, 2))
        return pv.Capsule(*ends, radius=rng.choice([0.01, 0.1, 0.3]), restitution=1.0)
    if kind == 2:
        return pv.Segment(*(centre + rng.uniform(-1, 1, (2, 2))), restitution=1.0)
    if kind == 3:
        corners = centre + np.cumsum(rng.uniform(-0.7, 0.7, (rng.integers(3, 6), 2)), axis=0)
        return pv.Chain(corners, closed=bool(rng.random() < 0.4), radius=radius, restitution=1.0)
    angle = 2 * np.pi / 3 * np.arange(3) + rng.uniform(-0.9, 0.9, 3)
    flat = rng.choice([0.1, 1.0])
    return pv.Polygon(centre + np.column_stack((np.cos(angle), flat * np.sin(angle))), radius=radius, restitution=1.0)


@pytest.mark.parametrize("moves", [False, True])
def test_elastic_obstacles_of_any_shape_take_and_give_no_energy(moves: bool) -> None:
    """|v - V| of each disc is kept by an obstacle with velocity V, whether it is met by a face, an end or a corner, and however
    fast: at 40 m/s a disc of radius 0.02 moves four radii in a substep.
    """
    rng = np.random.default_rng(7)
    for _ in range(15):
        obstacle = shape_of(rng)
        obstacle.velocity = drift = rng.normal(0, 2, 2) if moves else np.zeros(2)
        world = pv.World(gravity=(0, 0), dtype="float64", collisions=None)
        world.obstacles.append(obstacle)
        angle, speed = rng.uniform(0, 2 * np.pi, 300), rng.choice([0.3, 2.0, 10.0, 40.0], 300)
        out = np.column_stack((np.cos(angle), np.sin(angle)))
        velocity = speed[:, None] * (rng.normal(0, 0.2, (300, 2)) - out) + drift
        discs = world.add(position=6 * out, velocity=velocity, radius=rng.choice([0.02, 0.2, 0.5], 300))
        world.run(seconds=2.0, dt=DT)
        np.testing.assert_allclose(np.hypot(*(discs.velocity - drift).T), np.hypot(*(velocity - drift).T), rtol=1e-9)


# ---- A world in pixels is as good as one in metres: gravity 1,000 pixels/s^2, radii of 2 to 20 ----
# All lengths times k are the same world if gravity is, too: times stay, speeds go with k, energies with k^2. So every promise is
# asked of a world in metres and of the same one in units of 1/40 m, with g = 1,000 instead of 25.


K = 40.0
"""Pixels a metre."""

G = 25.0
"""m/s^2: 1,000 pixels/s^2."""


def world(k: float, **options: Any) -> pv.World:
    return pv.World(gravity=(0, -G * k), boundary=pv.Box((0, 0), (20 * k, 15 * k), **options.pop("walls", {})), **options)


def rebound(k: float) -> float:
    """Part of its drop that a ball comes back to: e^2."""
    w = world(k, walls={"restitution": 0.8})
    ball = w.add(position=(5 * k, 6 * k), radius=0.2 * k)
    top = 0.0
    for _ in range(90):
        w.step(1 / 60)
        if ball.velocity[0, 1] > 0:
            top = max(top, float(ball.position[0, 1]) + float(ball.velocity[0, 1]) ** 2 / (2 * G * k))
    return (top - 0.2 * k) / (5.8 * k)


def gas(k: float) -> float:
    """Relative change of an elastic gas's energy in 2 s, without gravity."""
    rng = np.random.default_rng(0)
    w = world(k, walls={"restitution": 1.0}, collisions=pv.Collisions(restitution=1.0))
    w.gravity = (0, 0)
    place = np.stack(np.meshgrid(np.arange(12) + 1.0, np.arange(12) + 1.0), -1).reshape(-1, 2)
    w.add(position=place * k, velocity=rng.normal(0, 2, (144, 2)) * k, radius=rng.uniform(0.05, 0.45, 144) * k)
    start = w.energy().kinetic
    w.run(seconds=2)
    return w.energy().kinetic / start - 1


def rolling(k: float) -> float:
    """What is left of its speed when a sliding disc has come to roll: 2/3."""
    w = world(k, walls={"friction": 0.5})
    disc = w.add(position=(2 * k, 0.1 * k), velocity=(4 * k, 0), radius=0.1 * k)
    w.run(seconds=1.5)
    return float(disc.velocity[0, 0]) / (4 * k)


def slope(k: float) -> float:
    """Acceleration down a ramp of slope 1/2 over g: sin(a) / 1.5 of what rolls."""
    w = world(k)
    w.obstacles.append(pv.Segment((0, 10 * k), (20 * k, 0), friction=1.0))
    out = np.array((1.0, 2.0)) / np.sqrt(5)
    disc = w.add(position=(np.array((2.0, 9.0)) + 0.3 * out) * k, radius=0.3 * k)
    w.run(seconds=1)
    return float(np.hypot(*disc.velocity[0]) / (G * k) * 1.5 * np.sqrt(5))


def settled(k: float) -> tuple[float, float, float]:
    """Largest overlap of a pile of radii 2 to 20 pixels, its motion over m g r, and the most its energy has risen in a frame."""
    rng = np.random.default_rng(1)
    w = world(k, collisions=pv.Collisions(friction=0.4))
    place = np.stack(np.meshgrid(np.arange(18) + 1.0, np.arange(8) * 1.05 + 1.0), -1).reshape(-1, 2)
    w.add(position=place * k, radius=rng.uniform(0.05, 0.5, len(place)) * k, density=1.0)
    size = float(w.mass.sum()) * G * k * 15 * k
    before, rise = w.energy().total, 0.0
    for _ in range(420):
        w.step(1 / 60)
        now = w.energy().total
        rise, before = max(rise, (now - before) / size), now
    moves = w.energy().kinetic / float((w.mass.astype(float) * w.radius * G * k).sum())
    return w.overlap().max, moves, rise


def nobody_escapes(k: float) -> int:
    """Circles outside after a second of a room that they fill at 100 radii a substep."""
    rng = np.random.default_rng(2)
    w = world(k, walls={"restitution": 0.9}, collisions=None)
    w.add(position=rng.uniform(1, 14, (100, 2)) * k, velocity=rng.normal(0, 5e3, (100, 2)) * k, radius=0.1 * k)
    w.run(seconds=1)
    return w.escaped()


@pytest.mark.parametrize(
    ("promise", "paper", "within"),
    [(rebound, 0.64, 0.01), (gas, 0.0, 1e-4), (rolling, 2 / 3, 1e-3), (slope, 1.0, 5e-3), (nobody_escapes, 0, 0)],
)
@pytest.mark.parametrize("k", [1.0, K])
def test_promises_hold_in_pixels_as_in_metres(promise: Callable[[float], float], paper: float, within: float, k: float) -> None:
    assert promise(k) == pytest.approx(paper, abs=within)


@pytest.mark.parametrize("k", [1.0, K])
def test_a_pile_rests_in_pixels_as_in_metres(k: float) -> None:
    overlap, moves, rise = settled(k)
    assert overlap < 0.1
    assert moves < 1e-4
    assert rise <= 1e-4
