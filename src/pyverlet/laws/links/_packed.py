"""Copies of pools for the solver of the law of projection."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np

from pyverlet.laws.links._link import Array
from pyverlet.laws.links._pool import Pool
from pyverlet.laws.links._table import Table
from pyverlet.laws.links._work import Work


class Packed(ABC):
    """The rows of a pool as a solver has them."""

    def __init__(self, pool: Pool) -> None:
        self.pool = pool

    @property
    def rows(self) -> Table:
        """Of the pool."""
        return self.pool.rows

    @property
    def entries(self) -> Table:
        """Of the pool."""
        return self.pool.entries

    @property
    def first(self) -> Array:
        """Of the pool."""
        return self.pool.first

    @property
    def stale(self) -> bool:
        """Of the pool."""
        return self.pool.stale

    @stale.setter
    def stale(self, value: bool) -> None:
        self.pool.stale = value

    @property
    def changed(self) -> bool:
        """Of the pool."""
        return self.pool.changed

    @changed.setter
    def changed(self, value: bool) -> None:
        self.pool.changed = value

    @abstractmethod
    def pack(self, work: Work) -> None:
        """Rows have come or gone, or `work` is new: make the solver's copy."""

    @abstractmethod
    def begin(self) -> None:
        """A frame begins: take up who is intact."""

    @abstractmethod
    def arrays(self) -> tuple[Array, ...]:
        """What `kernels.linked` is handed of it."""

    @abstractmethod
    def broken(self) -> Array:
        """The rows that have broken in this frame, until its `end`."""

    @abstractmethod
    def pulled(self) -> Array:
        """(k,) what each row pulls with now, N; of those that have broken, what they broke with."""

    @abstractmethod
    def end(self) -> None:
        """The frame is good: write force and who is intact into the table."""


class PackedPins(Packed):
    """Pins act on their particles alone, before the rows, which then feel a particle as heavy as its pin is stiff."""

    def pack(self, work: Work) -> None:
        self.stale, self.changed = False, True
        self._particle = work.compact[self.entries["particle"]]
        self._give, self._lam, self._last, self._force = np.zeros((4, len(self.rows)))
        self._left, self._way, self._kept = np.zeros((3, len(self.rows), 2))
        self._intact = np.zeros(len(self.rows), np.uint8)
        self._given = tuple(self.rows[name] for name in ("point", "stiffness", "damping", "strength"))

    def begin(self) -> None:
        if self.changed:
            self.changed = False
        self._intact[:] = self.rows["intact"]
        self._force[:] = self.rows["force"]

    def arrays(self) -> tuple[Array, ...]:
        """As `kernels.linked.Linked` has them."""
        return (
            self._particle, *self._given, self._intact, self._give, self._left, self._way, self._kept, self._lam, self._last,
            self._force,
        )  # fmt: skip

    def broken(self) -> Array:
        return np.flatnonzero(self._intact != self.rows["intact"])

    def pulled(self) -> Array:
        return self._force

    def end(self) -> None:
        self.rows["intact"][:] = self._intact
        self.rows["force"][:] = np.where(self._intact, self._force, 0.0)
