"""Where circles may be put: inside a room or a polygon, clear of obstacles and of circles that are there."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.ground.arrays import Floats
from pyverlet.ground.errors import InputError
from pyverlet.laws.links.area import signed_area
from pyverlet.laws.obstacles import Chain, Obstacle, ObstacleArrays, Obstacles, Polygon
from pyverlet.laws.rooms import Boundary
from pyverlet.state.state import EVERYONE
from pyverlet.world.builders.outline import inside, simple_polygon
from pyverlet.world.queries import ROUNDING, overlapping
from pyverlet.world.world import World

Flags = NDArray[np.bool_]

SAMPLES = 400
"""Points along each side of the grid by which the free part of an area is counted: to about a thousandth of it."""


class Region:
    """A room or polygon, less what is in the way.

    Args:
        where: `Box`, `Circle` or a boundary of your own with walls; a `Polygon`, or the (n, 2) corners of any simple polygon, m.
        avoid: a world, whose obstacles and circles are left free, or obstacles.
    """

    def __init__(self, where: Any, avoid: World | Iterable[Obstacle]) -> None:
        if isinstance(avoid, World):
            self._there = (avoid.position.astype(np.float64), avoid.radius.astype(np.float64))
        else:
            self._there = (np.zeros((0, 2)), np.zeros(0))
        obstacles = list(avoid.obstacles if isinstance(avoid, World) else avoid)
        for k, obstacle in enumerate(obstacles):
            if not isinstance(obstacle, Obstacle):
                raise InputError(f"avoid[{k}] is {obstacle!r}; allowed are a world, and a list of obstacles")
        self._obstacles = ObstacleArrays(Obstacles(obstacles))
        self._within, self.extent = _walls(where)

    def free(self, points: Floats, radius: Floats) -> Flags:
        """(k,) whether circles of these radii (k,) about points (k, 2) are inside and overlap neither obstacle nor circle."""
        found = self._within(points, radius * (1 - ROUNDING)) & _clear(self._obstacles, points, radius)
        if len(self._there[0]):
            hit = overlapping(points, radius, *self._there)
            found[np.unique(hit[:, 0])] = False
        return found

    def area(self) -> float:
        """Of what is inside and in no obstacle, m^2, counted on a grid of points."""
        x0, y0, x1, y1 = self.extent
        across, up = (np.arange(SAMPLES) + 0.5) / SAMPLES * (x1 - x0) + x0, (np.arange(SAMPLES) + 0.5) / SAMPLES * (y1 - y0) + y0
        points = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
        share = float(self.free(points, np.zeros(len(points))).mean())
        return share * (x1 - x0) * (y1 - y0)


def _walls(where: Any) -> tuple[Callable[[Floats, Floats], Flags], tuple[float, float, float, float]]:
    """Whether circles about points are inside; and the extent."""
    if isinstance(where, Boundary):
        extent = where.extent()
        facing = where.facing(np.zeros((1, 2)))
        if extent is None or facing is None:
            raise InputError(f"where is {where!r}; allowed is a room with walls, such as pyverlet.Box, or a polygon")

        def in_room(points: Floats, radius: Floats) -> Flags:
            distance = where.facing(points)
            assert distance is not None
            return np.asarray((distance[0].min(axis=1) >= radius) & ~where.outside(points))

        return in_room, tuple(map(float, extent))  # type: ignore[return-value]
    corners = where.points if isinstance(where, Polygon) else _polygon(where)
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    sides = ObstacleArrays(Obstacles([Chain(corners, closed=True)]))

    def in_polygon(points: Floats, radius: Floats) -> Flags:
        return inside(corners, points) & _clear(sides, points, radius)

    return in_polygon, (float(x0), float(y0), float(x1), float(y1))


def _clear(course: ObstacleArrays, points: Floats, radius: Floats) -> Flags:
    """(k,) whether circles of these radii (k,) about points (k, 2) overlap none of the obstacles."""
    near, clear = course.near(points, radius, EVERYONE, EVERYONE), np.ones(len(points), bool)
    clear[near.row[near.gap < radius[near.row]]] = False
    return clear


def _polygon(where: ArrayLike) -> Floats:
    try:
        corners = simple_polygon("where", where)
    except InputError as error:
        raise InputError(f"{error} (or a room, such as pyverlet.Box)") from None
    assert signed_area(corners) > 0
    return corners
