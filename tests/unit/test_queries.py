"""Queries against brute force in NumPy, for worlds of all kinds, and exact answers where they are known."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.worlds import thing_of

import pyverlet as pv
from pyverlet.laws.obstacles import ObstacleArrays, Obstacles
from pyverlet.state.periodicity import Periodicity

AXES = ("xy", "x", "y")
LOWER, PERIOD = np.array([-3.0, 2.0]), np.array([10.0, 7.0])
worlds = st.tuples(
    st.integers(0, 60), st.integers(0, 2**31), st.sampled_from(["even", "line", "cluster", "lattice", "far", *AXES])
)


def make(kind: tuple[int, int, str], dtype: Any = np.float64) -> tuple[pv.World, np.random.Generator]:
    count, seed, shape = kind
    rng = np.random.default_rng(seed)
    where = rng.uniform(-10, 10, (count, 2))
    if shape == "line":
        where[:, 1] = 0.0
    elif shape == "cluster":
        where *= np.where(rng.random((count, 1)) < 0.8, 0.01, 1.0)
    elif shape == "lattice":
        where = np.round(where / 4) * 4  # coincident ones, and equal distances
    elif shape == "far" and count:
        where[0] = 1e5
    elif shape in AXES:
        where = LOWER + PERIOD * (where + 10) / 20
    room = pv.Periodic(tuple(LOWER), tuple(LOWER + PERIOD), axes=shape) if shape in AXES else pv.Open()
    world = pv.World(boundary=room, dtype=dtype)
    world.add(position=where, radius=rng.uniform(0.05, 0.6 if shape in AXES else 2.0, count))
    return world, rng


def points_for(rng: np.random.Generator, world: pv.World, count: int = 25) -> Any:
    """Of periodic rooms, points up to two periods away."""
    points = rng.uniform(-14, 14, (count, 2))
    if len(world):
        points[: count // 3] = world.position[rng.integers(0, len(world), count // 3)]
    return points


def apart(points: Any, world: pv.World) -> Any:
    """(q, n) squares of distances; in a periodic room to the nearest images."""
    offset, period = world.position.astype(float) - points[:, None], np.array(world.boundary.periodic.period)
    offset -= period * np.rint(offset / np.where(period > 0, period, np.inf))
    return offset[..., 0] * offset[..., 0] + offset[..., 1] * offset[..., 1]


@settings(max_examples=120, deadline=None)
@given(worlds, st.sampled_from([np.float32, np.float64]))
def test_at_point_equals_brute_force(kind: tuple[int, int, str], dtype: Any) -> None:
    world, rng = make(kind, dtype)
    points = points_for(rng, world)
    square = apart(points, world)
    square[square > world.radius.astype(float) ** 2] = np.inf
    expected = np.full(len(points), -1)
    if len(world):
        covered = np.isfinite(square).any(axis=1)
        expected[covered] = square.argmin(axis=1)[covered]
    assert world.at_point(points).tolist() == expected.tolist()


@settings(max_examples=120, deadline=None)
@given(worlds, st.integers(1, 9))
def test_nearest_equals_brute_force(kind: tuple[int, int, str], k: int) -> None:
    world, rng = make(kind)
    points = points_for(rng, world)
    square = apart(points, world)
    order = np.argsort(square, axis=1, kind="stable")[:, :k]
    missing = k - order.shape[1]
    found = world.nearest(points, k)
    assert found.particle.tolist() == np.pad(order, ((0, 0), (0, missing)), constant_values=-1).tolist()
    distance = np.sqrt(np.take_along_axis(square, order, axis=1))
    assert found.distance == pytest.approx(np.pad(distance, ((0, 0), (0, missing)), constant_values=np.inf), rel=1e-15)


@settings(max_examples=120, deadline=None)
@given(worlds)
def test_regions_equal_brute_force(kind: tuple[int, int, str]) -> None:
    world, rng = make(kind)
    middle, size = points_for(rng, world), rng.uniform(0, 8, 25)
    low, high = middle - rng.uniform(0, 6, (25, 2)), middle + rng.uniform(0, 6, (25, 2))
    low[:4, 0], high[:4, 0], size[:4] = middle[:4, 0] - 30, middle[:4, 0] + 30, 30  # several periods
    in_box = np.ones((25, len(world)), bool)
    for axis, period in enumerate(world.boundary.periodic.period):  # a particle is in a region if one of its images is; once
        images = [world.position[:, axis] + k * period for k in (range(-9, 10) if period else (0,))]
        in_box &= np.any([(low[:, axis, None] <= x) & (x <= high[:, axis, None]) for x in images], axis=0)
    assert world.in_box(low, high).tolist() == np.argwhere(in_box).tolist()
    in_circle = apart(middle, world) <= (size * size)[:, None]
    assert world.in_circle(middle, size).tolist() == np.argwhere(in_circle).tolist()
    assert world.in_box(low[0], high[0]).tolist() == np.flatnonzero(in_box[0]).tolist()
    assert world.in_circle(middle[0], size[0]).tolist() == np.flatnonzero(in_circle[0]).tolist()


@pytest.mark.parametrize("kind", ["even", *AXES])
def test_few_questions_get_the_answers_of_many(kind: str) -> None:
    world, rng = make((60, 3, kind))
    points, heading = points_for(rng, world, 40), rng.normal(0, 1, (40, 2))
    many = (world.at_point(points), world.nearest(points, 5).particle, world.ray(points, heading).particle)
    for k in range(40):
        assert world.at_point(points[k]) == many[0][k]
        assert world.nearest(points[k], 5).particle[0].tolist() == many[1][k].tolist()
        assert world.ray(points[k], heading[k]).particle == many[2][k]


def test_answers_name_the_users_particles_while_the_world_runs() -> None:
    world = pv.World(boundary=pv.Box((0, 0), (30, 30)))
    rng = np.random.default_rng(0)
    world.add(position=rng.uniform(1, 29, (400, 2)), radius=0.3)
    world.run(seconds=1)
    assert world.nearest(world.position).particle[:, 0].tolist() == list(range(400))
    assert (world.nearest(world.position).distance == 0).all()
    world.remove(np.arange(0, 400, 2))
    assert world.nearest(world.position).particle[:, 0].tolist() == list(range(200))
    assert len(world.at_point(np.zeros((0, 2)))) == 0
    assert world.in_box((0, 0), (30, 30)).tolist() == list(range(200))


# ---- Rays in periodic rooms ----


@pytest.mark.parametrize("axes", AXES)
def test_rays_go_on_through_the_boundary(axes: str) -> None:
    """Against the images in eleven by eleven rooms: |o + s d - c| = r of origin o, direction d, circle c, the smallest s >= 0."""
    world, rng = make((60, 9, axes))
    start, angle, length = rng.uniform(LOWER, LOWER + PERIOD, (30, 2)), rng.uniform(0, 2 * np.pi, 30), 25.0
    heading = np.column_stack((np.cos(angle), np.sin(angle)))
    period = np.array(world.boundary.periodic.period)
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


# ---- Which obstacles cover points, and which are the nearest: against distances from all sides, one by one ----


def shapes(chance: np.random.Generator) -> list[pv.Obstacle]:
    """Lines, discs and polygons in [-20, 20]^2, some of which move."""
    found: list[pv.Obstacle] = []
    for k in range(60):
        at, to = chance.uniform(-20, 20, 2), chance.normal(0, 2, 2)
        more: dict[str, Any] = {"velocity": chance.normal(0, 3, 2), "angular_velocity": 2.0} if k % 3 == 0 else {}
        if k % 4 == 0:
            found.append(pv.Disc(tuple(at), chance.uniform(0.2, 1), **more))
        elif k % 4 == 1:
            found.append(pv.Polygon(at + np.array([(0, 0), (2, 0), (1, 1.5)]), radius=0.1 * (k % 3), **more))
        else:
            found.append(pv.Capsule(tuple(at), tuple(at + to), radius=0.1, **more))
    return found


@pytest.mark.parametrize("within", [0.0, 0.5])
@pytest.mark.parametrize("ahead", [0.0, 0.2])
def test_distances_are_those_from_the_nearest_sides(ahead: float, within: float) -> None:
    chance = np.random.default_rng(3)
    obstacles = Obstacles()
    obstacles.extend(shapes(chance))
    points = chance.uniform(-22, 22, (300, 2))
    arrays = ObstacleArrays(obstacles)
    arrays.begin()
    row, which = (each.ravel() for each in np.indices((len(points), len(obstacles) + 1)))
    gap, normal = arrays.facing(points[row], which, within=within, ahead=ahead)
    things = [thing_of(each, ahead)._replace(solid=False) for each in obstacles]
    far = np.column_stack([each.gap(points) for each in things])
    assert np.isnan(gap[which == len(obstacles)]).all()  # there is no such obstacle
    row, which, gap, normal = (each[which < len(obstacles)] for each in (row, which, gap, normal))
    assert gap == pytest.approx(far[row, which], abs=1e-12)
    # From outside, a step of the gap against the normal ends at the rim.
    there = points[row] - gap[:, None] * normal
    for k, each in enumerate(things):
        assert each.gap(there[which == k])[gap[which == k] > 0] == pytest.approx(0.0, abs=1e-9)


def test_the_first_of_those_that_have_a_point_inside_covers_it() -> None:
    chance = np.random.default_rng(4)
    obstacles = Obstacles()
    obstacles.extend(shapes(chance))
    points = chance.uniform(-21, 21, (2000, 2))
    arrays = ObstacleArrays(obstacles, Periodicity(-20.0, -20.0, 40.0, 40.0))
    inside = np.zeros((len(points), len(obstacles)), bool)
    for shift in [(x, y) for x in (-40, 0, 40) for y in (-40, 0, 40)]:
        for k, each in enumerate(obstacles):
            inside[:, k] |= thing_of(each).image(np.array(shift)).gap(arrays.periodic.wrapped(points)) < 0
    expected = np.where(inside.any(axis=1), inside.argmax(axis=1), -1)
    assert (expected >= 0).sum() > 80
    assert arrays.covering(points).tolist() == expected.tolist()


def test_obstacles_that_move_are_found_where_they_have_come() -> None:
    world = pv.World(gravity=(0, 0))
    world.add(position=(50, 50))
    world.obstacles.append(pv.Disc((0, 0), 1.0, velocity=(6.0, 0)))
    points = np.array([(0.0, 0.0), (6.0, 0.0), (1e300, 0.0)])
    assert world._obstacle_arrays.covering(points).tolist() == [0, -1, -1]
    world.run(seconds=1)
    assert world._obstacle_arrays.covering(points).tolist() == [-1, 0, -1]
