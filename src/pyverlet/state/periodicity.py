"""The periodicity of a room: particles that leave on one side enter on the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pyverlet import core
from pyverlet.common.arrays import Array

_HERE = np.zeros((1, 2))


class Periodicity(NamedTuple):
    """A corner (x, y) of the room and its period (x, y), m; 0 along axes without one."""

    low_x: float = 0.0
    low_y: float = 0.0
    period_x: float = 0.0
    period_y: float = 0.0

    def __bool__(self) -> bool:
        return self.period_x > 0 or self.period_y > 0

    @property
    def period(self) -> tuple[float, float]:
        """The period (x, y), m, as kernels take it."""
        return self.period_x, self.period_y

    @property
    def shortest(self) -> float:
        """The shortest non-zero period, m; infinite if there is none."""
        return min((period for period in self.period if period > 0), default=np.inf)

    def images(self) -> Array:
        """(k, 2) m, shifts from a room to itself and its neighbouring images; zero first."""
        if not self:
            return _HERE
        ways = [(0, -1, 1) if period > 0 else (0,) for period in self.period]
        return np.array([(i * self.period_x, j * self.period_y) for i in ways[0] for j in ways[1]], float)

    def nearest(self, way: Array) -> Array:
        """(..., 2) the images of these differences nearest to 0, m; unchanged along axes without a period."""
        return np.asarray(way - self.periods(way)) if self else way

    def periods(self, way: Array) -> Array:
        """(..., 2) m, the whole periods in these differences; 0 along axes without a period."""
        period = np.asarray(self.period, way.dtype)
        return np.asarray(period * np.rint(np.divide(way, period, out=np.zeros_like(way), where=period > 0)))

    def wrapped(self, position: Array) -> Array:
        """(n, 2) the images of these positions inside the room, m; the same array without periods."""
        if not self:
            return position
        out = np.empty_like(position)
        core.unit("engine", position.dtype).wrap(position, *self, out)
        return out

    def wrap(self, position: Array) -> None:
        """Move these positions (n, 2) inside the room."""
        core.unit("engine", position.dtype).wrap(position, *self, position)


NONE = Periodicity()  # of rooms that are not periodic
