"""Outlines of bodies: corners (p, 2) of polygons, counter-clockwise, m."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.laws.links.area import first_crossing, signed_area
from pyverlet.world.builders._built import Point

CORNER = 0.5
"""rad: an outline that turns by more has a corner there; otherwise it is a curve."""


def disc(center: Point, radius: float, *, corners: int = 64) -> Floats:
    """A circle as a polygon with `corners` corners."""
    r, angle = (
        checks.number("radius", radius, above=0.0),
        np.linspace(0, 2 * np.pi, checks.integer("corners", corners, least=3) + 1),
    )
    return np.array(checks.vector("center", center)) + r * np.column_stack((np.cos(angle), np.sin(angle)))[:-1]


def box(lower: Point, upper: Point) -> Floats:
    """A rectangle from its lower left to its upper right corner."""
    (x0, y0), (x1, y1) = checks.vector("lower", lower), checks.vector("upper", upper)
    if not (x0 < x1 and y0 < y1):
        raise InputError(f"upper is {(x1, y1)}; allowed is a corner above and to the right of lower, {(x0, y0)}")
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])


def simple_polygon(name: str, corners: ArrayLike) -> Floats:
    """(p, 2) corners of a polygon that does not cross itself, counter-clockwise."""
    points: Floats = checks.rows(name, corners, np.dtype(np.float64))
    if len(points) < 3:
        raise InputError(f"{name} has {len(points)} corners; allowed are at least 3")
    if crossing := first_crossing(points):
        a, b = crossing
        raise InputError(f"{name} crosses itself, its sides {a} and {b} meet; allowed is a simple polygon")
    area = signed_area(points)
    if area == 0.0:
        raise InputError(f"{name} has no area; allowed is a polygon with an inside")
    return points if area > 0.0 else points[::-1].copy()


def walk(corners: Floats, spacing: float) -> Floats:
    """Points along a polygon: corners that turn by more than CORNER, and evenly spaced points between them."""
    along = np.roll(corners, -1, axis=0) - corners
    heading = np.arctan2(along[:, 1], along[:, 0])
    turn = np.abs((heading - np.roll(heading, 1) + np.pi) % (2 * np.pi) - np.pi)
    sharp = np.flatnonzero(turn > CORNER)
    first = int(sharp[0]) if len(sharp) else 0
    path = np.concatenate((np.roll(corners, -first, axis=0), corners[first : first + 1]))  # from a corner back to itself
    way = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))))
    stops = np.append(way[sharp - first], way[-1]) if len(sharp) else way[[0, -1]]
    at = [np.linspace(a, b, max(1, round((b - a) / spacing)), endpoint=False) for a, b in pairwise(stops)]
    where = np.concatenate(at)
    return np.column_stack([np.interp(where, way, column) for column in path.T])


def inside(corners: Floats, points: Floats) -> NDArray[np.bool_]:
    """(k,) which points are inside the polygon (even-odd)."""
    x, y = points[:, 0][:, None], points[:, 1][:, None]
    (x0, y0), (x1, y1) = corners.T, np.roll(corners, -1, axis=0).T
    with np.errstate(divide="ignore", invalid="ignore"):
        crosses = ((y0 <= y) != (y1 <= y)) & (x < x0 + (y - y0) / (y1 - y0) * (x1 - x0))
    return np.asarray(crosses.sum(axis=1) % 2 == 1)
