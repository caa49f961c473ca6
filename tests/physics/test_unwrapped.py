"""Positions in a periodic room as if it did not repeat: what crosses the seam goes on, and nothing else changes."""

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

LOWER, PERIOD = np.array([-4.0, 1.0]), np.array([12.0, 9.0])
FRAME = 1 / 60
AXES = {"xy": (1, 1), "x": (1, 0), "y": (0, 1)}


def room(axes: str = "xy") -> pv.Periodic:
    return pv.Periodic(tuple(LOWER), tuple(LOWER + PERIOD), axes=axes, restitution=1.0)


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
