"""Positions in a periodic room as if it did not repeat: what crosses the seam goes on, and nothing else changes."""

from typing import Any

import numpy as np
import pytest
from tests.worlds import points

import pyverlet as pv

LOWER, PERIOD = np.array([-4.0, 1.0]), np.array([12.0, 9.0])
FRAME = 1 / 60
AXES = {"xy": (1, 1), "x": (1, 0), "y": (0, 1)}


def room(axes: str = "xy") -> pv.Periodic:
    return pv.Periodic(tuple(LOWER), tuple(LOWER + PERIOD), axes=axes, restitution=1.0)


def gas(count: int = 100, **options: Any) -> pv.World:
    """Elastic discs that meet, some of which cross a period in less than a frame."""
    world = pv.World(**{"gravity": (0, 0), "boundary": room(), "collisions": pv.Collisions(restitution=1.0), **options})
    rng = np.random.default_rng(5)
    place = (LOWER + 0.5 + points(np.arange(12), np.arange(9)))[:count]
    world.add(position=place, velocity=rng.normal(0, 20, (count, 2)), radius=rng.uniform(0.03, 0.4, count))
    return world


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("integrator", [pv.TimeCorrectedVerlet, pv.RK4])
def test_a_free_particle_flies_straight_on(dtype: Any, axes: str, integrator: Any) -> None:
    """x0 + v t, also where a frame is longer than several periods."""
    along = np.array(AXES[axes])
    velocity = (
        np.array([(3.0, 0.0), (-700.0, 0.0), (1500.0, 0.0)]) * along + np.array([(0, -2.0), (0, 40.0), (0, 1900.0)]) * along
    )
    world = pv.World(gravity=(0, 0), boundary=room(axes), collisions=None, dtype=dtype, integrator=integrator())
    start = LOWER + PERIOD * np.array([(0.1, 0.3), (0.5, 0.5), (0.9, 0.7)])
    balls = world.add(position=start, velocity=velocity, radius=0.1)
    assert world.unwrapped == pytest.approx(start, abs=1e-6)
    frames = 200
    world.run(seconds=frames / 60)
    # Each substep rounds a coordinate of at most a period and the way of a frame, by half a unit in the last place.
    rounding = frames * 8 * np.finfo(dtype).eps * (20 + np.abs(velocity) * FRAME)
    assert (np.abs(balls.unwrapped - (start + velocity * world.time)) <= rounding).all()
    inside = (world.position >= LOWER) & (world.position < LOWER + PERIOD)
    assert inside[:, along == 1].all()
    # What is between the two is whole periods.
    periods = (world.unwrapped - world.position) / PERIOD
    assert periods == pytest.approx(np.rint(periods), abs=1e-9)
    assert (periods[:, along == 0] == 0).all()


def test_a_gas_is_as_its_steps_add_up() -> None:
    """A second method: each frame's way to the nearest image, where none moves half a period in a frame."""
    world = gas(dtype=np.float64)
    summed, speed = world.unwrapped.copy(), 0.0
    for _ in range(300):
        before = world.position.copy()
        world.step(FRAME)
        summed += world.boundary.seam.nearest(world.position - before)
        speed = max(speed, float(np.abs(world.velocity).max()))
    assert speed * FRAME < 0.5 * PERIOD.min()
    assert (np.abs(world.unwrapped - world.position) > 3 * PERIOD).any()
    assert world.unwrapped == pytest.approx(summed, abs=300 * 16 * 1e-15 * 20)
    # The mean of all goes on with their momentum, which elastic impacts keep.
    mean = world.momentum() / world.mass.sum() * world.time
    assert (world.unwrapped - gas(dtype=np.float64).position).mean(axis=0) == pytest.approx(mean, abs=1e-10)


def test_brownian_particles_spread_as_einstein_says() -> None:
    """Kicked independently in each frame, v ~ N(0, s^2): <x^2> = s^2 dt^2 N in each direction."""
    count, frames, s = 4000, 200, 60.0
    world = pv.World(gravity=(0, 0), boundary=room(), collisions=None)
    world.add(position=np.broadcast_to(LOWER + PERIOD / 2, (count, 2)), radius=0.1)
    rng = np.random.default_rng(1)
    start = world.unwrapped
    for _ in range(frames):
        world.velocity[:] = rng.normal(0, s, (count, 2))
        world.step(FRAME)
    square = ((world.unwrapped - start) ** 2).mean(axis=0) / (s * FRAME) ** 2 / frames
    assert square == pytest.approx([1, 1], abs=5 * np.sqrt(2 / count))  # five times the deviation of a sample's variance


def test_what_is_added_or_written_outside_is_there() -> None:
    world = pv.World(gravity=(0, 0), boundary=room(), dtype=np.float64)
    far = LOWER + PERIOD * (3.25, -1.5)
    balls = world.add(position=[far, LOWER + 1], radius=0.2)
    assert balls.unwrapped == pytest.approx(np.array([far, LOWER + 1]))
    assert balls.position[0] == pytest.approx(LOWER + PERIOD * (0.25, 0.5))
    balls.position[1] += 2 * PERIOD
    world.step(FRAME)
    assert balls.unwrapped[1] == pytest.approx(LOWER + 1 + 2 * PERIOD)
    assert balls[1].unwrapped == pytest.approx(LOWER + 1 + 2 * PERIOD)
    world.boundary = pv.Periodic(tuple(LOWER), tuple(LOWER + 2 * PERIOD))  # of another room: the way so far counts
    world.step(FRAME)
    assert balls.unwrapped[1] == pytest.approx(LOWER + 1 + 2 * PERIOD)


def test_elsewhere_it_is_the_position_and_is_only_read() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (9, 9)))
    ball = world.add(position=[(2, 3), (4, 3)])
    world.run(seconds=1)
    assert world.unwrapped.tolist() == world.position.astype(float).tolist()
    for thing in (world, ball, ball[0]):
        with pytest.raises(pv.InputError, match="unwrapped is only to be read; allowed is to write position"):
            thing.unwrapped = 0
    with pytest.raises(ValueError, match="read-only"):
        ball.unwrapped[0] = 1


def test_threads_and_slots_in_another_order_count_alike() -> None:
    """More than a thousand discs are sorted by their places: the periods go with them."""
    worlds = []
    for threads in (1, 2):
        world = pv.World(
            gravity=(0, 0), boundary=room(), collisions=pv.Collisions(restitution=1.0), threads=threads, dtype=np.float64
        )
        rng = np.random.default_rng(0)
        x, y = np.meshgrid(np.arange(0.1, 12, 0.25), np.arange(0.1, 9, 0.25))
        start = LOWER + np.column_stack((x.ravel(), y.ravel()))
        world.add(position=start, velocity=rng.normal(0, 30, (x.size, 2)), radius=0.05)
        summed = world.unwrapped.copy()
        for _ in range(20):
            before = world.position.copy()
            world.step(FRAME)
            summed += world.boundary.seam.nearest(world.position - before)
        assert world.unwrapped == pytest.approx(summed, abs=1e-10)
        worlds.append(world)
    assert worlds[0].unwrapped.tolist() == worlds[1].unwrapped.tolist()
