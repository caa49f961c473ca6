"""Links between two particles that look at nothing but their distance: one family, so that mixed chains are solved at once."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.laws.links._ends import parse
from pyverlet.laws.links._link import Floats, Link, several, stiffness_of
from pyverlet.laws.links._pool import DistancePool
from pyverlet.state.seam import NONE, Seam


class Distance(Link):
    """What sticks, ropes and springs share. See there for the arguments."""

    _pool_type = DistancePool
    _UPPER: ClassVar[float] = np.inf  # largest push; 0 for what only pulls

    def __init__(
        self,
        ends: tuple[Any, ...],
        *,
        length: ArrayLike | None,
        stiffness: ArrayLike | None = None,
        compliance: ArrayLike | None = None,
        damping: ArrayLike,
        breaking_force: ArrayLike,
        collide: bool,
    ) -> None:
        kind = type(self).__name__
        state, particles = parse(kind, ends, ("i", "j"))
        super().__init__(state, particles)
        count = len(particles)
        if length is None:
            places = state.position[particles].astype(np.float64)
            self._length: Floats = np.hypot(*state.seam.nearest(places[:, 1] - places[:, 0]).T)
        else:
            self._length = several(kind, "length", length, count)
        self._stiffness = stiffness_of(kind, count, stiffness, compliance)
        self._damping = several(kind, "damping", damping, count)
        self._strength = several(kind, "breaking_force", breaking_force, count, above=0.0, infinite=True)
        self._collide = checks.flag(f"{kind}: collide", collide)

    @property
    def length(self) -> Floats:
        """(k,) m; assign one number or (k,) to change it while the world runs."""
        return self._length.copy()

    @length.setter
    def length(self, value: ArrayLike) -> None:
        before, self._length = self._length, several(type(self).__name__, "length", value, len(self))
        try:
            self._check(self._state.seam if self._pool is not None else NONE)
        except InputError:
            self._length = before
            raise
        self._change("rest", self._length)

    def _check(self, seam: Seam) -> None:
        if not seam:
            return
        half = 0.5 * seam.shortest
        if (wrong := np.flatnonzero(self._length > half)).size:
            k = int(wrong[0])
            what = f"{type(self).__name__}: length[{k}] is {self._length[k]:g} m"
            raise InputError(f"{what}; allowed is at most half a period of the room, {half:g} m")

    def _columns(self) -> dict[str, Any]:
        return {
            "rest": self._length, "stiffness": self._stiffness, "damping": self._damping, "upper": self._UPPER,
            "strength": self._strength, "collide": self._collide,
        }  # fmt: skip
