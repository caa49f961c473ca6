"""Contact state that persists between frames (warm-start impulses and step data), by the user's particle indices."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.world.sleepers import Remembered

STEP = ("kick", "h", "hertz", "finer", "steps", "parting", "typical", "strongest")
"""The scalar fields of `Memory`; fields missing in older files are 0."""


class Memory(NamedTuple):
    """The persistent contact state: impulses of contacts with particles and surfaces, and data of the last step.

    pairs (k, 2) and values (k, 4): see `Engine.take_impulses`. surfaces (k, 2): particles and which surface, as the core numbers
    them; pushes (k, 3): their impulses along the normals, or -1 where a one-way line lets one pass, and the tangents, m/s, and
    against rolling, m^2/s. given: (n, 3) velocity and spin that contacts gave in the last substep, over `kick` seconds. h:
    length of the last substep, s. hertz: spring frequency; finer: for how long, s, a higher one would have been possible.
    steps: substeps of the last frame, 0 if that is not known. parting: J, see `laws.limiter`. typical,
    strongest: of `ForceSum`, at the end of the last frame. asleep: what contacts of sleepers remember. listed, checked: (n, 2)
    of the list of pairs, and skin: its numbers, as of `Engine.save_list`. Empty without one.
    """

    pairs: Array
    values: Array
    surfaces: Array
    pushes: Array
    given: Array
    kick: float
    h: float
    hertz: float
    finer: float
    steps: float
    parting: float
    typical: float
    strongest: float
    asleep: Remembered
    listed: Array
    checked: Array
    skin: tuple[float, ...] = ()

    @classmethod
    def empty(cls, dtype: np.dtype[Any]) -> Memory:
        """No contact remembers anything."""
        rows, none, no_pairs = np.empty((0, 2), dtype), np.empty((0, 3), dtype), np.empty((0, 2), np.int32)
        contacts = no_pairs, np.empty((0, 4), dtype), no_pairs, np.empty((0, 3)), none
        return cls(
            *contacts, kick=0.0, h=0.0, hertz=0.0, finer=0.0, steps=0.0, parting=0.0, typical=0.0, strongest=0.0,
            asleep=Remembered.nothing(dtype), listed=rows, checked=rows,
        )  # fmt: skip

    def renumbered(self, now: Array) -> Memory:
        """The same after renumbering: particles are now at `now` (n,), or removed (-1)."""
        count, alive = int(now.max(initial=-1)) + 1, now[: len(self.given)] >= 0
        given = np.zeros((count, 3), self.given.dtype)
        given[now[: len(self.given)][alive]] = self.given[alive]
        pairs, surfaces = now[self.pairs].astype(np.int32), self.surfaces.copy()
        listed, checked = (np.full((count if len(rows) else 0, 2), np.nan, rows.dtype) for rows in (self.listed, self.checked))
        for rows, before in (listed, self.listed), (checked, self.checked):  # new particles are not in the list
            stay = now[: len(before)] >= 0
            rows[now[: len(before)][stay]] = before[stay]
        surfaces[:, 0] = now[surfaces[:, 0]]
        kept, held = (pairs >= 0).all(axis=1), surfaces[:, 0] >= 0
        return self._replace(
            pairs=pairs[kept], values=self.values[kept], surfaces=surfaces[held], pushes=self.pushes[held], given=given,
            asleep=self.asleep.renumbered(now), listed=listed, checked=checked,
        )  # fmt: skip


def columns_of(given: Array) -> tuple[Array, Array]:
    """Copies of the velocity (n, 2) and spin (n,) in `Memory.given`."""
    return given[:, :2].copy(), given[:, 2].copy()
