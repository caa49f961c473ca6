"""Contact state of sleeping particles: stored while they sleep and restored when they wake."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import InputError
from pyverlet.common.fields import Field

Array = NDArray[Any]

ASLEEP = {
    "pairs": Field(np.int32, "asleep", 2, least=0, below="particles"),
    "values": Field(None, "asleep", 4),
    "surfaces": Field(np.int32, "asleep_surfaces", 2, least=0),
    "pushes": Field(np.float64, "asleep_surfaces", 3),
    "particle": Field(np.int32, "asleep_particles", least=0, below="particles"),
    "given": Field(None, "asleep_particles", 3),
    "hertz": Field(np.float64, "asleep_particles", above=0),
}
"""Names of the arrays of `Remembered` in files."""


class Remembered(NamedTuple):
    """Contact state by the user's particle indices.

    pairs (k, 2) and values (k, 4): see `Engine.take_impulses`. surfaces (m, 2): particle and surface, as the core numbers it;
    pushes (m, 3): impulses along the normal, the tangent and against rolling. particle (n,), given (n, 3): particles, and the
    velocity and spin that contacts gave them in the last substep. All are m/s and rad/s; of sleepers they are rates, m/s^2 and
    rad/s^2, because the next substep may have another length. hertz: (n,) frequency of the contact springs.
    """

    pairs: Array
    values: Array
    surfaces: Array
    pushes: Array
    particle: Array
    given: Array
    hertz: Array

    @classmethod
    def nothing(cls, dtype: np.dtype[Any]) -> Remembered:
        """An empty contact state."""
        whose, rows = np.empty((0, 2), np.int32), np.empty((0, 3), dtype)
        return cls(whose, np.empty((0, 4), dtype), whose, np.empty((0, 3)), whose[:, 0], rows, np.empty(0))

    @classmethod
    def taken_up(cls, arrays: dict[str, Array], count: int, dtype: np.dtype[Any]) -> Remembered:
        """The contact state of sleepers among `count` particles, from the arrays of a file.

        Raises:
            InputError: a particle index is too large.
        """
        known = {name: arrays[f"asleep.{name}"].copy() for name in ASLEEP if f"asleep.{name}" in arrays}
        found = cls.nothing(dtype)._replace(**known)
        if (most := found.surfaces[:, 0].max(initial=-1)) >= count:
            raise InputError(f"asleep.surfaces has particle {most}; allowed are those of the world, {count}")
        return found

    def times(self, factor: float) -> Remembered:
        """The same with impulses multiplied by `factor`."""
        values, given = (self.values.dtype.type(factor) * rows for rows in (self.values, self.given))
        return self._replace(values=values, pushes=factor * self.pushes, given=given)

    def joined(self, other: Remembered) -> Remembered:
        """The union of both."""
        return Remembered(*map(np.concatenate, zip(self, other, strict=True)))

    def split(self, at_rest: Array, asleep: Array) -> tuple[Remembered, Remembered]:
        """Contacts of sleepers alone, and the rest. By the user's index: which particles cannot move, which of these sleep."""
        a, b = self.pairs.T
        pairs = at_rest[a] & at_rest[b] & (asleep[a] | asleep[b])
        surfaces, particles = asleep[self.surfaces[:, 0]], asleep[self.particle]
        return self._of(pairs, surfaces, particles), self._of(~pairs, ~surfaces, ~particles)

    def renumbered(self, now: Array) -> Remembered:
        """The same after renumbering: particles are now at `now` (n,), or removed (-1)."""
        pairs, surfaces, particle = now[self.pairs].astype(np.int32), self.surfaces.copy(), now[self.particle].astype(np.int32)
        surfaces[:, 0] = now[surfaces[:, 0]]
        moved = self._replace(pairs=pairs, surfaces=surfaces, particle=particle)
        return moved._of((pairs[:, 0] >= 0) & (pairs[:, 1] >= 0), surfaces[:, 0] >= 0, particle >= 0)

    def at_surfaces(self, now: Array) -> Remembered:
        """The same with new surface numbers: `now` has the new number of each surface, or -1."""
        surfaces = self.surfaces.copy()
        surfaces[:, 1] = now[surfaces[:, 1]]
        held = surfaces[:, 1] >= 0
        return self._replace(surfaces=surfaces[held], pushes=self.pushes[held])

    def _of(self, pairs: Array, surfaces: Array, particles: Array) -> Remembered:
        return Remembered(
            self.pairs[pairs], self.values[pairs], self.surfaces[surfaces], self.pushes[surfaces], self.particle[particles],
            self.given[particles], self.hertz[particles],
        )  # fmt: skip
