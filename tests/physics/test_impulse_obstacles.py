"""Obstacles and pinned circles under the contact law, against closed forms and conservation laws."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

DT, H, G, R = 1 / 60, 1 / 480, 9.81, 0.25


def law(**more: Any) -> pv.Collisions:
    return pv.Collisions(**more)


def world_with(*obstacles: pv.Obstacle, **options: Any) -> pv.World:
    world = pv.World(**{"collisions": law(), "dtype": np.float64, "threads": 1, **options})
    world.obstacles.extend(obstacles)
    return world


def tilted(angle: float, **surface: Any) -> tuple[pv.Segment, Any, Any]:
    """A long segment that falls to the right by an angle, with its direction and its normal."""
    way, normal = np.array([np.cos(angle), -np.sin(angle)]), np.array([np.sin(angle), np.cos(angle)])
    start, end = (-40 * way).tolist(), (40 * way).tolist()
    return pv.Segment(start, end, **surface), way, normal


# ---- impacts ---------------------------------------------------------------------------------------------------------------


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
    rubbed = min(mu * (1 + e) * into, along / 3)
    assert disc.velocity[0] @ normal == pytest.approx(e * into, rel=1e-12)
    assert disc.velocity[0] @ way == pytest.approx(along - rubbed, rel=1e-12)
    assert disc.spin[0] == pytest.approx(-2 * rubbed / R, rel=1e-12)


def test_a_field_of_round_pegs_keeps_the_energy_of_elastic_discs() -> None:
    # Impacts in closed form at their times: nothing but rounding changes the energy, for some 2,000 of them.
    x, y = np.meshgrid(np.arange(0.0, 9), np.arange(0.0, 6))
    pegs = [pv.Disc((a + 0.5 * (b % 2), b), 0.2, restitution=1.0) for a, b in zip(x.ravel(), y.ravel(), strict=True)]
    world = world_with(*pegs, boundary=pv.Box((-1, -1), (10, 7), restitution=1.0), collisions=law(restitution=1.0))
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


# ---- sliding, rolling, resting ---------------------------------------------------------------------------------------------


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
    world = world_with(*floor, collisions=law(friction=0.3), boundary=pv.Box((-6, -1), (6, 30)))
    x, y = np.meshgrid(np.arange(-3, 3.1, 0.55), np.arange(4.0, 9, 0.55))
    world.add(position=np.column_stack((x.ravel() + 0.05 * y.ravel(), y.ravel())), radius=R)
    world.run(seconds=8, dt=DT)
    energy = [world.energy().total]
    for dt in np.random.default_rng(2).choice([1 / 240, 1 / 60, 1 / 30], 120):
        world.step(float(dt))
        energy.append(world.energy().total)
    assert np.diff(energy).max() <= 1e-5 * float(world.mass.sum()) * G * 6


def test_a_disc_rolls_along_a_thousand_segments_as_over_one() -> None:
    x = np.linspace(-5, 45, 1001)
    floor = np.column_stack((x, 0 * x))
    ways = []
    for obstacle in (pv.Segment((-5, 0), (45, 0), friction=0.5), pv.Chain(floor, friction=0.5)):
        world = world_with(obstacle)
        disc = world.add(position=(0, R), velocity=(9, 0), spin=-9 / R, radius=R)
        for _ in range(180):
            world.step(DT)
            assert disc.position[0, 1] == pytest.approx(R, abs=1e-12)
        ways.append((*disc.position[0], *disc.velocity[0], disc.spin[0]))
    assert ways[0] == pytest.approx((27, R, 9, 0, -9 / R), rel=1e-9, abs=1e-12)
    assert ways[1] == pytest.approx(ways[0], rel=1e-12, abs=1e-12)


# ---- memory, bits, cost ----------------------------------------------------------------------------------------------------


def test_one_that_goes_leaves_the_others_what_they_carry() -> None:
    # A disc at rest on one segment does not notice that another is taken away, added or moved far from it.
    floor, other = pv.Segment((-1, 0), (1, 0)), pv.Segment((5, 0), (7, 0))
    world = world_with(other, floor)
    disc = world.add(position=(0, R), radius=R)
    world.run(seconds=0.5, dt=DT)
    for change in (world.obstacles.clear, lambda: setattr(floor, "friction", 0.1)):
        held = disc.position[0].copy()
        if change == world.obstacles.clear:
            world.obstacles.remove(other)
        else:
            world.obstacles.insert(0, pv.Disc((6, 3), 0.5))
            change()
        world.step(DT)
        assert disc.position[0] == pytest.approx(held, abs=1e-14)
        assert np.hypot(*disc.velocity[0]) < 1e-12
