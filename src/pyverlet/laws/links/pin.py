"""A pin: a particle held at a point."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.common import checks
from pyverlet.common.arrays import Floats
from pyverlet.laws.links._ends import parse
from pyverlet.laws.links._link import GIVES, Link, Numbers, compliance, damping, strength
from pyverlet.laws.links._pool import PIN


def _points(kind: str, name: str, value: ArrayLike, count: int) -> Floats:
    return np.array(checks.rows(f"{kind}: {name}", value, np.dtype(np.float64), count))


class Pin(Link):
    """Holds particles at points. `Pin(group, i)` or `Pin(group, i, point=(x, y))`.

    `group.pin(i)` makes a particle immovable. A pin can be soft, can break, can be moved and removed.

    Args:
        ends: a group and an index in it or a (k,) array of them; or `(group, i)`.
        point: (x, y) or (k, 2), m; None for the current positions.
        compliance: m/N; 0 is rigid.
        damping: N s/m against motion; for pins that yield.
        breaking_force: force at which it breaks, N.

    Raises:
        InputError: an index is outside its group, or a number is outside what is allowed.
    """

    _kind = PIN
    _columns: ClassVar = {"point": "point", **GIVES}
    point = Numbers(_points, "(k, 2) m; assign (x, y) or (k, 2) to move the pins: rigid ones go there evenly in the next frame.")
    compliance, damping, breaking_force = compliance("m/N"), damping("N s/m"), strength("N")

    def __init__(
        self,
        *ends: Any,
        point: ArrayLike | None = None,
        compliance: ArrayLike = 0.0,
        damping: ArrayLike = 0.0,
        breaking_force: ArrayLike = np.inf,
    ) -> None:
        super().__init__(*parse("Pin", ends, ("i",)))
        self.point = self._state.position[self.particles[:, 0]] if point is None else point
        self._set_give(compliance=compliance, damping=damping, breaking_force=breaking_force)
