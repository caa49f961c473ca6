"""What a periodic room answers is what the nearest images say, found in NumPy over all of them."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv

LOWER, PERIOD = np.array([-3.0, 2.0]), np.array([10.0, 7.0])


def _world(axes: str) -> pv.World:
    rng = np.random.default_rng(5)
    world = pv.World(boundary=pv.Periodic(tuple(LOWER), tuple(LOWER + PERIOD), axes=axes), dtype=np.float64)
    world.add(position=rng.uniform(LOWER, LOWER + PERIOD, (60, 2)), radius=rng.uniform(0.1, 0.6, 60))
    return world


def _nearest(world: pv.World, way: np.ndarray) -> np.ndarray:
    period = np.array(world.boundary.seam.period)
    return np.asarray(way - period * np.rint(way / np.where(period > 0, period, np.inf)))


@pytest.mark.parametrize("axes", ["xy", "x", "y"])
@pytest.mark.parametrize("questions", [3, 40])
def test_points_and_neighbours(axes: str, questions: int) -> None:
    """Few questions are asked of all particles, many of cells. Points may be periods away."""
    world, rng = _world(axes), np.random.default_rng(7)
    points = rng.uniform(LOWER - 2 * PERIOD, LOWER + 3 * PERIOD, (questions, 2))
    far = np.hypot(*np.moveaxis(_nearest(world, world.position[None] - points[:, None]), 2, 0))
    found = world.nearest(points, k=5)
    order = np.argsort(far, axis=1, kind="stable")[:, :5]
    assert np.array_equal(found.particle, order)
    assert found.distance == pytest.approx(np.take_along_axis(far, order, 1), abs=1e-12)
    covered = np.where(far <= world.radius, far, np.inf)
    best = np.where(np.isfinite(covered.min(axis=1)), covered.argmin(axis=1), -1)
    assert np.array_equal(world.at_point(points), best)


@pytest.mark.parametrize("axes", ["xy", "x", "y"])
@pytest.mark.parametrize("size", [0.5, 3.0, 30.0])
def test_regions(axes: str, size: float) -> None:
    """A particle is in a region if one of its images is; once, however many are."""
    world, rng = _world(axes), np.random.default_rng(8)
    middle = rng.uniform(LOWER - PERIOD, LOWER + 2 * PERIOD, (20, 2))
    far = np.hypot(*np.moveaxis(_nearest(world, world.position[None] - middle[:, None]), 2, 0))
    assert np.array_equal(world.in_circle(middle, size), np.argwhere(far <= size))
    low, high = middle - np.array((size, 0.3)), middle + np.array((size, 0.4))
    period, inside = np.array(world.boundary.seam.period), np.ones((20, 60), bool)
    for axis in range(2):
        images = [world.position[None, :, axis] + k * period[axis] for k in (range(-6, 7) if period[axis] else (0,))]
        inside &= np.any([(low[:, None, axis] <= x) & (x <= high[:, None, axis]) for x in images], axis=0)
    assert np.array_equal(world.in_box(low, high), np.argwhere(inside))


@pytest.mark.parametrize("axes", ["xy", "x", "y"])
def test_rays_go_on_through_the_seam(axes: str) -> None:
    """Against the images in eleven by eleven rooms: |o + s d - c| = r of origin o, direction d, circle c, the smallest s >= 0."""
    world, rng = _world(axes), np.random.default_rng(9)
    start, angle, length = rng.uniform(LOWER, LOWER + PERIOD, (30, 2)), rng.uniform(0, 2 * np.pi, 30), 25.0
    heading = np.column_stack((np.cos(angle), np.sin(angle)))
    period = np.array(world.boundary.seam.period)
    shift = np.array([(i, j) for i in range(-5, 6) for j in range(-5, 6)]) * period
    image = (world.position[:, None] + shift).reshape(-1, 2)
    radius, owner = np.repeat(world.radius, len(shift)), np.repeat(np.arange(60), len(shift))
    way = image[None] - start[:, None]
    along, square = (way * heading[:, None]).sum(axis=2), (way**2).sum(axis=2)
    root = radius**2 - (square - along**2)
    far = np.where((root >= 0) & (along >= 0), along - np.sqrt(np.maximum(root, 0)), np.inf)
    far = np.where(square <= radius**2, 0.0, far)
    far = np.where(far <= length, far, np.inf)
    found = world.ray(start, heading, length, walls=False)
    assert found.distance == pytest.approx(far.min(axis=1), abs=1e-9)
    hit = np.isfinite(found.distance) & (found.distance > 0)  # from inside of two discs both are as near
    assert hit.sum() > 15
    assert np.array_equal(found.particle[hit], owner[far.argmin(axis=1)][hit])
    assert np.hypot(*found.normal[hit].T) == pytest.approx(1.0)
    assert ((found.normal[hit] * heading[hit]).sum(axis=1) <= 1e-9).all()


def test_a_ray_that_hits_nothing_ends() -> None:
    world = pv.World(boundary=pv.Periodic((0, 0), (4, 4)))
    world.add(position=(2, 2), radius=0.5)
    assert world.ray((0.5, 0.5), (1, 0)).particle[0] == -1
    assert world.ray((0.5, 0.5), (1, 1e-2)).particle[0] == 0  # it comes by in the end
