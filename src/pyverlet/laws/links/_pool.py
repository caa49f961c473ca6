"""The tables with the numbers of a world's links, in the order they were added; and the values of their rows."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.common import memory
from pyverlet.common.arrays import Array
from pyverlet.laws.links._link import CHANGED, REMEMBERED
from pyverlet.state.periodicity import Periodicity

NEVER = 1e300
"""Next value of a row that has not been solved yet."""

UNSURE = 8.0
"""Multiple of the rounding of coordinates below which a row's value is mostly rounding."""

DISTANCE, ANGLE, AREA, MOTOR, PIN = range(5)
"""Kinds of rows, as the core numbers them; the core keeps pins separately."""

TURN = 2.0 * np.pi

_COLUMNS: dict[str, tuple[Any, tuple[int, ...]]] = {
    **dict.fromkeys(("owner", "arity", "kind"), (np.int64, ())), **dict.fromkeys(("intact", "collide"), (np.uint8, ())),
    **dict.fromkeys(("stiffness", "damping", "strength", "force", "rest", "slack", "upper"), (np.float64, ())),
    **dict.fromkeys(("point", *REMEMBERED), (np.float64, (2,))),
}  # fmt: skip
"""Type and entry shape of each column of `Pool.rows`."""

_NEW: dict[str, Any] = {
    **dict.fromkeys(("force", *REMEMBERED, "rest", "slack", "point", "damping"), 0.0),
    "stiffness": np.inf, "strength": np.inf, "intact": 1, "next": NEVER,
}  # fmt: skip
"""Initial values of rows."""


class Pool:
    """The links of a world as rows. They are valid between frames, as `State` is for particles.

    Attributes:
        rows: columns by name, an entry for each link, in the order added; valid until rows are added or removed.
        particle: (entries,) the user's indices of the particles, row after row.
        edits: how often rows were added, removed or changed.
        live: within a frame, rows, and an array of which of them are intact.
    """

    def __init__(self) -> None:
        self.rows = self._buffers = {name: np.empty((0, *shape), dtype) for name, (dtype, shape) in _COLUMNS.items()}
        self.particle = np.empty(0, np.int64)
        self.edits = 0
        self.live: list[tuple[Array, Array]] = []
        self._known = self._steady = -1  # values of `edits` for which row types, and absence of own work, are known
        self._gives = self._has_motor = False

    def __len__(self) -> int:
        return len(self.rows["owner"])

    def append(self, owner: int, particles: Array, values: dict[str, Any]) -> None:
        """Add a row for each of the (k, p) particles, the user's indices; values have an entry for each row, or one for all."""
        known, (count, arity) = len(self), particles.shape
        self.particle = memory.extended(self.particle, particles.ravel())
        if known + count > len(self._buffers["owner"]):  # doubling: adding one by one costs O(1) each on average
            self._buffers = {
                name: np.resize(column, (2 * known + count, *column.shape[1:])) for name, column in self.rows.items()
            }
        for name, value in (_NEW | values | {"owner": owner, "arity": arity}).items():
            self._buffers[name][known : known + count] = value
        self._edit({name: column[: known + count] for name, column in self._buffers.items()})

    def keep(self, mask: Array) -> None:
        """Keep these rows and remove all others."""
        self.particle = self.particle[np.repeat(mask, self.rows["arity"])]
        self._buffers = {name: column[mask] for name, column in self.rows.items()}
        self._edit(self._buffers)

    def save(self) -> tuple[dict[str, Array], Array]:
        """A copy of all rows, and of their particles."""
        return {name: column.copy() for name, column in self.rows.items()}, self.particle.copy()

    def restore(self, rows: dict[str, Array], particle: Array) -> None:
        """Set the rows that `save` returned."""
        self._buffers, self.particle = {name: column.copy() for name, column in rows.items()}, particle.copy()
        self._edit(self._buffers)

    def _edit(self, rows: dict[str, Array]) -> None:
        self.rows, self.live = rows, []
        self.edits += 1

    @property
    def gives(self) -> bool:
        """Whether any row stores energy."""
        self._look()
        return self._gives

    @property
    def drives(self) -> bool:
        """Whether any row does work in the coming frame: a motor, or a row that was changed."""
        if self._steady != self.edits:  # without changes none will be until rows are edited
            if self.has_motor or ((self.rows["next"][:, 0] == CHANGED) & (self.rows["intact"] != 0)).any():
                return True
            self._steady = self.edits
        return False

    @property
    def has_motor(self) -> bool:
        """Whether any row is a motor."""
        self._look()
        return self._has_motor

    def _look(self) -> None:
        """Update the facts about rows, if any have been edited."""
        if self._known != self.edits:
            self._gives = bool(np.isfinite(self.rows["stiffness"]).any())
            self._known, self._has_motor = self.edits, bool((self.rows["kind"] == MOTOR).any())

    @property
    def first(self) -> Array:
        """(k + 1,) offset of each row's entries."""
        return np.concatenate((np.zeros(1, np.int64), np.cumsum(self.rows["arity"])))

    def lines(self) -> tuple[Array, Array]:
        """(m, 2) consecutive particles in intact rows, and (m,) the rows."""
        first, row = self.first, np.repeat(np.arange(len(self)), self.rows["arity"])
        follows = self.rows["intact"][row] != 0
        follows[first[1:] - 1] = False
        inner = np.flatnonzero(follows)
        return np.column_stack((self.particle[inner], self.particle[inner + 1])), row[inner]

    def distances(self) -> tuple[Array, Array]:
        """`lines` of sticks, ropes and springs alone, which are drawn."""
        row = np.flatnonzero((self.rows["kind"] == DISTANCE) & (self.rows["intact"] != 0))
        entry = self.first[row]
        return np.column_stack((self.particle[entry], self.particle[entry + 1])), row

    # ---- what it measures: positions are (n, 2) m, in the user's order -------------------------------------------------

    def values(self, position: Array, periodic: Periodicity) -> Array:
        """(k,) value C of each row, relative to rest."""
        kind, first = self.rows["kind"], self.first
        value = self._bent(position, periodic)[0]
        row = np.flatnonzero(kind == DISTANCE)
        start, end = (position[self.particle[first[row] + side]] for side in (0, 1))
        value[row] = np.hypot(*periodic.nearest(end.astype(float) - start).T) - self.rows["rest"][row]
        row = np.flatnonzero(kind == PIN)
        away = position[self.particle[first[row]]].astype(float) - self.rows["point"][row]
        value[row] = np.hypot(*periodic.nearest(away).T)
        return value

    def gradients(self, position: Array, periodic: Periodicity) -> Array:
        """(entries,) |grad C|^2; 1 for distances and pins."""
        straight = np.repeat(np.isin(self.rows["kind"], (DISTANCE, PIN)), self.rows["arity"])
        return np.where(straight, 1.0, (self._bent(position, periodic)[1] ** 2).sum(axis=1))

    def _bent(self, position: Array, periodic: Periodicity) -> tuple[Array, Array]:
        """(k,) C of angles and areas, and (entries, 2) its gradients; 0 for others."""
        kind, rest, first = self.rows["kind"], self.rows["rest"], self.first
        value, gradient = np.zeros(len(kind)), np.zeros((len(self.particle), 2))
        if not np.isin(kind, (ANGLE, AREA)).any():
            return value, gradient
        corner = position[self.particle].astype(np.float64)
        if (angles := np.flatnonzero(kind == ANGLE)).size:
            e = first[angles]
            a, b = periodic.nearest(corner[e] - corner[e + 1]), periodic.nearest(corner[e + 2] - corner[e + 1])
            turn = np.arctan2(cross(a, b), (a * b).sum(axis=1)) - rest[angles]
            value[angles] = turn - TURN * np.floor(turn / TURN + 0.5)
            gradient[e] = across(a) / np.maximum((a * a).sum(axis=1), 1e-300)[:, None]
            gradient[e + 2] = -across(b) / np.maximum((b * b).sum(axis=1), 1e-300)[:, None]
            gradient[e + 1] = -gradient[e] - gradient[e + 2]
        for row in np.flatnonzero(kind == AREA):
            here = slice(first[row], first[row + 1])
            way = periodic.nearest(corner[here] - corner[first[row]])  # triangles at the first particle
            after, before = np.roll(way, -1, axis=0), np.roll(way, 1, axis=0)
            value[row] = 0.5 * cross(way, after).sum() - rest[row]
            gradient[here] = 0.5 * across(after - before)
        return value, gradient

    def _families(self) -> list[Any]:
        """Rows of distances, of angles and areas, and of pins, in order of first appearance; energies are summed by them."""
        distance, pin = (self.rows["kind"] == kind for kind in (DISTANCE, PIN))
        known = [family for family in (distance, ~(distance | pin), pin) if family.any()]
        return sorted(known, key=np.argmax) if len(known) > 1 else [slice(None)] * len(known)

    def energies(self, position: Array, periodic: Periodicity) -> Array:
        """(k,) energy stored in each row, J: 0 for rigid and broken rows, and slack ropes."""
        stiffness, value, intact = self.rows["stiffness"], self.values(position, periodic), self.rows["intact"].copy()
        for rows, now in self.live:
            intact[rows] = now
        pulled = np.isfinite(stiffness) & (intact != 0) & ~((self.rows["upper"] <= 0.0) & (value < 0.0))
        return np.asarray(0.5 * np.where(pulled, stiffness, 0.0) * value * value)

    def energy(self, position: Array, periodic: Periodicity) -> float:
        """Energy stored in soft links, J."""
        return self._summed(self.energies(position, periodic)) if self.gives else 0.0

    def _summed(self, energies: Array) -> float:
        return sum(float(energies[rows].sum()) for rows in self._families())

    def energy_by_pull(self, position: Array, periodic: Periodicity) -> float:
        """As `energy`, but at most F^2 / 2 k for rows whose value is mostly rounding."""
        rows = self.rows
        if not self.gives:
            return 0.0
        energies, soft = self.energies(position, periodic), np.isfinite(rows["stiffness"]) & (rows["stiffness"] > 0)
        stiffness = np.where(soft, rows["stiffness"], 1.0)
        size = np.abs(position[self.particle]).max(axis=1, initial=0.0).astype(float)
        coarse = float(np.finfo(position.dtype).eps) * np.maximum.reduceat(size, self.first[:-1])
        coarse *= np.sqrt(np.maximum.reduceat(self.gradients(position, periodic), self.first[:-1]))
        most = 0.5 * stiffness * (UNSURE * coarse) ** 2
        hidden = (rows["intact"] != 0) & (energies < most) & soft
        return self._summed(np.where(hidden, np.minimum(0.5 * rows["force"] ** 2 / stiffness, most), energies))

    def gains(self, before: Array, now: Array, periodic: Periodicity, mass: Array) -> Array:
        """(n,) J, energy of rows at the positions `now` minus that at `before`, each at its first free particle."""
        share = np.zeros(len(mass))
        if self.gives:
            entry = np.arange(len(self.particle)) + np.where(np.isfinite(mass[self.particle]), 0, len(self.particle))
            whose = self.particle[np.minimum.reduceat(entry, self.first[:-1]) % len(self.particle)]
            gained = self.energies(now, periodic) - self.energies(before, periodic)
            for rows in self._families():
                share += np.bincount(whose[rows], gained[rows], len(share))
        return share

    def mobility(self, position: Array, inverse_mass: Array, periodic: Periodicity) -> Array:
        """(k,) sum of w |grad C|^2 over the particles of each row, C being its value."""
        moved = inverse_mass[self.particle] * self.gradients(position, periodic)
        return np.asarray(np.add.reduceat(moved, self.first[:-1]))


def cross(a: Array, b: Array) -> Array:
    """(k,) cross products of (k, 2) and (k, 2)."""
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def across(a: Array) -> Array:
    """(k, 2) rotated by a right angle, clockwise."""
    return np.column_stack((a[:, 1], -a[:, 0]))
