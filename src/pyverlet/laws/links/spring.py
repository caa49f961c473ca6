"""A spring with a damper beside it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.laws.links._distance import Distance


class Spring(Distance):
    """F = -stiffness (distance - length) - damping d(distance)/dt, at any stiffness without exploding.

    `Spring(group, i, j, stiffness=...)` or `Spring((group_a, i), (group_b, j), stiffness=...)`.

    Args:
        ends: what it joins; i and j are indices in the group, or (k,) arrays of them for k springs.
        stiffness: N/m.
        damping: N s/m.
        length: at which it is content, m; None takes the distance now.
        breaking_force: pull or push it breaks at, N.
        collide: whether the two circles still collide with each other.

    Raises:
        InputError: an index is outside its group, an end is its own other end, or a number is outside what is allowed.
    """

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
