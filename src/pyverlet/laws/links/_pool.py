"""Where the numbers of links live, one pool for each family, in the order they were added; and what their rows measure."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from pyverlet.ground.arrays import Array
from pyverlet.laws.links._link import CHANGED, REMEMBERED
from pyverlet.state.seam import Seam

NEVER = 1e300
"""What a row that has not been solved yet would measure next."""

UNSURE = 8.0
"""Times the rounding of coordinates: a smaller value of a row is mostly rounding."""

ANGLE, AREA, MOTOR = range(3)
"""Kinds of rows that are no distances."""

TURN = 2.0 * np.pi


class Table:
    """Named columns of equal length. `table["name"]` is a view, good until rows are added or removed.

    Args:
        columns: names and what they hold: a dtype, or (dtype, shape of an entry).
    """

    def __init__(self, **columns: DTypeLike | tuple[DTypeLike, tuple[int, ...]]) -> None:
        self._length = 0
        self._store: dict[str, Array] = {}
        for name, kind in columns.items():
            dtype, shape = kind if isinstance(kind, tuple) else (kind, ())
            self._store[name] = np.empty((0, *shape), dtype)

    def __len__(self) -> int:
        return self._length

    def __contains__(self, name: str) -> bool:
        return name in self._store

    def __getitem__(self, name: str) -> Array:
        return self._store[name][: self._length]

    def append(self, count: int, **values: Any) -> slice:
        """Add `count` rows; a value is an entry for each, or one for all. Returns where they stand."""
        where = slice(self._length, self._length + count)
        for name, old in self._store.items():
            if where.stop > len(old):  # doubling: adding one by one costs O(1) each on average
                self._store[name] = np.empty((max(where.stop, 2 * len(old)), *old.shape[1:]), old.dtype)
                self._store[name][: where.start] = old[: where.start]
            self._store[name][where] = values[name]
        self._length = where.stop
        return where

    def __getstate__(self) -> dict[str, Array]:
        return {name: self[name] for name in self._store}

    def __setstate__(self, columns: dict[str, Array]) -> None:
        self.__init__()  # type: ignore[misc]
        self._store = columns
        self._length = len(next(iter(columns.values()), ()))

    def copy(self) -> Table:
        """Another one with the same rows."""
        other = Table()
        other._store = {name: self[name].copy() for name in self._store}
        other._length = self._length
        return other

    def keep(self, mask: Array) -> None:
        """Remove all other rows."""
        self._store = {name: self[name][mask] for name in self._store}
        self._length = int(np.count_nonzero(mask))


_NEW: dict[str, Any] = dict.fromkeys(("force", *REMEMBERED), 0.0) | {"intact": 1, "next": NEVER}
"""What rows begin with."""


class Pool(ABC):
    """The links of one family. The tables hold the truth between frames, as `State` does for particles.

    Attributes:
        rows: a row for each link, in the order added.
        entries: `particle`, the user's indices of the particles, row after row.
        drawn: whether its rows are lines between their particles.
        edits: how often rows have come, gone or been given other numbers.
        live: within a frame, rows, and an array of which are intact, with the places of these in it.
    """

    drawn = True

    def __init__(self, **columns: Any) -> None:
        self.rows = Table(
            owner=np.int64, arity=np.int64, stiffness=np.float64, damping=np.float64, strength=np.float64, intact=np.uint8,
            collide=np.uint8, force=np.float64,
            **dict.fromkeys(REMEMBERED, (np.float64, (2,))), **columns,
        )  # fmt: skip
        self.entries = Table(particle=np.int64)
        self.edits = 0
        self.live: tuple[Array, Array, Array] | None = None
        self._gives = -1, False  # the same, as of so many edits

    def append(self, owner: int, particles: Array, columns: dict[str, Any]) -> slice:
        """Add a row for each of the (k, p) particles, given in the user's indices."""
        self._edit()
        count, arity = particles.shape
        self.entries.append(particles.size, particle=particles.ravel())
        return self.rows.append(count, owner=owner, arity=arity, **_NEW, **columns)

    def keep(self, mask: Array) -> None:
        """Remove all other rows."""
        self._edit()
        self.entries.keep(np.repeat(mask, self.rows["arity"]))
        self.rows.keep(mask)

    def _edit(self) -> None:
        self.live = None
        self.edits += 1

    @property
    def gives(self) -> bool:
        """Whether any row stores energy."""
        if self._gives[0] != self.edits:
            self._gives = self.edits, bool(np.isfinite(self.rows["stiffness"]).any())
        return self._gives[1]

    @property
    def drives(self) -> bool:
        """Whether any row does work of its own in the frame that comes: a motor, or one that has been changed."""
        rows = self.rows
        changed = (rows["next"][:, 0] == CHANGED) & (rows["intact"] != 0)
        return bool(changed.any()) or self.has_motor

    @property
    def has_motor(self) -> bool:
        """Whether any row is a motor."""
        return "kind" in self.rows and bool((self.rows["kind"] == MOTOR).any())

    @property
    def first(self) -> Array:
        """(k + 1,) where the entries of each row begin."""
        return np.concatenate((np.zeros(1, np.int64), np.cumsum(self.rows["arity"])))

    def lines(self) -> tuple[Array, Array]:
        """(m, 2) the particles that follow each other in rows that are intact, and (m,) which row that is."""
        first, particle = self.first, self.entries["particle"]
        row = np.repeat(np.arange(len(self.rows)), self.rows["arity"])
        follows = np.repeat(self.rows["intact"] != 0, self.rows["arity"])
        follows[first[1:] - 1] = False
        inner = np.flatnonzero(follows)
        return np.column_stack((particle[inner], particle[inner + 1])), row[inner]

    # ---- what it measures ----------------------------------------------------------------------------------------------

    @abstractmethod
    def values(self, position: Array, seam: Seam) -> Array:
        """(k,) what each row measures beyond that at rest, with the particles at (n, 2) positions in the user's order."""

    def gradients(self, position: Array, seam: Seam) -> Array:
        """(entries,) |grad C|^2; 1 for distances."""
        return np.ones(len(self.entries))

    def energies(self, position: Array, seam: Seam) -> Array:
        """(k,) J stored in each row: none in the rigid, in the broken, nor in slack ropes."""
        stiffness, value, intact = self.rows["stiffness"], self.values(position, seam), self.rows["intact"].copy()
        if self.live:
            rows, now, where = self.live
            intact[rows] = now[where]
        pulled = np.isfinite(stiffness) & (intact != 0) & ~((self._upper() <= 0.0) & (value < 0.0))
        return np.asarray(0.5 * np.where(pulled, stiffness, 0.0) * value * value)

    def _upper(self) -> Any:
        return self.rows["upper"]

    def energy(self, position: Array, seam: Seam) -> float:
        """Energy stored in soft links, J."""
        return float(self.energies(position, seam).sum()) if self.gives else 0.0

    def energy_by_pull(self, position: Array, seam: Seam) -> float:
        """As `energy`, but F^2 / 2 k of rows whose value is mostly rounding: no more than what that may hide."""
        rows = self.rows
        if not self.gives:
            return 0.0
        energies = self.energies(position, seam)
        stiffness = np.where(np.isfinite(rows["stiffness"]) & (rows["stiffness"] > 0), rows["stiffness"], np.inf)
        size = np.abs(position[self.entries["particle"]]).max(axis=1, initial=0.0).astype(float)
        coarse = float(np.finfo(position.dtype).eps) * np.maximum.reduceat(size, self.first[:-1])
        coarse *= np.sqrt(np.maximum.reduceat(self.gradients(position, seam), self.first[:-1]))
        most = 0.5 * stiffness * (UNSURE * coarse) ** 2
        hidden = (rows["intact"] != 0) & (energies < most) & np.isfinite(stiffness)
        return float(np.where(hidden, np.minimum(0.5 * rows["force"] ** 2 / stiffness, most), energies).sum())

    def share_gain(self, before: Array, now: Array, seam: Seam, mass: Array, share: Array) -> None:
        """Add what each row holds at the positions of `now` beyond that `before` to the (n,) share of its first free particle."""
        if len(particle := self.entries["particle"]) and self.gives:
            entry = np.arange(len(particle)) + np.where(np.isfinite(mass[particle]), 0, len(particle))
            whose = particle[np.minimum.reduceat(entry, self.first[:-1]) % len(particle)]
            share += np.bincount(whose, self.energies(now, seam) - self.energies(before, seam), len(share))

    def mobility(self, position: Array, inverse_mass: Array, seam: Seam) -> Array:
        """(k,) sum of w |grad C|^2 over the particles of each row, C being what it measures."""
        moved = inverse_mass[self.entries["particle"]] * self.gradients(position, seam)
        return np.asarray(np.add.reduceat(moved, self.first[:-1]))


class DistancePool(Pool):
    """Sticks, ropes and springs."""

    def __init__(self) -> None:
        super().__init__(rest=np.float64, upper=np.float64)

    def values(self, position: Array, seam: Seam) -> Array:
        return stretches(position[self.entries["particle"]], self.rows["rest"], seam)

    def lines(self) -> tuple[Array, Array]:
        pairs, intact = self.entries["particle"].reshape(-1, 2), self.rows["intact"]
        return (pairs, np.arange(len(pairs))) if intact.all() else (pairs[row := np.flatnonzero(intact)], row)


class RowPool(Pool):
    """Angles, areas and motors."""

    drawn = False

    def __init__(self) -> None:
        super().__init__(rest=np.float64, slack=np.float64, upper=np.float64, kind=np.int64)

    def values(self, position: Array, seam: Seam) -> Array:
        return self._measured(position, seam)[0]

    def gradients(self, position: Array, seam: Seam) -> Array:
        return np.asarray((self._measured(position, seam)[1] ** 2).sum(axis=1))

    def _measured(self, position: Array, seam: Seam) -> tuple[Array, Array]:
        return measured(self.first, self.rows["kind"], self.rows["rest"], position[self.entries["particle"]], seam)


class PinPool(Pool):
    """Pins: what they measure is how far their particle is away."""

    drawn = False

    def __init__(self) -> None:
        super().__init__(point=(np.float64, (2,)))

    def values(self, position: Array, seam: Seam) -> Array:
        away = seam.nearest(position[self.entries["particle"]].astype(float) - self.rows["point"])
        return np.asarray(np.hypot(*away.T))

    def _upper(self) -> Any:
        return np.inf


def cross(a: Array, b: Array) -> Array:
    """(k,) of (k, 2) and (k, 2)."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def across(a: Array) -> Array:
    """(k, 2) turned by a right angle, clockwise."""
    return np.column_stack((a[:, 1], -a[:, 0]))


def stretches(corner: Array, rest: Array, seam: Seam) -> Array:
    """(k,) how much farther than at rest the (2 k, 2) ends of each are apart, m."""
    return np.asarray(np.hypot(*seam.nearest(corner[1::2].astype(float) - corner[::2]).T) - rest)


def measured(first: Array, kind: Array, rest: Array, corner: Array, seam: Seam) -> tuple[Array, Array]:
    """(k,) what angles and areas measure beyond that at rest, with their particles in `corner`, and (entries, 2) gradients."""
    value, gradient, corner = np.zeros(len(kind)), np.zeros((len(corner), 2)), corner.astype(np.float64)
    if (angles := np.flatnonzero(kind == ANGLE)).size:
        e = first[angles]
        a, b = seam.nearest(corner[e] - corner[e + 1]), seam.nearest(corner[e + 2] - corner[e + 1])
        turn = np.arctan2(cross(a, b), (a * b).sum(axis=1)) - rest[angles]
        value[angles] = turn - TURN * np.floor(turn / TURN + 0.5)
        gradient[e] = across(a) / np.maximum((a * a).sum(axis=1), 1e-300)[:, None]
        gradient[e + 2] = -across(b) / np.maximum((b * b).sum(axis=1), 1e-300)[:, None]
        gradient[e + 1] = -gradient[e] - gradient[e + 2]
    for row in np.flatnonzero(kind == AREA):
        here = slice(first[row], first[row + 1])
        way = seam.nearest(corner[here] - corner[first[row]])  # triangles at the first particle
        after, before = np.roll(way, -1, axis=0), np.roll(way, 1, axis=0)
        value[row] = 0.5 * cross(way, after).sum() - rest[row]
        gradient[here] = 0.5 * across(after - before)
    return value, gradient
