"""A rod between two particles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.laws.links._distance import Distance


class Stick(Distance):
    """Keeps particles at a distance; pulls and pushes. `Stick(group, i, j)` or `Stick((group_a, i), (group_b, j))`.

    Args:
        ends: what it joins; i and j are indices in the group, or (k,) arrays of them for k sticks.
        length: m; None takes the distance now.
        compliance: what it gives under a newton, m/N; 0 is rigid.
        damping: N s/m against changes of its length; for sticks that give.
        breaking_force: pull or push it breaks at, N.
        collide: whether the two circles still collide with each other.

    Raises:
        InputError: an index is outside its group, an end is its own other end, or a number is outside what is allowed.
    """

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
