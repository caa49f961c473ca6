"""Links that are one equation each: one function measures them, a common solver solves them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from pyverlet.ground.constants import LINK_COLOURS
from pyverlet.kernels import links, runs
from pyverlet.laws.links._link import Array
from pyverlet.laws.links._pool import MOVING, Pool, held
from pyverlet.laws.links._work import Work
from pyverlet.state.seam import Seam

Measure = Callable[..., None]
"""A function of kernels.shapes, or one of its form."""

_GIVEN = ("rest", "stiffness", "damping", "upper", "strength")
_SCRATCH = ("value", "start", "earlier", "bend", "give", "offset", "turn", "bow", "lam")


class RowPool(Pool):
    """A row for each link, coloured: those of one colour share no particle and are solved beside each other.

    Args:
        measure: value and gradient of the rows.
        turn: as in Pool.
        drawn: as in Pool.
    """

    def __init__(self, measure: Measure, turn: int, *, drawn: bool = True) -> None:
        super().__init__(turn, rest=np.float64, upper=np.float64)
        self.measure = measure
        self.drawn = drawn

    def _find_runs(self, first: Array, entry: Array, particles: int) -> Array:
        """(k,) which rows are solved together: here each for itself. Rows of a run follow each other."""
        return np.arange(len(self.rows))

    def pack(self, work: Work) -> None:
        """By colour, and within a colour in the order added: `_run` and `_colour` say where runs and colours begin."""
        count, first, entry = len(self.rows), self.first, work.compact[self.entries["particle"]]
        run_of, colour = self._find_runs(first, entry, len(work)), np.zeros(count, np.int64)
        runs.colour_runs(first, entry, run_of, len(work), LINK_COLOURS, colour)
        self._order = np.argsort(colour[run_of], kind="stable")
        arity = self.rows["arity"][self._order]
        self._first = np.concatenate((np.zeros(1, np.int64), np.cumsum(arity)))
        within = np.arange(len(entry)) - np.repeat(self._first[:-1], arity)
        self._particle = entry[np.repeat(first[self._order], arity) + within]
        starts = np.flatnonzero(np.diff(run_of[self._order], prepend=-1))
        self._run = np.append(starts, count)
        self._colour = np.searchsorted(colour[run_of[self._order[starts]]], np.arange(LINK_COLOURS + 1))
        self.parts = list(self._together())
        self.colours = int(np.count_nonzero(np.diff(self._colour)))
        self._row: dict[str, Array] = {name: np.zeros(count) for name in _SCRATCH}
        self._gradient, self._along = np.zeros((2, len(entry), 2))
        self.stale, self.changed = False, True

    def begin(self) -> None:
        row = self._row
        if self.changed:
            self.changed = False
            row |= {name: self.rows[name][self._order] for name in _GIVEN}
            self._look_for_soft(np.flatnonzero(np.isfinite(row["stiffness"])))
            self._brittle = bool(np.isfinite(row["strength"]).any())
        row |= {name: self.rows[name][self._order] for name in MOVING}

    def _look_for_soft(self, soft: Array) -> None:
        """Note the packed rows that give, and room to measure them alone."""
        self.gives, self._soft = bool(len(soft)), soft
        arity = np.diff(self._first)[soft]
        first = np.concatenate((np.zeros(1, np.int64), np.cumsum(arity)))
        within = np.arange(first[-1]) - np.repeat(first[:-1], arity)
        particle = self._particle[np.repeat(self._first[soft], arity) + within]
        self._soft_rows = first, particle, self._row["rest"][soft], 0, len(soft)
        self._soft_value, self._soft_bend = np.empty((2, len(soft)))
        self._soft_gradient = np.empty((len(particle), 2))

    def before(self, work: Work, h: float) -> None:
        row, which = self._row, (self._first, self._particle, self._row["rest"], 0, len(self._order))
        if self.gives:
            earlier = work.start - work.back.astype(np.float64)
            self.measure(earlier, *work.seam.period, *which, row["earlier"], self._gradient, row["bend"])
        self.measure(work.start.astype(np.float64), *work.seam.period, *which, row["start"], self._along, row["bend"])
        links.prepare(
            self._first, self._particle, work.weight, row["stiffness"], row["damping"], row["upper"], h, row["start"],
            row["earlier"], self._along, row["bend"], row["force"], row["last"], row["give"],
            row["offset"], row["turn"], row["bow"], row["lam"],
        )  # fmt: skip
        if self.gives:
            position, given = work.position, (self._first, self._particle, work.weight, row["intact"], self._along, row["lam"])
            for a, b in self.parts:
                links.begin_rows(int(self._run[a]), int(self._run[b]), position, *given)
            work.position = position

    def _together(self) -> Iterator[tuple[int, int]]:
        """Runs a to b that may be solved beside each other; those of the last colour may share particles and stand alone."""
        for colour, begin in enumerate(map(int, self._colour[:-1])):
            end = int(self._colour[colour + 1])
            if begin == end:
                return
            if colour < LINK_COLOURS - 1:
                yield begin, end
            else:
                yield from zip(range(begin, end), range(begin + 1, end + 1), strict=True)

    def sweep(self, work: Work, *, back: bool, skip: bool) -> None:
        row, position = self._row, work.position
        parts = self.parts[::-1] if back else self.parts
        for a, b in parts[1:] if skip else parts:
            begin, end = int(self._run[a]), int(self._run[b])
            which = (self._first, self._particle, row["rest"], begin, end)
            self.measure(position, *work.seam.period, *which, row["value"], self._gradient, row["bend"])
            links.solve_rows(
                begin, end, position, self._first, self._particle, work.weight, row["upper"], row["intact"], row["value"],
                self._gradient, self._along, row["turn"], row["give"], row["offset"], row["lam"],
            )  # fmt: skip
        work.position = position

    def note(self, work: Work, h: float) -> None:
        row = self._row
        links.note_force(row["force"], row["last"], row["lam"], row["intact"], h)
        if self._brittle:
            links.snap(row["force"], row["strength"], row["intact"])

    def broken(self) -> Array:
        if not self._brittle:
            return np.empty(0, np.int64)
        return np.sort(self._order[self._row["intact"] != self.rows["intact"][self._order]])

    def pulled(self) -> Array:
        result = np.empty_like(self._row["force"])
        result[self._order] = self._row["force"]
        return result

    def end(self) -> None:
        for name in MOVING:
            self.rows[name][self._order] = np.where(self._row["intact"], self._row[name], 0)

    def stored(self, position: Array, seam: Seam) -> float:
        row, soft, value = self._row, self._soft, self._soft_value
        self.measure(position, *seam.period, *self._soft_rows, value, self._soft_gradient, self._soft_bend)
        return float(held(row["stiffness"][soft], row["upper"][soft], row["intact"][soft], value).sum())

    def energy(self, position: Array, seam: Seam) -> float:
        return float(self.energies(position, seam).sum())

    def energies(self, position: Array, seam: Seam) -> Array:
        position = position.astype(float)
        rows, first, particle = self.rows, self.first, self.entries["particle"]
        value, bend, gradient = np.empty(len(rows)), np.empty(len(rows)), np.empty((len(particle), 2))
        self.measure(position, *seam.period, first, particle, rows["rest"], 0, len(rows), value, gradient, bend)
        return held(rows["stiffness"], rows["upper"], rows["intact"], value)
