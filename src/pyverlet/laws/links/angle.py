"""An angle that wants to stay, as in a rod that bends like a beam, and one with limits, as in a knee that bends one way only."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.ground.arrays import Floats
from pyverlet.ground.errors import InputError
from pyverlet.laws.links._ends import parse
from pyverlet.laws.links._link import GIVES, Link, Numbers, compliance, damping, finite, strength
from pyverlet.laws.links._pool import ANGLE


class Angle(Link):
    """Keeps the angle at j between i and k. `Angle(group, i, j, k)`, or three pairs `(group, index)`.

    Args:
        ends: what it joins; i, j and k are indices in the group, or arrays of them for many angles.
        angle: from j -> i to j -> k, counter-clockwise, rad; None takes the angle now.
        compliance: what it gives under a torque, rad/(N m); 0 is rigid.
        damping: N m s/rad; for angles that give.
        breaking_torque: at which it breaks, N m.

    Raises:
        InputError: an index is outside its group, a particle comes twice, or a number is outside what is allowed.
    """

    _kind = ANGLE
    _columns: ClassVar = {"angle": "rest", **GIVES}
    angle = Numbers(finite, "(k,) rad; assign one number or (k,) to change it while the world runs.", unit="radians")
    compliance, damping, breaking_torque = compliance("rad/(N m)"), damping("N m s/rad"), strength("N m")

    def __init__(
        self,
        *ends: Any,
        angle: ArrayLike | None = None,
        compliance: ArrayLike = 0.0,
        damping: ArrayLike = 0.0,
        breaking_torque: ArrayLike = np.inf,
    ) -> None:
        super().__init__(*parse("Angle", ends, ("i", "j", "k")))
        if angle is None:
            i, j, k = self._state.position[self.particles.T].astype(np.float64)
            (ax, ay), (bx, by) = self._state.seam.nearest(i - j).T, self._state.seam.nearest(k - j).T
            angle = np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
        self.angle = angle
        self._set_give(compliance=compliance, damping=damping, breaking_torque=breaking_torque)


class AngleLimit(Link):
    """Keeps the angle at j between i and k within a range. `AngleLimit(group, i, j, k)`, or three pairs `(group, index)`.

    Within the range it does nothing; at its ends it pushes back, and takes the speed that the angle comes with. The angle is
    from j -> i to j -> k, counter-clockwise. Only differences of angles count, modulo 2 pi: from 3 to 3.5 rad is a range across
    pi. An angle outside is pushed to the nearer end, so that a narrow forbidden part can be jumped across in a substep.

    Args:
        ends: what it joins; i, j and k are indices in the group, or arrays of them for many limits.
        least: beginning of the range, rad.
        most: its end, rad; from `least` to less than 2 pi more.
        breaking_torque: at which it breaks, N m.

    Raises:
        InputError: an index is outside its group, a particle comes twice, or a number is outside what is allowed.
    """

    _kind, _upper = ANGLE, 0.0
    _columns: ClassVar = {"least": "rest", "range": "slack", "strength": "strength"}
    breaking_torque = strength("N m")

    def __init__(self, *ends: Any, least: ArrayLike, most: ArrayLike, breaking_torque: ArrayLike = np.inf) -> None:
        super().__init__(*parse("AngleLimit", ends, ("i", "j", "k")))
        self._least, self._range = self._checked(least, most)
        self.breaking_torque = breaking_torque

    def _checked(self, least: ArrayLike, most: ArrayLike) -> tuple[Floats, Floats]:
        start = finite("AngleLimit", "least", least, len(self), unit="radians")
        end = finite("AngleLimit", "most", most, len(self), unit="radians")
        wide = end - start
        if (wrong := np.flatnonzero((wide < 0.0) | (wide >= 2.0 * np.pi))).size:
            row = int(wrong[0])
            said = f"most[{row}] is {end[row]:g}, least[{row}] {start[row]:g}"
            raise InputError(f"AngleLimit: {said}; allowed is a most from least to less than 2 pi more")
        return start, wide

    @property
    def least(self) -> Floats:
        """(k,) rad; `limits` changes it while the world runs."""
        return self._least.copy()

    @property
    def most(self) -> Floats:
        """(k,) rad."""
        return self._least + self._range

    def limits(self, least: ArrayLike, most: ArrayLike) -> None:
        """Set both ends, one number for all or (k,), rad, while the world runs.

        Raises:
            InputError: a number is outside what is allowed.
        """
        self._least, self._range = self._checked(least, most)
        self._change("rest", self._least)
        self._change("slack", self._range)
