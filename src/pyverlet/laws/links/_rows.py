"""Links that are one equation each, of any kind `kernels.shapes` can measure: one pool of rows, solved beside the chains."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.ground.constants import LINK_COLOURS
from pyverlet.kernels import link_rows, runs
from pyverlet.laws.links._link import MOVING, Array
from pyverlet.laws.links._pool import Pool, held
from pyverlet.laws.links._work import Work
from pyverlet.state.seam import Seam

_NUMBERS = {
    "rest": link_rows.REST, "stiffness": link_rows.STIFFNESS, "damping": link_rows.DAMPING, "upper": link_rows.UPPER,
    "strength": link_rows.STRENGTH, "force": link_rows.FORCE, "last": link_rows.LAST,
}  # fmt: skip
"""Columns of the table, and where the solver has them."""


class RowPool(Pool):
    """A row for each link, coloured: those of one kind and colour share no particle and are solved beside each other."""

    drawn = False

    def __init__(self) -> None:
        super().__init__(rest=np.float64, upper=np.float64, kind=np.int64)

    def pack(self, work: Work) -> None:
        """By kind, then by colour, and within a colour in the order added."""
        count, first, entry, kind = len(self.rows), self.first, work.compact[self.entries["particle"]], self.rows["kind"]
        colour, arity = np.zeros(count, np.int64), self.rows["arity"]
        for here in np.unique(kind):
            which = np.flatnonzero(kind == here)
            among, own = np.concatenate((np.zeros(1, np.int64), np.cumsum(arity[which]))), np.zeros(len(which), np.int64)
            runs.colour_runs(among, entry[_entries(first, arity, which)], np.arange(len(which)), len(work), LINK_COLOURS, own)
            colour[which] = own
        self._order = order = np.lexsort((colour, kind))
        self._first = np.concatenate((np.zeros(1, np.int64), np.cumsum(arity[order])))
        # Those of the last colour may share particles, and stand alone.
        opens = (np.diff(kind[order], prepend=-1) != 0) | (np.diff(colour[order], prepend=-1) != 0)
        opens |= colour[order] == LINK_COLOURS - 1
        self._part = np.append(np.flatnonzero(opens), count)
        self._particle, self._kind = entry[_entries(first, arity, order)], kind[order]
        self._intact, self._number = np.ones(count, np.uint8), np.zeros((count, link_rows.NUMBERS))
        self._corner, self._gradient, self._along = np.zeros((3, len(entry), 2))
        self.stale, self.changed = False, True

    def begin(self) -> None:
        for name in _NUMBERS if self.changed else MOVING[1:]:
            self._number[:, _NUMBERS[name]] = self.rows[name][self._order]
        self._intact[:] = self.rows["intact"][self._order]
        if self.changed:
            self.changed, self.gives = False, bool(np.isfinite(self.rows["stiffness"]).any())

    def arrays(self) -> tuple[Array, ...]:
        """As `kernels.link_rows.Rows` has them."""
        return (
            self._part, self._first, self._kind, self._intact, self._number, self._particle, self._corner, self._gradient,
            self._along,
        )  # fmt: skip

    def broken(self) -> Array:
        return np.sort(self._order[self._intact != self.rows["intact"][self._order]])

    def pulled(self) -> Array:
        result = np.empty(len(self.rows))
        result[self._order] = self._number[:, link_rows.FORCE]
        return result

    def end(self) -> None:
        self.rows["intact"][self._order] = self._intact
        for name in MOVING[1:]:
            self.rows[name][self._order] = np.where(self._intact, self._number[:, _NUMBERS[name]], 0.0)

    def stored(self, position: Array, seam: Seam) -> float:
        number = self._number.T
        value, _ = _measured(self._first, self._kind, number[link_rows.REST], position[self._particle], seam)
        return float(held(number[link_rows.STIFFNESS], number[link_rows.UPPER], self._intact, value).sum())

    def energy(self, position: Array, seam: Seam) -> float:
        return float(self.energies(position, seam).sum())

    def energies(self, position: Array, seam: Seam) -> Array:
        rows, (value, _) = self.rows, self._measured(position, seam)
        return held(rows["stiffness"], rows["upper"], rows["intact"], value)

    def slope(self, position: Array, seam: Seam) -> Array:
        _, gradient = self._measured(position, seam)
        return np.asarray(np.maximum.reduceat((gradient**2).sum(axis=1), self.first[:-1]))

    def mobility(self, position: Array, inverse_mass: Array, seam: Seam) -> Array:
        _, gradient = self._measured(position, seam)
        moved = inverse_mass[self.entries["particle"]] * (gradient**2).sum(axis=1)
        return np.asarray(np.add.reduceat(moved, self.first[:-1]))

    def _measured(self, position: Array, seam: Seam) -> tuple[Array, Array]:
        return _measured(self.first, self.rows["kind"], self.rows["rest"], position[self.entries["particle"]], seam)


def _entries(first: Array, arity: Array, rows: Array) -> Array:
    """The entries of these rows, one row after the other."""
    count = arity[rows]
    within = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(np.repeat(first[rows], count) + within)


def _measured(first: Array, kind: Array, rest: Any, corner: Array, seam: Seam) -> tuple[Array, Array]:
    """(k,) what each row measures, with its particles in `corner`, and (entries, 2) its gradients."""
    value, gradient = np.empty(len(kind)), np.empty((len(corner), 2))
    rest = np.ascontiguousarray(rest)
    link_rows.measure_rows(first, kind, rest, corner.astype(np.float64), *seam.period, gradient, value)
    return value, gradient
