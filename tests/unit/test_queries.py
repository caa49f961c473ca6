"""Queries against brute force in NumPy, for worlds of all kinds, and exact answers where they are known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import pyverlet as pv

worlds = st.tuples(st.integers(0, 60), st.integers(0, 2**31), st.sampled_from(["even", "line", "cluster", "lattice", "far"]))


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
    world = pv.World(dtype=dtype)
    world.add(position=where, radius=rng.uniform(0.05, 2.0, count))
    return world, rng


def points_for(rng: np.random.Generator, world: pv.World, count: int = 25) -> Any:
    points = rng.uniform(-14, 14, (count, 2))
    if len(world):
        points[: count // 3] = world.position[rng.integers(0, len(world), count // 3)]
    return points


def apart(points: Any, world: pv.World) -> Any:
    """(q, n) squares of distances."""
    offset = world.position.astype(float) - points[:, None]
    return offset[..., 0] * offset[..., 0] + offset[..., 1] * offset[..., 1]


@settings(max_examples=80, deadline=None)
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


@settings(max_examples=80, deadline=None)
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


@settings(max_examples=80, deadline=None)
@given(worlds)
def test_regions_equal_brute_force(kind: tuple[int, int, str]) -> None:
    world, rng = make(kind)
    middle, size = points_for(rng, world), rng.uniform(0, 8, 25)
    low, high = middle - rng.uniform(0, 6, (25, 2)), middle + rng.uniform(0, 6, (25, 2))
    x, y = world.position.T
    in_box = (x >= low[:, :1]) & (x <= high[:, :1]) & (y >= low[:, 1:]) & (y <= high[:, 1:])
    assert world.in_box(low, high).tolist() == np.argwhere(in_box).tolist()
    in_circle = apart(middle, world) <= (size * size)[:, None]
    assert world.in_circle(middle, size).tolist() == np.argwhere(in_circle).tolist()
    assert world.in_box(low[0], high[0]).tolist() == np.flatnonzero(in_box[0]).tolist()
    assert world.in_circle(middle[0], size[0]).tolist() == np.flatnonzero(in_circle[0]).tolist()


def test_few_questions_get_the_answers_of_many() -> None:
    world, rng = make((60, 3, "even"))
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


BAD: dict[str, tuple[Callable[[pv.World], Any], str]] = {
    "points": (lambda world: world.at_point((1, 2, 3)), r"points has shape \(3,\); allowed is \(n, 2\)"),
    "nan": (lambda world: world.nearest((np.nan, 0)), r"points\[0\] is \(nan, 0.0\)"),
    "k": (lambda world: world.nearest((0, 0), 0), r"k is 0; allowed is a whole number of at least 1"),
    "box": (lambda world: world.in_box((0, 0), (-1, 1)), r"upper\[0\] is \(-1.0, 1.0\); allowed is a corner above"),
    "rows": (lambda world: world.in_box(np.zeros((2, 2)), np.ones((3, 2))), r"upper has 3 rows; allowed are 1 or 2"),
    "circle": (lambda world: world.in_circle((0, 0), -1), r"radius\[0\] is -1; allowed is a finite number of at least 0"),
    "direction": (
        lambda world: world.ray((0, 0), (0, 0)),
        r"direction\[0\] is \(0.0, 0.0\); allowed is a direction other than 0",
    ),
    "length": (lambda world: world.ray((0, 0), (1, 0), -2), r"length\[0\] is -2; allowed is a number of at least 0"),
    "moving": (
        lambda world: world.circle_cast((0, 0), (1, 0), -1.0),
        r"radius\[0\] is -1; allowed is a finite number of at least 0",
    ),
    "area": (lambda world: world.overlap_area((0, 0), np.nan), r"radius\[0\] is nan; allowed is a finite number of at least 0"),
    "place": (lambda world: world.is_free((0, np.inf), 1.0), r"position\[0\] is \(0.0, inf\); allowed are finite numbers"),
    "mask": (lambda world: world.ray((0, 0), (1, 0), mask=-1), r"mask is -1; allowed are whole numbers of 32 bits"),
    "category": (
        lambda world: world.ray((0, 0), (1, 0), category=[1, 2]),
        r"category has shape \(2,\); allowed is one number or \(1,\)",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_gets_one_sentence(case: str) -> None:
    act, says = BAD[case]
    world = pv.World()
    world.add(position=(0, 0))
    with pytest.raises(pv.InputError, match=says):
        act(world)
