"""Piles settle, stay together and lose energy only; nothing escapes; crowded starts come apart."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.world.frames import PUSH_OUT

G = 9.81
RADIUS = 0.5


def cage(n: int, *, seed: int = 0, **options: object) -> tuple[pv.World, pv.Group]:
    """n circles of radius 0.5 m on a shaken lattice in a cage of which they fill 60 %."""
    size = np.sqrt(0.25 * n / 0.6)
    axis = np.arange(-size, size, 1.05)
    x, y = np.meshgrid(axis, axis)
    position = np.column_stack((x.ravel(), y.ravel()))
    position = position[np.argsort(np.hypot(*position.T), kind="stable")][:n]
    position += np.random.default_rng(seed).uniform(-0.02, 0.02, position.shape)
    world = pv.World(boundary=pv.Circle(radius=size), **options)  # type: ignore[arg-type]
    return world, world.add(position=position, radius=RADIUS)


@pytest.mark.parametrize("n", [1500, pytest.param(20_000, marks=pytest.mark.slow)])
def test_a_cage_settles(n: int) -> None:
    world, _ = cage(n)
    scale = n * G * world.boundary.extent()[3]  # type: ignore[index]
    energy = [world.energy().total]
    for _ in range(15 * 60):
        world.step(1 / 60)
        energy.append(world.energy().total)
        assert world.escaped() == 0
    overlap = world.overlap()
    assert overlap.mean <= 0.003
    assert overlap.max <= 0.05
    assert overlap.contacts > n
    # No frame gains more than 1e-4 of the scale. A second may, by a little: overlap is compressed height, 0.2 % of 130 layers is
    # worth n g (0.002 * 130 m) / 2 = 25 kJ or 1.4e-3, and a rebuilt list, solved in another order, finds another share of it.
    assert np.diff(energy).max() < 1e-4 * scale
    assert (np.array(energy) - np.minimum.accumulate(energy)).max() < 1.4e-3 * scale
    assert energy[-1] < energy[0] - 0.2 * scale
    assert world.energy().kinetic < 0.05 * n * G * RADIUS


@pytest.mark.parametrize("name", pv.integrators.BY_NAME)
def test_every_integrator_settles_a_small_cage(name: str) -> None:
    world, _ = cage(300, integrator=pv.integrators.BY_NAME[name]())
    world.run(seconds=5)
    assert world.escaped() == 0
    assert world.overlap().max < 0.02
    assert world.energy().kinetic < 0.05 * 300 * G * RADIUS


def test_overlap_falls_with_the_square_of_the_substeps() -> None:
    # At rest the lowest contact of a column of n needs an overlap of about 2 n g h^2 = 2 n g (dt / substeps)^2.
    n = 50
    bottom = []
    for substeps in (4, 8, 16):
        world = pv.World(boundary=pv.Box((0, 0), (2 * RADIUS, 4 * n * RADIUS)), substeps=substeps, dtype=np.float64)
        world.add(position=np.column_stack((np.full(n, RADIUS), RADIUS + np.arange(n) * 2 * RADIUS)), radius=RADIUS)
        world.run(seconds=10)
        bottom.append(world.overlap().max)
        assert bottom[-1] < 2 * n * G * (1 / 60 / substeps) ** 2
    assert bottom[0] > 3 * bottom[1] > 9 * bottom[2]


@pytest.mark.parametrize(
    "options",
    [
        {"restitution": 0.8},
        *(pytest.param(each, marks=pytest.mark.slow) for each in ({}, {"friction": 0.0}, {"radius_spread": 1.0})),
    ],
)
def test_a_bouncy_pile_of_mixed_circles_comes_to_rest(options: dict[str, float]) -> None:
    # Restitution is for arrivals. Mistaken for them, the trembling of small circles between large ones went on for ever, at
    # 5e-3 of m g R and 2 m/s.
    world = pv.scenes.get("box").world(particles=800, **options)
    world.run(seconds=15)
    assert world.escaped() == 0
    assert world.energy().kinetic < 1e-3 * float((world.mass * G * world.radius).sum())
    assert np.percentile(np.hypot(*world.velocity.T), 99) < 0.5


@pytest.mark.parametrize("substeps", [1, 8, 16])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_circles_added_on_top_of_each_other_part_slowly(substeps: int, dtype: type) -> None:
    # Springs push them apart by at most PUSH_OUT r a second, and the velocity of that is taken back in the same substep.
    world = pv.World(gravity=(0, 0), substeps=substeps, dtype=dtype)
    balls = world.add(position=[(0.0, 0.0), (0.3, 0.0)], radius=RADIUS)
    apart, eps = 0.3, float(np.finfo(dtype).eps)
    for _ in range(120):
        world.step(1 / 60)
        before, apart = apart, float(balls.position[1, 0] - balls.position[0, 0])
        assert before - eps <= apart <= before + PUSH_OUT * RADIUS / 60 + eps
        # Rounded by an eps of it in each of the sweeps, which are less than a hundred a frame.
        assert np.abs(balls.velocity).max() <= 100 * eps * PUSH_OUT * RADIUS
    assert apart == pytest.approx(2 * RADIUS, rel=2e-3)
