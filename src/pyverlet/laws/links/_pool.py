"""Where the numbers of links live: one pool for each family, in the order they were added, and packed for the solver."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np

from pyverlet.laws.links._link import REMEMBERED, Array
from pyverlet.laws.links._table import Table
from pyverlet.laws.links._work import Work
from pyverlet.state.seam import Seam

NEVER = 1e300
"""What a row that has not been solved yet would measure next."""


class Pool(ABC):
    """The links of one family. The tables hold the truth between frames, as `State` does for particles.

    Attributes:
        rows: a row for each link, in the order added.
        entries: `particle`, the user's indices of the particles, row after row.
        drawn: whether its rows are lines between their particles.
        stale: rows have come or gone since `pack`.
        changed: numbers of rows have changed since `begin`.
        edits: how often rows have come, gone or been given other numbers.
        gives: whether any row stores energy, once a frame has begun.
    """

    drawn = True
    gives = False

    def __init__(self, **columns: Any) -> None:
        self.rows = Table(
            owner=np.int64, arity=np.int64, stiffness=np.float64, damping=np.float64, strength=np.float64, intact=np.uint8,
            collide=np.uint8, force=np.float64, last=np.float64,
            **dict.fromkeys(REMEMBERED, (np.float64, (2,))), **columns,
        )  # fmt: skip
        self.entries = Table(particle=np.int64)
        self.stale = self.changed = True
        self.edits = 0

    def append(self, owner: int, particles: Array, columns: dict[str, Any]) -> slice:
        """Add a row for each of the (k, p) particles, given in the user's indices."""
        self.stale = True
        self.edits += 1
        count, arity = particles.shape
        self.entries.append(particles.size, particle=particles.ravel())
        return self.rows.append(
            count,
            owner=owner,
            arity=arity,
            intact=1,
            force=0.0,
            last=0.0,
            impulse=0.0,
            load=0.0,
            pull=0.0,
            value=0.0,
            next=NEVER,
            **columns,
        )

    def keep(self, mask: Array) -> None:
        """Remove all other rows."""
        self.stale = True
        self.edits += 1
        self.entries.keep(np.repeat(mask, self.rows["arity"]))
        self.rows.keep(mask)

    @property
    def first(self) -> Array:
        """(k + 1,) where the entries of each row begin."""
        return np.concatenate((np.zeros(1, np.int64), np.cumsum(self.rows["arity"])))

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

    def lines(self) -> tuple[Array, Array]:
        """(m, 2) the particles that follow each other in rows that are intact, and (m,) which row that is."""
        first, particle = self.first, self.entries["particle"]
        row = np.repeat(np.arange(len(self.rows)), self.rows["arity"])
        follows = np.repeat(self.rows["intact"] != 0, self.rows["arity"])
        follows[first[1:] - 1] = False
        inner = np.flatnonzero(follows)
        return np.column_stack((particle[inner], particle[inner + 1])), row[inner]

    @abstractmethod
    def end(self) -> None:
        """The frame is good: write force and who is intact into the table."""

    @abstractmethod
    def energy(self, position: Array, seam: Seam) -> float:
        """Energy stored in soft links at (n, 2) positions in the user's order, J."""

    @abstractmethod
    def energies(self, position: Array, seam: Seam) -> Array:
        """(k,) the same, row by row."""

    def energy_by_pull(self, position: Array, seam: Seam) -> float:
        """As `energy`, but F^2 / 2 k of rows whose value is mostly rounding: no more than what that may hide."""
        rows = self.rows
        if not np.isfinite(rows["stiffness"]).any():
            return 0.0
        energies = self.energies(position, seam)
        stiffness = np.where(np.isfinite(rows["stiffness"]) & (rows["stiffness"] > 0), rows["stiffness"], np.inf)
        size = np.abs(position[self.entries["particle"]]).max(axis=1, initial=0.0).astype(float)
        coarse = float(np.finfo(position.dtype).eps) * np.maximum.reduceat(size, self.first[:-1])
        coarse *= np.sqrt(self.slope(position, seam))
        most = 0.5 * stiffness * (UNSURE * coarse) ** 2
        hidden = (rows["intact"] != 0) & (energies < most) & np.isfinite(stiffness)
        return float(np.where(hidden, np.minimum(0.5 * rows["force"] ** 2 / stiffness, most), energies).sum())

    def slope(self, position: Array, seam: Seam) -> Array:
        """(k,) the largest |grad C|^2 of the particles of each row; 1 for distances."""
        return np.ones(len(self.rows))

    def share_gain(self, before: Array, now: Array, seam: Seam, mass: Array, share: Array) -> None:
        """Add what each row holds at the positions of `now` beyond that `before` to the (n,) share of its first free particle."""
        if len(particle := self.entries["particle"]):
            entry = np.arange(len(particle)) + np.where(np.isfinite(mass[particle]), 0, len(particle))
            whose = particle[np.minimum.reduceat(entry, self.first[:-1]) % len(particle)]
            share += np.bincount(whose, self.energies(now, seam) - self.energies(before, seam), len(share))

    def mobility(self, position: Array, inverse_mass: Array, seam: Seam) -> Array:
        """(k,) sum of w |grad C|^2 over the particles of each row, C being what it measures; gradients of distances are 1."""
        return np.asarray(np.add.reduceat(inverse_mass[self.entries["particle"]], self.first[:-1]))

    @abstractmethod
    def stored(self, position: Array, seam: Seam) -> float:
        """The same in the middle of a frame, of the rows that are intact then, at (m, 2) positions in the order of `Work`."""


UNSURE = 8.0
"""Times the rounding of coordinates: a smaller value of a row is mostly rounding."""


def held(stiffness: Array, upper: Array | float, intact: Array, value: Array) -> Array:
    """(k,) energy of rows, J: none of the rigid, of the broken, nor of slack ropes."""
    pulled = np.isfinite(stiffness) & (intact != 0) & ~((upper <= 0.0) & (value < 0.0))
    return 0.5 * np.where(pulled, stiffness, 0.0) * value * value
