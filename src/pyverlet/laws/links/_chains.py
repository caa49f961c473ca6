"""Links of two particles' distance: those that follow each other are runs, solved at once and eight beside each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.compile import jit
from pyverlet.compile.lanes import LANES
from pyverlet.compile.stealing import Claims
from pyverlet.ground.constants import LINK_COLOURS, LINKS_ONE_THREAD_BELOW
from pyverlet.kernels import chain_rows, chains, runs
from pyverlet.laws.links._link import MOVING, Array
from pyverlet.laws.links._packed import Packed
from pyverlet.laws.links._pool import Pool
from pyverlet.laws.links._work import Work

GIVEN = ("rest", "stiffness", "damping", "upper", "strength")
"""Columns that frames leave alone."""


class PackedChains(Packed):
    """Runs in packs of eight that share no particle, as `kernels.chains` wants them, whose rows have the world's dtype."""

    def __init__(self, pool: Pool, dtype: np.dtype[Any]) -> None:
        super().__init__(pool)
        self.dtype = dtype
        self._claims = Claims()
        self._taken_up = self._under_way = False
        self._blended = np.zeros(1, np.uint8)

    def pack(self, work: Work) -> None:
        """By colour, and within a colour long runs first, so that runs of a pack are as long as each other.

        Of those alike in that, those with a pin: they carry weight, and a pack in which one resists being turned is solved so.
        """
        self.rows.write()  # from what is packed otherwise from now on
        count, self._ends = len(self.rows), work.compact[self.entries["particle"]].reshape(-1, 2)
        given, ends, run_of = np.empty(count, np.int64), np.empty_like(self._ends), np.empty(count, np.int64)
        number = runs.find_runs(self._ends, self.rows["intact"], len(work), given, ends, run_of)
        colour = np.zeros(number, np.int64)
        runs.colour_runs(self.first, ends.ravel(), run_of, len(work), LINK_COLOURS, colour)
        length = np.bincount(run_of, minlength=number)
        alone = colour == LINK_COLOURS - 1  # these may share particles: each is a pack, and a colour, of its own
        pinned = np.bincount(run_of, work.pinned[ends].any(axis=1), number) > 0
        order = np.lexsort((~(pinned | alone), np.where(alone, 0, -length), colour))
        rank = np.arange(number) - np.searchsorted(colour[order], colour[order])
        lane = np.where(alone[order], 0, rank % LANES)
        opens = np.flatnonzero(lane == 0)
        run_at = _place(order, opens)
        self._lanes = np.diff(np.append(opens, number))
        longest = np.maximum.reduceat(length[order], opens) if number else np.zeros(0, np.int64)
        self._start = LANES * np.concatenate((np.zeros(1, np.int64), np.cumsum(longest + 1)))
        new = (np.diff(colour[order][opens], prepend=-1) != 0) | alone[order][opens]
        self._colour = np.append(np.flatnonzero(new), len(opens))
        begin, items = np.cumsum(length) - length, int(self._start[-1])
        self._source, self._node, self._place = np.empty(items, np.int64), np.empty(items, np.uint32), np.empty(count, np.int64)
        runs.lay_out(given, ends, begin, length, run_at, self._start, self._source, self._node, self._place)
        self._row = np.zeros(chain_rows.ROW * len(self._source), self.dtype)
        self._more = np.zeros(chain_rows.EXTRA * len(self._source), self.dtype)
        self._kept = np.zeros(chain_rows.KEPT * len(self._source), self.dtype)
        self._bowed, self._torn, self._holds = np.zeros((3, len(opens)), np.uint8)
        parts = 1 if len(work) < LINKS_ONE_THREAD_BELOW else jit.max_threads()
        items = LANES * (int(longest.max(initial=0)) + 1)
        self._rooms, self._wide = np.zeros((parts, chains.SCRATCH * items), self.dtype), np.zeros((parts, chains.WIDE * items))
        self.stale, self.changed, self._taken_up = False, True, False

    def begin(self) -> None:
        source, rows = self._source, self.rows
        if self.changed:
            self.changed = False
            chain_rows.lay(source, self._start, self._row, self._more, self._holds, *(rows[name] for name in GIVEN))
        if not self._taken_up:
            chain_rows.take_up(source, self._row, *(rows[name] for name in MOVING))
            chain_rows.keep(self._row, self._kept)
        elif self._under_way:  # that frame was no good
            chain_rows.go_back(self._row, self._kept)
        self._torn.fill(0)
        self._blended[0] = 0
        self._taken_up = self._under_way = True

    def arrays(self) -> tuple[Array, ...]:
        """As `kernels.linked.Linked` has them."""
        return (
            self._colour, self._start, self._node, self._holds, self._lanes, self._bowed, self._blended, self._torn,
            self._row, self._more, self._rooms, self._wide, self._claims(),
        )  # fmt: skip

    def broken(self) -> Array:
        if not self._torn.any():
            return np.empty(0, np.int64)
        return np.flatnonzero(chain_rows.intact(self._place, self._row) != self.rows["intact"])

    def pulled(self) -> Array:
        return np.asarray(self._row[self._place // LANES * (LANES * chain_rows.ROW) + self._place % LANES + chain_rows.FORCE])

    def end(self) -> None:
        chain_rows.keep(self._row, self._kept)
        self._under_way = False
        if self._torn.any():
            self._write()
        else:  # nobody else's wholeness changes in a frame
            self.rows.write_late(("force", "last"), self._write)

    def _write(self) -> None:
        chain_rows.hand_over(self._place, self._kept, *(self.rows[name] for name in MOVING))


def _place(order: Array, opens: Array) -> Array:
    """(packs, LANES) the run in each lane; a pack that is not full repeats its last one."""
    end = np.append(opens[1:], len(order))
    where = np.minimum(opens[:, None] + np.arange(LANES), end[:, None] - 1)
    return np.asarray(order[where])
