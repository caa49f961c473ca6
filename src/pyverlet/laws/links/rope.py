"""A rope between two particles: it pulls, it never pushes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.laws.links._distance import Distance


class Rope(Distance):
    """Keeps particles from being further apart than its length. `Rope(group, i, j)` or `Rope((group_a, i), (group_b, j))`.

    Args:
        ends: what it joins; i and j are indices in the group, or (k,) arrays of them for k ropes.
        length: the most they may be apart, m; None takes the distance now.
        compliance: what it gives under a newton, m/N; 0 is rigid.
        damping: N s/m against changes of its length while taut; for ropes that give.
        breaking_force: pull it breaks at, N.
        collide: whether the two circles still collide with each other.

    Raises:
        InputError: an index is outside its group, an end is its own other end, or a number is outside what is allowed.
    """

    _UPPER = 0.0

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
