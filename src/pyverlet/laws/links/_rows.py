"""Links that are one equation each, of any kind `kernels.shapes` can measure: one pool of rows, solved beside the chains."""

from __future__ import annotations

import numpy as np

from pyverlet.ground.constants import LINK_COLOURS
from pyverlet.kernels import link_rows, runs
from pyverlet.laws.links._link import MOVING, Array
from pyverlet.laws.links._packed import Packed
from pyverlet.laws.links._work import Work

_NUMBERS = {
    "rest": link_rows.REST, "stiffness": link_rows.STIFFNESS, "damping": link_rows.DAMPING, "upper": link_rows.UPPER,
    "strength": link_rows.STRENGTH, "force": link_rows.FORCE, "last": link_rows.LAST,
}  # fmt: skip
"""Columns of the table, and where the solver has them."""


class PackedRows(Packed):
    """A row for each link, coloured: those of one kind and colour share no particle and are solved beside each other."""

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
            self.changed = False

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


def _entries(first: Array, arity: Array, rows: Array) -> Array:
    """The entries of these rows, one row after the other."""
    count = arity[rows]
    within = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(np.repeat(first[rows], count) + within)
