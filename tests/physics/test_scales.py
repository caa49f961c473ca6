"""Worlds of any size: what is scaled in length and mass is the same world, and slow worlds take long frames in few substeps."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.world.long_frames import parts_of

GRAVITATION = 6.674e-11


def built(length: float, mass: float, dtype: str, *, friction: float, linked: bool) -> pv.World:
    """Thrown discs, obstacles, links and drag; lengths and masses times these powers of two: all roundings are the same."""
    rng = np.random.default_rng(1)
    world = pv.World(
        gravity=(0, -9.75 * length),
        boundary=pv.Box((0, 0), (12 * length, 12 * length), restitution=0.5, friction=friction),
        collisions=pv.Collisions(restitution=0.5, friction=friction, rolling_resistance=friction / 8),
        dtype=dtype,
    )
    k = np.arange(36)
    place, speed, radius = (
        rng.integers(*span, (36, *shape)) / 256 for span, shape in (((0, 40), (2,)), ((-800, 800), (2,)), ((60, 140), ()))
    )
    place += np.column_stack((1.5 + 1.375 * (k % 7), 1.5 + 1.375 * (k // 7)))
    discs = world.add(position=place * length, velocity=speed * length, radius=radius * length, mass=(1 + k % 3) * mass)
    world.obstacles.append(pv.Segment((2 * length, 10 * length), (5 * length, 11 * length)))
    world.obstacles.append(pv.Disc((9 * length, 10.5 * length), 0.5 * length))
    world.forces.append(pv.Drag(linear=0.125 * mass))
    if linked:
        world.links.append(pv.Stick(discs, [0, 1], [1, 2]))
        world.links.append(pv.Spring(discs, 10, 11, stiffness=64.0 * mass, damping=0.5 * mass))
    return world


def grains(length: float, mass: float, dtype: str, *, elastic: bool) -> pv.World:
    """Discs of radii of 1:10, of densities too: a pile that has come to rest in the end, or a gas in a cage."""
    rng, k = np.random.default_rng(1), np.arange(144)
    room = pv.Circle(center=(9.5 * length, 4.5 * length), radius=12 * length, restitution=1.0)
    box = pv.Box((0, 0), (20 * length, 15 * length), friction=0.4)
    law = pv.Collisions(restitution=1.0) if elastic else pv.Collisions(friction=0.4)
    world = pv.World(gravity=(0, 0 if elastic else -10 * length), boundary=room if elastic else box, collisions=law, dtype=dtype)
    place, speed = 1.0 + np.column_stack((k % 18, k // 18)), np.round(128 * rng.normal(0, elastic, (144, 2))) / 64
    radius = np.round(256 * rng.uniform(0.05, 0.45, 144)) / 256
    world.add(position=place * length, velocity=speed * length, radius=radius * length, mass=(1 + k % 3) * mass)
    return world


KINDS: dict[str, tuple[Callable[..., pv.World], dict[str, Any], int]] = {
    "smooth": (built, {"friction": 0.0, "linked": False}, 32), "rough and linked": (built, {"friction": 0.5, "linked": True}, 32),
    "gas": (grains, {"elastic": True}, 120), "pile": (grains, {"elastic": False}, 300),
}  # fmt: skip


@pytest.mark.parametrize(("length", "mass"), [(2.0**10, 1.0), (2.0**-20, 2.0**-40), (1.0, 2.0**12)])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_lengths_and_masses_may_be_scaled(dtype: str, kind: str, length: float, mass: float) -> None:
    make, how, frames = KINDS[kind]
    plain, scaled = (make(*scale, dtype, **how) for scale in ((1.0, 1.0), (length, mass)))
    for world in (plain, scaled):
        for _ in range(frames):
            world.step(1 / 64)
    assert np.array_equal(scaled.position, plain.position * plain.dtype.type(length))
    assert np.array_equal(scaled.velocity, plain.velocity * plain.dtype.type(length))
    assert kind != "pile" or np.abs(plain.velocity).max() < 1e-3


@pytest.mark.parametrize("dt", [10.0, 600.0])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_moons_collide_in_frames_of_minutes(restitution: float, dt: float) -> None:
    # From rest at a distance of 4 r two equal moons meet with v^2 = 2 G m (1 / 2 r - 1 / 4 r) each relative to both, and
    # separate to d with 1 / d = 1 / 2 r - e^2 / 4 r. The energy of the way there is that of the integrator: (v h / r)^2 of it.
    radius, mass = 1e6, 7e22
    world = pv.World(gravity=(0, 0), collisions=pv.Collisions(restitution=restitution), dtype="float64")
    moons = world.add(position=[(-2 * radius, 0), (2 * radius, 0)], radius=radius, mass=mass)
    world.forces.append(pv.Gravitation(strength=GRAVITATION))
    farthest, met, parts = 0.0, False, 0
    for _ in range(round(12000 / dt)):
        world.step(dt)
        parts = max(parts, parts_of(world, dt))
        apart = float(np.diff(moons.position[:, 0])[0]) / radius
        met = met or apart < 2.05 or float(np.diff(moons.velocity[:, 0])[0]) > 0
        farthest = max(farthest, apart if met else 0.0)
    assert parts <= 20  # of a frame of ten minutes: as thirtieths of a second they were 18,000
    assert farthest == pytest.approx(1 / (0.5 - 0.25 * restitution**2), rel=2e-3, abs=0.06 * (restitution < 1))
    assert world.energy().total <= -GRAVITATION * mass**2 / (4 * radius) * (1 - 1e-3)


def test_long_frames_of_what_falls_on_earth_are_cut_as_ever() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (10, 10)))
    world.add(position=[(2, 0.5), (4, 0.5)], radius=0.5)
    world.step(1 / 60)
    assert [parts_of(world, dt) for dt in (1 / 60, 1 / 30, 0.05, 0.25)] == [1, 1, 2, 8]


def test_where_nothing_moves_a_frame_may_be_of_any_length() -> None:
    world = pv.World(gravity=(0, 0), boundary=pv.Circle(radius=10))
    world.add(position=[(0, 0), (3, 0)], radius=0.5)
    world.step(1e6)
    assert world.time == 1e6
    assert np.array_equal(world.position, [(0, 0), (3, 0)])
