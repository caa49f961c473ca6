"""Who touched whom in the last frame, where, and how hard: `ContactRecords` asks the engine for it when it is asked itself.

What each contact has given is noted substep by substep; where it is, and its normal, are those of the end of the frame.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.common.arrays import Array, Floats
from pyverlet.common.shown import Records
from pyverlet.core import unit
from pyverlet.laws.events import renumber

WALLS, PAIRS = -1, -2
"""In the place of the number of an obstacle."""

CONTACT_RECORD = np.dtype(
    [
        ("a", np.int64), ("b", np.int64), ("wall", np.int64), ("obstacle", np.int64), ("point", np.float64, (2,)),
        ("normal", np.float64, (2,)), ("impulse", np.float64), ("rub", np.float64), ("number", np.int64, (2,)),
    ]
)  # fmt: skip
"""A contact: circle a and circle b, or b = -1 and the number of a wall or of an obstacle (the others are -1); where they touch,
m; the unit normal out of a; what pushes them apart along it and the friction on a along (-n_y, n_x), over the frame, N s; the
numbers (`world.number`) of both circles, -1 in the place of b."""


class Pushes(NamedTuple):
    """What pushes circles, on the average of a frame."""

    pairs: Array
    """(m, 2) numbers of the circles; twice the same where a circle leans on walls, or on obstacles."""
    force: Floats
    """(m,) N, what pushes them apart."""
    angle: Floats
    """(m,) rad, of the normal out of the first."""


class ContactRecords:
    """The contacts of the last frame. Indices are those of its end.

    Attributes:
        records: TOUCH, sorted by a, then b; without removed particles. Renumbered when particles are removed later.
        dt: of that frame, s.
    """

    def __init__(self, engine: Any) -> None:
        """engine: of the core, which notes them from the frame that comes on."""
        self._engine = engine
        self._frame = 0  # that was asked for last
        self._shown: list[Array] = [Records(0, CONTACT_RECORD)]  # what `records` was of it
        self.records = self._shown[0]
        self._given = np.empty(0, np.int64), np.empty((0, 7)), np.empty(0, np.int64)  # of the core: keys, rows and order
        self.dt = np.inf

    def take(self, number: Array, obstacles: int, sleepers: tuple[Array, Floats] | None = None) -> None:
        """Take what the engine has noted, if that is not known yet; as long as particles and links to them are those of then.

        number: of each particle; obstacles: how many there are; sleepers: what these give, as `Engine.contact_records` takes it.
        """
        found = self._engine.contact_records(self._frame, number, max(obstacles, 1), sleepers)
        if found is not None:
            self._frame, records, self._given = found
            self.records = Records(len(records), CONTACT_RECORD, records)
            self._shown = [self.records]

    def prepare(self, number: Array) -> None:
        """Run once what `take` runs, as the first frame begins: who asks first does not wait until the code is there."""
        Records(0, CONTACT_RECORD, self._engine.contact_records(0, number, 1, None)[1])

    def renumber(self, now: Array) -> None:
        """Particles are now at `now` (n,), or removed (-1): arrays of this frame that were returned say so."""
        for shown in self._shown:
            renumber(shown, now)
        last = self.records
        lives = (last["a"] >= 0) & ((last["b"] >= 0) | (last["number"][:, 1] < 0))
        if not lives.all():
            self.records = last[lives]
            self._shown.append(self.records)

    def force_on(self, which: int) -> Floats:
        """(2,) N, by all circles on the obstacle of this number, or on `WALLS` of the room, averaged over the frame."""
        x, y, _ = self._sums(which)
        return np.array((0 - x / self.dt, 0 - y / self.dt))

    def _sums(self, which: int) -> tuple[float, float, float]:
        """See `given_by` in the core."""
        sums: tuple[float, float, float] = unit("engine", np.float64).given_by(self._given, which)
        return sums

    def pushed(self) -> float:
        """N, the sum of what walls of the room were pushed with along their normals, averaged over the frame."""
        return self._sums(WALLS)[2] / self.dt

    def virial(self) -> float:
        """J, sum over contacts between circles of force times distance, averaged over the frame."""
        return self._sums(PAIRS)[2] / self.dt

    def pushes(self) -> Pushes | None:
        """What circles were pushed with, walls and obstacles each as one; None if there was no frame."""
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
