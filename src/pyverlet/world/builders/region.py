"""Where circles may be put: inside a room or a polygon, clear of obstacles and of circles that are there."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.ground.arrays import Floats
from pyverlet.ground.errors import InputError
from pyverlet.laws.links.area import signed_area
from pyverlet.laws.obstacles import Obstacle, Polygon
from pyverlet.laws.rooms import Boundary
from pyverlet.world.builders.outline import inside, simple_polygon
from pyverlet.world.overlaps import ROUNDING, overlapping
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
        self._obstacles = list(avoid.obstacles if isinstance(avoid, World) else avoid)
        for k, obstacle in enumerate(self._obstacles):
            if not isinstance(obstacle, Obstacle):
                raise InputError(f"avoid[{k}] is {obstacle!r}; allowed are a world, and a list of obstacles")
        self._obstacles = [obstacle for obstacle in self._obstacles if not obstacle.sensor]
        self._gap, self.extent = _walls(where)

    def free(self, points: Floats, radius: Floats) -> Flags:
        """(k,) whether circles of these radii (k,) about points (k, 2) are inside and overlap neither obstacle nor circle."""
        found = self._gap(points) >= radius * (1 - ROUNDING)
        for obstacle in self._obstacles:
            reach = float(radius.max(initial=0.0))
            near = np.flatnonzero(found & _near(obstacle, points, reach))
            found[near] = _clearance(obstacle, points[near]) >= radius[near]
        if len(self._there[0]):
            hit = overlapping(points, radius, *self._there)
            found[np.unique(hit[:, 0])] = False
        return np.asarray(found)

    def area(self) -> float:
        """Of what is inside and in no obstacle, m^2, counted on a grid of points."""
        x0, y0, x1, y1 = self.extent
        across, up = (np.arange(SAMPLES) + 0.5) / SAMPLES * (x1 - x0) + x0, (np.arange(SAMPLES) + 0.5) / SAMPLES * (y1 - y0) + y0
        points = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
        share = float(self.free(points, np.zeros(len(points))).mean())
        return share * (x1 - x0) * (y1 - y0)


def _walls(where: Any) -> tuple[Callable[[Floats], Floats], tuple[float, float, float, float]]:
    """How far inside a point is, m, negative outside; and the extent."""
    if isinstance(where, Boundary):
        extent = where.extent()
        facing = where.facing(np.zeros((1, 2)))
        if extent is None or facing is None:
            raise InputError(f"where is {where!r}; allowed is a room with walls, such as pyverlet.Box, or a polygon")

        def gap(points: Floats) -> Floats:
            distance = where.facing(points)
            assert distance is not None
            return np.where(where.outside(points), -1.0, distance[0].min(axis=1))

        return gap, tuple(map(float, extent))  # type: ignore[return-value]
    corners = where.points if isinstance(where, Polygon) else _polygon(where)
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)

    def within(points: Floats) -> Floats:
        return np.where(inside(corners, points), _to_segments(points, corners, closed=True), -1.0)

    return within, (float(x0), float(y0), float(x1), float(y1))


def _polygon(where: ArrayLike) -> Floats:
    try:
        corners = simple_polygon("where", where)
    except InputError as error:
        raise InputError(f"{error} (or a room, such as pyverlet.Box)") from None
    assert signed_area(corners) > 0
    return corners


def _near(obstacle: Obstacle, points: Floats, reach: float) -> Flags:
    """Whether each point is in the box about the obstacle, widened by `reach`."""
    corners, far = obstacle.points, obstacle._parts().rounding + reach
    low, high = corners.min(axis=0) - far, corners.max(axis=0) + far
    return np.asarray(((points >= low) & (points <= high)).all(axis=1))


def _clearance(obstacle: Obstacle, points: Floats) -> Floats:
    """(k,) from each point to the surface of the obstacle, m, negative inside."""
    parts, corners = obstacle._parts(), obstacle.points
    distance = _to_segments(points, corners, closed=parts.closed) - parts.rounding
    if parts.convex:
        distance = np.where(inside(corners, points), -1.0, distance)
    return np.asarray(distance)


def _to_segments(points: Floats, corners: Floats, *, closed: bool) -> Floats:
    """(k,) from each point to the nearest of the segments between corners, m."""
    nearest = np.full(len(points), np.inf)
    starts, ends = (corners, np.roll(corners, -1, axis=0)) if closed else (corners[:-1], corners[1:])
    if len(corners) == 1:
        starts = ends = corners
    for a, b in zip(starts, ends, strict=True):
        along, way = b - a, points - a
        length2 = float(along @ along)
        share = np.clip(way @ along / length2, 0.0, 1.0) if length2 > 0 else np.zeros(len(points))
        nearest = np.minimum(nearest, np.hypot(*(way - share[:, None] * along).T))
    return nearest
