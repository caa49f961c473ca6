"""The free region for new circles: inside a room or polygon, clear of obstacles and circles, and where a picture is dark."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.common.outside import read_picture
from pyverlet.laws.boundaries import Boundary
from pyverlet.laws.links.area import signed_area
from pyverlet.laws.obstacles import Chain, Obstacle, ObstacleArrays, Obstacles, Polygon
from pyverlet.state.state import EVERYONE
from pyverlet.world.builders.outline import inside, simple_polygon
from pyverlet.world.queries import ROUNDING, overlapping
from pyverlet.world.world import World

Flags = NDArray[np.bool_]

SAMPLES = 400
"""Grid points per side for measuring the free area; the error is about a thousandth."""


PAPER = 245
"""Pixels whose R, G and B are all at least this bright count as paper."""


class Region:
    """A room or polygon minus what is to be avoided.

    Args:
        where: `Box`, `Circle` or a user-defined boundary with walls; a `Polygon`, or the (n, 2) corners of any simple polygon, m.
        avoid: obstacles to keep clear of, or a world whose obstacles and circles are avoided.
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
        """Area inside the region and outside all obstacles, m^2, measured on a grid of points."""
        x0, y0, x1, y1 = self.extent
        across, up = (np.arange(SAMPLES) + 0.5) / SAMPLES * (x1 - x0) + x0, (np.arange(SAMPLES) + 0.5) / SAMPLES * (y1 - y0) + y0
        points = np.stack(np.meshgrid(across, up), axis=-1).reshape(-1, 2)
        share = float(self.free(points, np.zeros(len(points))).mean())
        return share * (x1 - x0) * (y1 - y0)


def _walls(where: Any) -> tuple[Callable[[Floats, Floats], Flags], tuple[float, float, float, float]]:
    """A function that tests whether circles are inside, and the extent (x0, y0, x1, y1), m."""
    if isinstance(where, Boundary):
        extent = where.extent()
        facing = where.facing(np.zeros((1, 2)))
        if extent is None or facing is None:
            raise InputError(f"where is {where!r}; allowed is a room with walls, such as pyverlet.Box, or a polygon")

        def in_boundary(points: Floats, radius: Floats) -> Flags:
            distance = where.facing(points)
            assert distance is not None
            return np.asarray((distance[0].min(axis=1) >= radius) & ~where.outside(points))

        return in_boundary, tuple(map(float, extent))  # type: ignore[return-value]
    corners = where.points if isinstance(where, Polygon) else _polygon(where)
    (x0, y0), (x1, y1) = corners.min(axis=0), corners.max(axis=0)
    sides = ObstacleArrays(Obstacles([Chain(corners, closed=True)]))

    def in_polygon(points: Floats, radius: Floats) -> Flags:
        return inside(corners, points) & _clear(sides, points, radius)

    return in_polygon, (float(x0), float(y0), float(x1), float(y1))


def _clear(obstacles: ObstacleArrays, points: Floats, radius: Floats) -> Flags:
    """(k,) whether circles of these radii (k,) about points (k, 2) overlap none of the obstacles."""
    near, clear = obstacles.near(points, radius, EVERYONE, EVERYONE), np.ones(len(points), bool)
    clear[near.row[near.gap < radius[near.row]]] = False
    return clear


def _polygon(where: ArrayLike) -> Floats:
    try:
        corners = simple_polygon("where", where)
    except InputError as error:
        raise InputError(f"{error} (or a room, such as pyverlet.Box)") from None
    assert signed_area(corners) > 0
    return corners


class PictureMask:
    """A picture scaled to fit a rectangle and centred in it.

    Args:
        picture: a file, or (h, w, 3) or (h, w, 4) bytes R, G, B, A.
        extent: x0, y0, x1, y1, m.
    """

    def __init__(self, picture: Any, extent: tuple[float, float, float, float]) -> None:
        self._pixels = read_picture(picture) if isinstance(picture, str | Path) else _bytes(picture)
        height, width = self._pixels.shape[:2]
        x0, y0, x1, y1 = extent
        self._metres = min((x1 - x0) / width, (y1 - y0) / height)  # per pixel
        self._left, self._top = 0.5 * (x0 + x1 - width * self._metres), 0.5 * (y0 + y1 + height * self._metres)
        opaque = self._pixels[..., 3] > 127
        self._covered = opaque & (self._pixels[..., :3] < PAPER).any(axis=2)
        if not self._covered.any():
            raise InputError("picture is white or transparent everywhere; allowed is one with something on it")

    def area(self) -> float:
        """Dark area, m^2."""
        return float(self._covered.sum() * self._metres**2)

    def covers(self, points: Floats) -> NDArray[np.bool_]:
        """(k,) whether the picture is dark at each point (k, 2), m."""
        row, column, within = self._at(points)
        return np.asarray(within & self._covered[row, column])

    def colours(self, points: Floats) -> NDArray[np.uint8]:
        """(k, 3) bytes R, G, B at these points."""
        row, column, _ = self._at(points)
        return np.ascontiguousarray(self._pixels[row, column, :3])

    def _at(self, points: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
        height, width = self._covered.shape
        column = np.floor((points[:, 0] - self._left) / self._metres).astype(np.int64)
        row = np.floor((self._top - points[:, 1]) / self._metres).astype(np.int64)
        within = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        return row.clip(0, height - 1), column.clip(0, width - 1), within


def _bytes(picture: Any) -> NDArray[np.uint8]:
    pixels: NDArray[Any] = np.asarray(picture)
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or pixels.dtype != np.uint8 or not pixels.size:
        raise InputError(
            f"picture has shape {pixels.shape} and dtype {pixels.dtype}; allowed are a file, and (h, w, 3) or (h, w, 4) bytes"
        )
    if pixels.shape[2] == 3:
        pixels = np.concatenate((pixels, np.full((*pixels.shape[:2], 1), 255, np.uint8)), axis=2)
    return pixels
