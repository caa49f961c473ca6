"""A ring of particles that keeps its area, such as the skin of a liquid-filled body."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common.errors import InputError
from pyverlet.laws.links._ends import parse_ring
from pyverlet.laws.links._link import Link, Numbers, compliance, damping, several
from pyverlet.laws.links._pool import AREA


class Area(Link):
    """Keeps the area inside a ring of particles. `Area(group)` or `Area(group, ring)`.

    Args:
        group: the group of its particles.
        ring: (p,) indices in the group, in order along the ring; None for the whole group. At least 3.
        area: m^2; None for the current area. A larger one inflates it.
        compliance: m^2/(N/m), change of area by a pressure, in two dimensions a force per length; 0 is incompressible.
        damping: N s/m^3 against changes of the area; for rings that yield.

    Raises:
        InputError: an index is outside the group, the ring crosses itself, or a number is outside what is allowed.
    """

    _kind = AREA
    _columns: ClassVar = {"area": "rest", "stiffness": "stiffness", "damping": "damping"}
    area = Numbers(several, "(1,) m^2; assign a number to change it while the world runs.")
    compliance, damping = compliance("m^2/(N/m)"), damping("N s/m^3")

    def __init__(
        self,
        group: Any,
        ring: ArrayLike | None = None,
        *,
        area: float | None = None,
        compliance: float = 0.0,
        damping: float = 0.0,
    ) -> None:
        state, particles = parse_ring("Area", group, ring)
        corners = state.position[particles].astype(np.float64)
        if state.periodic:  # each corner is the nearest image of the one before
            sides = state.periodic.nearest(np.diff(corners, axis=0, prepend=corners[:1]))
            corners = corners[0] + np.cumsum(sides, axis=0)
        now = signed_area(corners)
        if crossing := first_crossing(corners):
            a, b = crossing
            raise InputError(f"Area: the ring crosses itself, its sides {a} and {b} meet; allowed is a simple polygon")
        if now < 0.0:  # the solver needs counter-clockwise order
            particles, now = particles[::-1], -now
        super().__init__(state, particles[None, :])
        self.area = now if area is None else area
        self._set_give(compliance=compliance, damping=damping)


def signed_area(corners: NDArray[Any]) -> float:
    """Area of a polygon (p, 2), m^2; negative if it runs clockwise."""
    x, y = (corners - corners[0]).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def first_crossing(corners: NDArray[Any]) -> tuple[int, int] | None:
    """Two sides of a polygon (p, 2) that cross or touch without being neighbours; None if it is simple. O(p^2)."""
    start, end = corners, np.roll(corners, -1, axis=0)
    count = len(corners)

    def side(a: NDArray[Any], b: NDArray[Any], p: NDArray[Any]) -> NDArray[Any]:
        """The side of the line from a to b on which the points p are: -1, 0, 1."""
        ab, ap = b - a, p - a
        return np.asarray(np.sign(ab[..., 0] * ap[..., 1] - ab[..., 1] * ap[..., 0]))

    for k in range(count):
        others = np.arange(k + 2, count - (k == 0))
        if not len(others):
            continue
        a, b, c, d = start[k], end[k], start[others], end[others]
        c_side, d_side, a_side, b_side = side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b)
        on_one_line = (c_side == 0) & (d_side == 0) & (a_side == 0) & (b_side == 0)
        low, high = np.minimum(c, d), np.maximum(c, d)
        overlap = ((low <= np.maximum(a, b)) & (np.minimum(a, b) <= high)).all(axis=1)
        meet = np.where(on_one_line, overlap, (c_side * d_side <= 0) & (a_side * b_side <= 0))
        if meet.any():
            return k, int(others[np.argmax(meet)])
    return None
