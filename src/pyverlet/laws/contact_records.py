"""Contact records of the last frame, with their points and impulses: `ContactRecords` reads them from the engine on demand.

Impulses are summed substep by substep; points and normals are those at the end of the frame.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.common.arrays import Array, Floats
from pyverlet.common.shown import Records
from pyverlet.core import unit
from pyverlet.laws.events import renumber

WALLS, PAIRS = -1, -2
"""Values instead of the number of an obstacle."""

CONTACT_RECORD = np.dtype(
    [
        ("a", np.int64), ("b", np.int64), ("wall", np.int64), ("obstacle", np.int64), ("point", np.float64, (2,)),
        ("normal", np.float64, (2,)), ("impulse", np.float64), ("rub", np.float64), ("number", np.int64, (2,)),
    ]
)  # fmt: skip
"""A contact: circle a and circle b, or b = -1 and the number of a wall or of an obstacle (the others are -1); point of contact,
m; unit normal out of a; normal impulse, and tangential impulse on a along (-n_y, n_x), summed over the frame, N s; permanent
numbers (`world.number`) of both circles, -1 instead of b."""


class Pushes(NamedTuple):
    """Normal forces between circles, averaged over a frame."""

    pairs: Array
    """(m, 2) numbers of the circles; twice the same for the sum over walls or obstacles."""
    force: Floats
    """(m,) repulsive force, N."""
    angle: Floats
    """(m,) rad, direction of the normal out of the first."""


class ContactRecords:
    """The contacts of the last frame. Indices are those at its end.

    Attributes:
        records: TOUCH, sorted by a, then b; without removed particles. Renumbered when particles are removed later.
        dt: length of that frame, s.
    """

    def __init__(self, engine: Any) -> None:
        """engine: of the core, which records contacts from the next frame on."""
        self._engine = engine
        self._frame = 0  # frame read last
        self._shown: list[Array] = [Records(0, CONTACT_RECORD)]  # all arrays returned as its `records`
        self.records = self._shown[0]
        self._given = (
            np.empty(0, np.int64),
            np.empty((0, 7)),
            np.empty(0, np.int64),
        )  # keys, rows and order, see `core.contact_recording`
        self.dt = np.inf

    def take(self, number: Array, obstacles: int, sleepers: tuple[Array, Floats] | None = None) -> None:
        """Read the engine's records unless they are known; only while particles and links are unchanged since the frame.

        number: permanent numbers; obstacles: their number; sleepers: their contacts, as in `Engine.contact_records`.
        """
        found = self._engine.contact_records(self._frame, number, max(obstacles, 1), sleepers)
        if found is not None:
            self._frame, records, self._given = found
            self.records = Records(len(records), CONTACT_RECORD, records)
            self._shown = [self.records]

    def prepare(self, number: Array) -> None:
        """Run the code of `take` once before the first frame, so that the first query is not delayed."""
        Records(0, CONTACT_RECORD, self._engine.contact_records(0, number, 1, None)[1])

    def renumber(self, now: Array) -> None:
        """Renumber particles in the returned arrays of this frame: now at `now` (n,), or removed (-1)."""
        for shown in self._shown:
            renumber(shown, now)
        last = self.records
        lives = (last["a"] >= 0) & ((last["b"] >= 0) | (last["number"][:, 1] < 0))
        if not lives.all():
            self.records = last[lives]
            self._shown.append(self.records)

    def force_on(self, which: int) -> Floats:
        """(2,) N, force of all circles on the obstacle of this number, or on `WALLS` of the room, averaged over the frame."""
        x, y, _ = self._sums(which)
        return np.array((0 - x / self.dt, 0 - y / self.dt))

    def _sums(self, which: int) -> tuple[float, float, float]:
        """The sums of `given_by` in the core."""
        sums: tuple[float, float, float] = unit("engine", np.float64).given_by(self._given, which)
        return sums

    def pushed(self) -> float:
        """N, sum of the normal forces on walls of the room, averaged over the frame."""
        return self._sums(WALLS)[2] / self.dt

    def virial(self) -> float:
        """J, sum over contacts between circles of force times distance, averaged over the frame."""
        return self._sums(PAIRS)[2] / self.dt

    def pushes(self) -> Pushes | None:
        """Normal forces on circles, with walls and obstacles as one each; None before the first frame."""
        if np.isinf(self.dt):
            return None
        found = self._shown[0]
        (nx, ny), push, rub = found["normal"].T, found["impulse"], found["rub"]
        against = np.column_stack((push * nx + rub * ny, push * ny - rub * nx))
        between = found["number"][:, 1] >= 0
        pairs, force, angle = [found["number"][between]], [push[between]], [np.arctan2(ny, nx)[between]]
        for mine in (found["wall"] >= 0, found["obstacle"] >= 0):
            which, where = np.unique(found["number"][mine, 0], return_inverse=True)
            x, y = (np.bincount(where, column, len(which)) for column in against[mine].T)
            pairs.append(np.column_stack((which, which)))
            force.append(np.hypot(x, y))
            angle.append(np.arctan2(y, x))
        return Pushes(np.concatenate(pairs), np.concatenate(force) / self.dt, np.concatenate(angle))
