"""Which obstacles cover points, and which are the nearest: against distances from all sides, one by one."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.laws.obstacles import Course, Obstacles
from pyverlet.state.seam import Seam


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


def gaps(obstacle: pv.Obstacle, points: Any, ahead: float) -> Any:
    """(n,) distances of points from the rim of an obstacle in `ahead` seconds, by the sides of its outline."""
    corners, closed, rounding, _, _ = obstacle._parts()
    angle = obstacle.angle + ahead * obstacle.angular_velocity
    turn = np.array([(np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))])
    corners = corners @ turn.T + obstacle.pivot + ahead * np.array(obstacle.velocity)
    ends = np.roll(corners, -1, axis=0) if closed or len(corners) == 1 else corners[1:]
    least = np.full(len(points), np.inf)
    for a, b in zip(corners, ends, strict=False):
        part = np.clip(((points - a) @ (b - a)) / max((b - a) @ (b - a), 1e-300), 0, 1)
        least = np.minimum(least, np.hypot(*(points - a - part[:, None] * (b - a)).T) - rounding)
    return least


@pytest.mark.parametrize("within", [0.0, 0.5])
@pytest.mark.parametrize("ahead", [0.0, 0.2])
def test_the_nearest_are_those_of_the_least_distance(ahead: float, within: float) -> None:
    chance = np.random.default_rng(3)
    obstacles = Obstacles()
    obstacles.extend(shapes(chance))
    points, beyond = chance.uniform(-22, 22, (300, 2)), 0.4
    course = Course(obstacles)
    course.begin()
    found = course.facing(points, beyond, within=within, ahead=ahead)
    far = np.column_stack([gaps(each, points, ahead) for each in obstacles])
    row, which = np.nonzero(far <= far.min(axis=1, keepdims=True) + beyond)
    assert (found.row.tolist(), found.obstacle.tolist()) == (row.tolist(), which.tolist())
    assert found.gap == pytest.approx(far[row, which], abs=1e-12)
    # From outside, a step of the gap against the normal ends at the rim.
    there = points[row] - found.gap[:, None] * found.normal
    rim = np.array([gaps(obstacles[k], there[n : n + 1], ahead)[0] for n, k in enumerate(which)])
    assert rim[found.gap > 0] == pytest.approx(0.0, abs=1e-9)


def test_the_first_of_those_that_have_a_point_inside_covers_it() -> None:
    chance = np.random.default_rng(4)
    obstacles = Obstacles()
    obstacles.extend(shapes(chance))
    points = chance.uniform(-21, 21, (2000, 2))
    course = Course(obstacles, Seam(-20.0, -20.0, 40.0, 40.0))
    inside = np.zeros((len(points), len(obstacles)), bool)
    for shift in [(x, y) for x in (-40, 0, 40) for y in (-40, 0, 40)]:
        for k, each in enumerate(obstacles):
            corners, _, _, convex, _ = each._parts()
            where = course.seam.wrapped(points) - each.pivot - shift
            inside[:, k] |= gaps(each, course.seam.wrapped(points) - shift, 0.0) < 0
            if convex:
                side = np.roll(corners, -1, axis=0) - corners
                across = side[:, 0] * (where[:, None, 1] - corners[:, 1]) - side[:, 1] * (where[:, None, 0] - corners[:, 0])
                inside[:, k] |= (across > 0).all(axis=1)
    expected = np.where(inside.any(axis=1), inside.argmax(axis=1), -1)
    assert (expected >= 0).sum() > 80
    assert course.covering(points).tolist() == expected.tolist()


def test_obstacles_that_move_are_found_where_they_have_come() -> None:
    world = pv.World(gravity=(0, 0))
    world.add(position=(50, 50))
    world.obstacles.append(pv.Disc((0, 0), 1.0, velocity=(6.0, 0)))
    assert world._course.covering(np.array([(0.0, 0.0), (6.0, 0.0)])).tolist() == [0, -1]
    world.run(seconds=1)
    assert world._course.covering(np.array([(0.0, 0.0), (6.0, 0.0)])).tolist() == [-1, 0]
