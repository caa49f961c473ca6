"""`pyverlet.fill`: nothing overlaps, by brute force; obstacles stay free; as much of the area is covered as was asked for."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import pyverlet as pv
from pyverlet import InputError

Floats = NDArray[np.float64]

ROOMS: dict[str, Any] = {
    "box": pv.Box((-3, 1), (4, 6)),
    "cage": pv.Circle(center=(2, -1), radius=4),
    "polygon": pv.Polygon([(0, 0), (6, 0), (3, 6)]),
    "corners": [(0, 0), (8, 0), (8, 6), (5, 6), (5, 2), (0, 2)],  # an L, which is not convex
}
AREA = {"box": 35.0, "cage": 16 * math.pi, "polygon": 18.0, "corners": 28.0}
OBSTACLES = [
    pv.Disc((2, 2), 0.8),
    pv.Capsule((0, 0.5), (3, 3), radius=0.2),
    pv.Polygon([(3, 1), (4, 1), (4, 2)]),
    pv.Segment((0, 4), (4, 4)),
]


def gaps(position: Floats, radius: Floats) -> Floats:
    """Of every pair, by brute force: the distance of the rims, m."""
    i, j = np.triu_indices(len(position), 1)
    return np.asarray(np.hypot(*(position[i] - position[j]).T) - radius[i] - radius[j])


def to_walls(where: Any, points: Floats) -> Floats:
    """How far inside each point is, m, by formulas of our own."""
    if isinstance(where, pv.Box):
        return np.asarray(np.minimum(points - where.lower, np.asarray(where.upper) - points).min(axis=1))
    if isinstance(where, pv.Circle):
        return np.asarray(where.radius - np.hypot(*(points - where.center).T))
    corners = np.asarray(where.points if isinstance(where, pv.Polygon) else where, float)
    away = np.full(len(points), np.inf)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = np.linspace(0, 1, 4001)[:, None] * (b - a) + a
        away = np.minimum(away, np.hypot(*(points[:, None] - along[None]).T).min(axis=0))
    return away


@pytest.mark.parametrize("radius", [0.15, (0.1, 0.3)], ids=["equal", "mixed"])
@pytest.mark.parametrize("pattern", ["hex", "square", "random"])
@pytest.mark.parametrize("name", ROOMS)
def test_nothing_overlaps(name: str, pattern: str, radius: Any) -> None:
    where = ROOMS[name]
    found = pv.fill(where, radius=radius, pattern=pattern, fraction=0.3)
    assert len(found.position) > 20
    assert gaps(*found[:2]).min() >= -1e-12
    # The brute-force distance to a polygon looks at points 1/4000 of a side apart: 8 m / 4000 / 2 off along it, less across.
    assert (to_walls(where, found.position) - found.radius).min() > -1e-6
    low, high = radius if isinstance(radius, tuple) else (radius, radius)
    assert found.radius.min() >= low
    assert found.radius.max() <= high


@pytest.mark.parametrize("pattern", ["hex", "square", "random"])
def test_obstacles_and_circles_are_left_free(pattern: str) -> None:
    world = pv.World(boundary=pv.Box((0, 0), (6, 6)))
    world.obstacles += OBSTACLES
    world.add(position=[(5, 5), (1, 5)], radius=[0.9, 0.4])
    found = pv.fill(world.boundary, radius=0.1, pattern=pattern, avoid=world, fraction=0.3)
    before = (world.position.astype(float), world.radius.astype(float))
    everybody = np.concatenate((found.position, before[0])), np.concatenate((found.radius, before[1]))
    assert gaps(*everybody).min() > -1e-6
    # Each outline is sampled densely: no point of it is within a circle.
    for obstacle in OBSTACLES:
        for outline in obstacle.outlines():
            sides = zip(outline.points, np.roll(outline.points, -1, axis=0), strict=True)
            line = np.concatenate([np.linspace(a, b, 200) for a, b in sides])
            assert np.hypot(*(found.position[:, None] - line[None]).T).min() > 0.1 - 2e-3
    world.add(position=found.position, radius=found.radius)
    assert world.overlap().max < 1e-5


@pytest.mark.parametrize(("pattern", "fraction"), [("hex", 0.6), ("square", 0.5), ("random", 0.4)])
@pytest.mark.parametrize("name", ROOMS)
def test_so_much_is_covered(name: str, pattern: str, fraction: float) -> None:
    found = pv.fill(ROOMS[name], radius=0.06, pattern=pattern, fraction=fraction)
    # The area is counted on 400 x 400 points: its rim, a few sides of a cell long, is off by less than 1 %.
    assert math.pi * (found.radius**2).sum() / AREA[name] == pytest.approx(fraction, rel=0.01)


def test_a_number_is_that_number() -> None:
    for pattern in ("hex", "square", "random"):
        assert len(pv.fill(pv.Box((0, 0), (10, 10)), radius=0.1, pattern=pattern, count=777).position) == 777


def test_densest_is_near_the_densest_there_is() -> None:
    found = pv.fill(pv.Box((0, 0), (40, 40)), radius=0.1)
    # Hexagonal: pi / sqrt(12) = 0.9069. The walls cost about one radius of each side's 40 m, and the gap 0.2 %.
    assert 0.88 < math.pi * 0.1**2 * len(found.position) / 1600 < math.pi / math.sqrt(12)
    square = pv.fill(pv.Box((0, 0), (40, 40)), radius=0.1, pattern="square")
    assert 0.76 < math.pi * 0.1**2 * len(square.position) / 1600 < math.pi / 4


def test_the_same_seed_gives_the_same() -> None:
    one, same, other = (pv.fill(pv.Box((0, 0), (5, 5)), radius=(0.1, 0.2), pattern="random", seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.position, same.position)
    assert not np.array_equal(one.position[:5], other.position[:5])


def test_a_picture_is_filled_where_it_has_ink() -> None:
    picture = np.full((40, 80, 4), 255, np.uint8)
    picture[10:30, 10:30, :3] = (200, 30, 30)
    picture[10:30, 50:70, :3] = (30, 30, 200)
    picture[:5, :, 3] = 0
    found = pv.fill(pv.Box((0, 0), (16, 8)), radius=0.1, pattern="picture", picture=picture)
    assert found.colour is not None
    # 80 pixels are 16 m: two squares of 4 m, from x = 2 and 10, y = 2 to 6.
    x, y = found.position.T
    left = x < 8
    assert ((x[left] > 2) & (x[left] < 6)).all()
    assert ((x[~left] > 10) & (x[~left] < 14)).all()
    assert ((y > 2) & (y < 6)).all()
    assert (found.colour[left] == (200, 30, 30)).all()
    assert (found.colour[~left] == (30, 30, 200)).all()
    assert gaps(*found[:2]).min() >= 0


def test_many_in_the_time_of_a_blink() -> None:
    # Of two sizes the time goes with the number: no loop over pairs. Absolute times are nobody's promise on a busy machine.
    def took(side: float, pattern: str) -> float:
        began = time.perf_counter()
        pv.fill(pv.Box((0, 0), (side, side)), radius=0.1, pattern=pattern, fraction=0.4)
        return time.perf_counter() - began

    for pattern in ("hex", "random"):
        took(5, pattern)
        few, many = (min(took(side, pattern) for _ in range(3)) for side in (14, 42))  # 2,500 and 22,500 circles
        assert many < 9 * 4 * few


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"where": pv.Open()}, "where is"),
        ({"where": [(0, 0), (1, 1), (1, 0), (0, 1)]}, "crosses itself"),
        ({"radius": -1.0}, "radius is -1"),
        ({"radius": (0.5, 0.1)}, "radius is 0.1"),
        ({"pattern": "hexagonal"}, "pattern is 'hexagonal'"),
        ({"fraction": 0.95}, "find room"),
        ({"fraction": 0.6, "pattern": "random"}, "were placed at random"),
        ({"fraction": 0.4, "count": 3}, "allowed is one of them"),
        ({"count": 0}, "count is 0"),
        ({"radius": 1e-6}, "more than 5,000,000"),
        ({"pattern": "picture"}, "picture is None"),
        ({"picture": "a.png"}, "picture is 'a.png'"),
        ({"pattern": "picture", "picture": "nowhere.png"}, "does not exist"),
        ({"pattern": "picture", "picture": np.full((4, 4, 3), 255, np.uint8)}, "white or transparent"),
        ({"avoid": [3]}, "avoid[0] is 3"),
    ],
)
def test_bad_input_is_told(arguments: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said.replace("[", r"\[")) as told:
        pv.fill(**{"where": pv.Box((0, 0), (4, 4)), "radius": 0.2, **arguments})
    assert "allowed" in str(told.value) or "picture is white" in str(told.value)
