"""An angle that wants to stay: what makes a rod of particles bend like a beam."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.laws.links._ends import parse
from pyverlet.laws.links._link import Link, Numbers, finite, several, stiffness_of
from pyverlet.laws.links._measured import ANGLE
from pyverlet.laws.links._pool import RowPool


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

    _pool_type = RowPool
    angle = Numbers("rest", finite, "(k,) rad; assign one number or (k,) to change it while the world runs.", unit="radians")

    def __init__(
        self,
        *ends: Any,
        angle: ArrayLike | None = None,
        compliance: ArrayLike = 0.0,
        damping: ArrayLike = 0.0,
        breaking_torque: ArrayLike = np.inf,
    ) -> None:
        state, particles = parse("Angle", ends, ("i", "j", "k"))
        super().__init__(state, particles)
        count = len(particles)
        if angle is None:
            i, j, k = (state.position[particles[:, n]].astype(np.float64) for n in range(3))
            (ax, ay), (bx, by) = state.seam.nearest(i - j).T, state.seam.nearest(k - j).T
            angle = np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
        self.angle = angle
        self._stiffness = stiffness_of("Angle", count, None, compliance)
        self._damping = several("Angle", "damping", damping, count)
        self._strength = several("Angle", "breaking_torque", breaking_torque, count, above=0.0, infinite=True)

    def _columns(self) -> dict[str, Any]:
        return {
            "kind": ANGLE, "rest": self.angle, "slack": 0.0, "stiffness": self._stiffness, "damping": self._damping,
            "upper": np.inf, "strength": self._strength, "collide": 1,
        }  # fmt: skip
