"""The shapes obstacles have."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.common import checks
from pyverlet.common.checked import Checked
from pyverlet.common.errors import InputError
from pyverlet.laws.obstacles._base import Obstacle, Outline, Parts, Points
from pyverlet.laws.surface import Fixed

_CORNER = 24
"""Points of a drawn half circle: off by 0.2 % of its radius."""


class Chain(Obstacle):
    """A line through points without an inside: particles stay on their side of it, also at its joints.

    Args:
        points: (n, 2), m, at least two.
        closed: join the last to the first.
        radius: half its thickness, m.
        one_way: (x, y), a direction in which particles pass through it; it holds those that come from the other side. It turns
            with the chain. A particle that overlaps it without having been held passes until it is entirely beyond. None: solid.
        surface: restitution, friction and any other argument of `Obstacle` except points.
    """

    one_way = Checked(checks.direction)
    radius, closed = Fixed(), Fixed()

    def __init__(
        self,
        points: ArrayLike,
        *,
        closed: bool = False,
        radius: float = 0.0,
        one_way: Sequence[float] | None = None,
        **surface: Any,
    ) -> None:
        corners = _corners("points", points, least=2)
        self.closed = checks.flag("closed", closed)
        self.one_way = one_way
        self.radius = checks.number("radius", radius, least=0.0)
        super().__init__(corners, **surface)

    def outlines(self) -> list[Outline]:
        points = self.points
        if self.closed:
            points = np.concatenate((points, points[:1]))
        if self.radius == 0.0:
            return [Outline(points, filled=False)]
        return [Outline(_stadium(a, b, self.radius), filled=True) for a, b in pairwise(points)]

    def _parts(self) -> Parts:
        return Parts(self._local, self.closed, self.radius, convex=False, around=False)


class Segment(Chain):
    """A thin wall from one point to another.

    Args:
        start: (x, y), m.
        end: (x, y), m.
        one_way: (x, y), a direction in which particles pass through it; see `Chain`.
        surface: restitution, friction and any other argument of `Obstacle` except points.
    """

    start, end = Fixed(), Fixed()

    def __init__(
        self, start: Sequence[float], end: Sequence[float], *, one_way: Sequence[float] | None = None, **surface: Any
    ) -> None:
        super().__init__([checks.vector("start", start), checks.vector("end", end)], one_way=one_way, **surface)


class Capsule(Chain):
    """A bar with round ends.

    Args:
        start: (x, y) of the centre of one end, m.
        end: (x, y) of the other's, m.
        radius: half its thickness, m, greater than 0.
        one_way: (x, y), a direction in which particles pass through it; see `Chain`.
        surface: restitution, friction and any other argument of `Obstacle` except points.
    """

    start, end = Fixed(), Fixed()

    def __init__(
        self,
        start: Sequence[float],
        end: Sequence[float],
        *,
        radius: float,
        one_way: Sequence[float] | None = None,
        **surface: Any,
    ) -> None:
        checks.number("radius", radius, above=0.0)
        corners = [checks.vector("start", start), checks.vector("end", end)]
        super().__init__(corners, radius=radius, one_way=one_way, **surface)

    def _parts(self) -> Parts:
        return super()._parts()._replace(around=True)


class Disc(Obstacle):
    """A disc: a peg, a wheel.

    Args:
        center: (x, y), m.
        radius: m, greater than 0.
        surface: restitution, friction and any other argument of `Obstacle` except points.
    """

    center, radius = Fixed(), Fixed()

    def __init__(self, center: Sequence[float], radius: float, **surface: Any) -> None:
        self.radius = checks.number("radius", radius, above=0.0)
        middle = checks.vector("center", center)
        super().__init__(np.array([middle]), **{"pivot": middle} | surface)

    def outlines(self) -> list[Outline]:
        (center,) = self.points
        return [Outline(_stadium(center, center, self.radius), filled=True)]

    def _parts(self) -> Parts:
        return Parts(self._local, False, self.radius, convex=False, around=True)


class Polygon(Obstacle):
    """A solid convex polygon; particles inside it are pushed out through the nearest face.

    Args:
        points: (n, 2) corners in order, m, at least three.
        radius: of its rounded rim, m, beyond the corners.
        surface: restitution, friction and any other argument of `Obstacle` except points.
    """

    radius = Fixed()

    def __init__(self, points: ArrayLike, *, radius: float = 0.0, **surface: Any) -> None:
        corners = _corners("points", points, least=3)
        self.radius = checks.number("radius", radius, least=0.0)
        sides = np.roll(corners, -1, axis=0) - corners
        following = np.roll(sides, -1, axis=0)
        turns = sides[:, 0] * following[:, 1] - sides[:, 1] * following[:, 0]
        # All corners turn in the same direction, once around in total: twice around is a star, which crosses itself.
        angles = np.arctan2(turns, (sides * following).sum(axis=1))
        if not (np.all(turns > 0) or np.all(turns < 0)) or abs(abs(angles.sum()) - 2 * np.pi) > 1e-6:
            raise InputError(
                f"points of the polygon are {_shown(corners)}; allowed are the corners of a convex polygon in order, whose sides "
                "do not cross (pyverlet.Chain(points, closed=True) takes any line)"
            )
        super().__init__(corners if turns[0] > 0 else corners[::-1], **surface)

    def outlines(self) -> list[Outline]:
        points = self.points
        if self.radius == 0.0:
            return [Outline(points, filled=True)]
        sides = np.roll(points, -1, axis=0) - points
        heading = np.arctan2(sides[:, 1], sides[:, 0]) - np.pi / 2  # direction of each side's outward normal
        before = np.roll(heading, 1)
        arcs = [
            point + self.radius * _ring(np.linspace(a, a + (b - a) % (2 * np.pi), _CORNER // 2))
            for point, a, b in zip(points, before, heading, strict=True)
        ]
        return [Outline(np.concatenate(arcs), filled=True)]

    def _parts(self) -> Parts:
        return Parts(self._local, True, self.radius, convex=True, around=True)


def _corners(name: str, points: ArrayLike, *, least: int) -> Points:
    corners: Points = checks.rows(name, points, np.dtype(np.float64))
    if len(corners) < least:
        raise InputError(f"{name} has {len(corners)} rows; allowed are at least {least} points (x, y)")
    sides = np.diff(corners, axis=0)
    if (short := np.flatnonzero(~sides.any(axis=1))).size:
        k = int(short[0])
        raise InputError(
            f"{name}[{k}] and {name}[{k + 1}] are both {tuple(map(float, corners[k]))}; allowed are distinct neighbours"
        )
    return corners


def _shown(corners: Points) -> str:
    some = ", ".join(f"({x:g}, {y:g})" for x, y in corners[:5])
    return f"{some}, ..." if len(corners) > 5 else some


def _ring(angle: Points) -> Points:
    return np.column_stack((np.cos(angle), np.sin(angle)))


def _stadium(a: Points, b: Points, radius: float) -> Points:
    """The outline of all points closer than `radius` to the segment from a to b; a circle if they coincide."""
    heading = np.arctan2(b[1] - a[1], b[0] - a[0])
    half = np.linspace(-np.pi / 2, np.pi / 2, _CORNER)
    return np.concatenate((b + radius * _ring(heading + half), a + radius * _ring(heading + half + np.pi)))
