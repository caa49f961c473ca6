"""Links that depend only on the distance of two particles: one family, so that mixed chains are solved together."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.common import checks
from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.laws.links._ends import parse
from pyverlet.laws.links._link import GIVES, Link, Numbers, compliance, damping, several, strength
from pyverlet.laws.links._pool import DISTANCE
from pyverlet.laws.surface import Fixed
from pyverlet.state.periodicity import Periodicity


class Distance(Link):
    """Base class of sticks, ropes and springs."""

    _kind = DISTANCE
    _columns: ClassVar = {"length": "rest", **GIVES}
    length = Numbers(several, "(k,) m; assign one number or (k,) to change it while the world runs.")
    damping, breaking_force = damping("N s/m"), strength("N")
    collide = Fixed()

    def __init__(self, ends: tuple[Any, ...], *, length: ArrayLike | None, collide: bool, **gives: ArrayLike) -> None:
        super().__init__(*parse(type(self).__name__, ends, ("i", "j")))
        if length is None:
            places = self._state.position[self.particles].astype(np.float64)
            self._length: Floats = np.hypot(*self._state.periodic.nearest(places[:, 1] - places[:, 0]).T)
        else:
            self.length = length
        self._set_give(**gives)
        self._collide = checks.flag(f"{type(self).__name__}: collide", collide)

    def _check(self, periodic: Periodicity) -> None:
        if not periodic:
            return
        half = 0.5 * periodic.shortest
        if (wrong := np.flatnonzero(self._length > half)).size:
            k = int(wrong[0])
            what = f"{type(self).__name__}: length[{k}] is {self._length[k]:g} m"
            raise InputError(f"{what}; allowed is at most half a period of the room, {half:g} m")


class _Rod(Distance):
    """Base class of sticks and ropes."""

    compliance = compliance("m/N")

    def __init__(
        self,
        *ends: Any,
        length: ArrayLike | None = None,
        compliance: ArrayLike = 0.0,
        damping: ArrayLike = 0.0,
        breaking_force: ArrayLike = np.inf,
        collide: bool = True,
    ) -> None:
        super().__init__(
            ends, length=length, compliance=compliance, damping=damping, breaking_force=breaking_force, collide=collide
        )


class Stick(_Rod):
    """Keeps particles at a distance; pulls and pushes. `Stick(group, i, j)` or `Stick((group_a, i), (group_b, j))`.

    Args:
        ends: the joined particles; i and j are indices in the group, or (k,) arrays of them for k sticks.
        length: m; None for the current distance.
        compliance: m/N; 0 is rigid.
        damping: N s/m against changes of its length; for sticks that yield.
        breaking_force: tension or compression at which it breaks, N.
        collide: whether the two circles collide with each other, if it yields: a rigid stick holds their distance.

    Raises:
        InputError: an index is outside its group, an end is its own other end, or a number is outside what is allowed.
    """


class Rope(_Rod):
    """Limits the distance of particles to its length. `Rope(group, i, j)` or `Rope((group_a, i), (group_b, j))`.

    Args:
        ends: the joined particles; i and j are indices in the group, or (k,) arrays of them for k ropes.
        length: largest distance, m; None for the current distance.
        compliance: m/N; 0 is rigid.
        damping: N s/m against changes of its length while taut; for ropes that yield.
        breaking_force: tension at which it breaks, N.
        collide: whether the two circles collide with each other.

    Raises:
        InputError: an index is outside its group, an end is its own other end, or a number is outside what is allowed.
    """

    _upper = 0.0


class Spring(Distance):
    """F = -stiffness (distance - length) - damping d(distance)/dt, stable at any stiffness.

    `Spring(group, i, j, stiffness=...)` or `Spring((group_a, i), (group_b, j), stiffness=...)`.

    Args:
        ends: the joined particles; i and j are indices in the group, or (k,) arrays of them for k springs.
        stiffness: N/m.
        damping: N s/m.
        length: rest length, m; None for the current distance.
        breaking_force: tension or compression at which it breaks, N.
        collide: whether the two circles collide with each other.

    Raises:
        InputError: an index is outside its group, an end is its own other end, or a number is outside what is allowed.
    """

    stiffness = Numbers(several, "(k,) N/m; assign one number or (k,), while the world runs, too.")

    def __init__(
        self,
        *ends: Any,
        stiffness: ArrayLike,
        damping: ArrayLike = 0.0,
        length: ArrayLike | None = None,
        breaking_force: ArrayLike = np.inf,
        collide: bool = True,
    ) -> None:
        super().__init__(
            ends, length=length, stiffness=stiffness, damping=damping, breaking_force=breaking_force, collide=collide
        )
