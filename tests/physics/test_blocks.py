"""What lies close together and falls as one: a blow on all at once raises no energy.

Contacts without restitution only take energy, and no step length changes that: E_n+1 <= E_n. What is left are impulses of the
last substep that still push while pairs part, as far as 16 sweeps do not take them back: 5e-3 of m g H in a frame, a tenth of
what two left. The limiter takes that.
"""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv

G, RADIUS = 9.81, 0.5
RISE = 5e-3  # of m g H in a frame


def lattice(count: int, columns: int, *, hexagonal: bool, seed: int = 0) -> np.ndarray:
    """(count, 2) m: rows of circles 1 % apart, shaken by half of that."""
    row, column = np.divmod(np.arange(count), columns)
    apart = 2.02 * RADIUS
    x = apart * (column + 0.5 * hexagonal * (row % 2)) + 1.01 * RADIUS
    y = apart * row * (np.sqrt(0.75) if hexagonal else 1.0) + RADIUS
    return np.column_stack((x, y)) + np.random.default_rng(seed).uniform(-0.005, 0.005, (count, 2))


def largest_rise(world: pv.World, seconds: float, steps: tuple[float, ...] = (1 / 60,)) -> float:
    """J, by which the energy rises in a frame at most, with what the limiter has taken."""
    rng, rise, taken = np.random.default_rng(0), 0.0, 0.0
    while world.time < seconds:
        before = world.energy().total
        world.step(float(rng.choice(steps)))
        rise = max(rise, world.energy().total - before + taken - world.ledger.limiter)
        taken = world.ledger.limiter
    return rise


def dropped(count: int, columns: int, *, hexagonal: bool, collisions: pv.Collisions, **options: object) -> tuple[pv.World, float]:
    """A block 10 m above the floor of a box that is not much wider, and its m g H, J."""
    position = lattice(count, columns, hexagonal=hexagonal) + np.array((0, 10))
    width, height = 2.02 * RADIUS * (columns + 1) + 2, float(position[:, 1].max()) + RADIUS
    walls = {"restitution": collisions.restitution, "friction": collisions.friction}
    world = pv.World(boundary=pv.Box((0, 0), (width, 2 * height), **walls), collisions=collisions, ledger=True, **options)  # type: ignore[arg-type]
    world.add(position=position, radius=RADIUS)
    return world, count * G * height


@pytest.mark.parametrize("dtype", [np.float32, pytest.param(np.float64, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("restitution", "friction"), [(0.0, 0.0), (0.0, 0.6), (0.5, 0.3)])
@pytest.mark.parametrize("hexagonal", [False, True])
def test_a_block_that_falls_gains_nothing(hexagonal: bool, restitution: float, friction: float, dtype: type) -> None:
    material = pv.Collisions(restitution=restitution, friction=friction)
    world, scale = dropped(200, 16, hexagonal=hexagonal, collisions=material, dtype=dtype)
    assert largest_rise(world, 4.0) < RISE * scale  # it was 5e-2


@pytest.mark.parametrize(("steps", "bar"), [((1 / 240, 1 / 60), RISE), ((1 / 60, 1 / 30), RISE), ((1 / 60, 0.25), RISE)])
def test_nor_does_it_in_frames_of_changing_length(steps: tuple[float, ...], bar: float) -> None:
    world, scale = dropped(200, 16, hexagonal=True, collisions=pv.Collisions(friction=0.6))
    assert largest_rise(world, 4.0, steps) < bar * scale


def test_a_tower_that_falls_gains_nothing() -> None:
    # 25 rows: a blow goes through all of them.
    world, scale = dropped(150, 6, hexagonal=False, collisions=pv.Collisions(friction=0.6))
    assert largest_rise(world, 4.0) < RISE * scale


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_a_lattice_that_slides_into_the_bottom_of_a_cage_gains_nothing(friction: float) -> None:
    size = np.sqrt(200 * RADIUS**2 / 0.5)
    axis = np.arange(-12, 13) * 2.04 * RADIUS
    x, y = np.meshgrid(axis, axis)
    position = np.column_stack((x.ravel(), y.ravel()))
    position = position[np.hypot(*position.T) < size - 1.1 * RADIUS]
    position = position[np.argsort(-position[:, 1], kind="stable")][:200] + np.random.default_rng(0).uniform(
        -0.005, 0.005, (200, 2)
    )
    world = pv.World(boundary=pv.Circle(radius=size, friction=friction), collisions=pv.Collisions(friction=friction), ledger=True)
    world.add(position=position, radius=RADIUS)
    assert largest_rise(world, 4.0) < RISE * 200 * G * size


@pytest.mark.parametrize("hexagonal", [False, True])
def test_a_block_of_unequal_masses_crashes(hexagonal: bool) -> None:
    # 1:100, at 17 m/s: sweeps settle light circles between heavy ones slowly. It was 1e-1.
    world, scale = dropped(200, 16, hexagonal=hexagonal, collisions=pv.Collisions(friction=0.3))
    world.mass = 10 ** np.random.default_rng(1).uniform(0, 2, 200)
    assert largest_rise(world, 4.0) < 1e-2 * scale * float(world.mass.mean())
