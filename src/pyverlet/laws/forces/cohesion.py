"""Particles that stick together once they have touched."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.arrays import Array
from pyverlet.ground.checked import Checked
from pyverlet.ground.errors import InputError
from pyverlet.ground.shown import Shown
from pyverlet.laws.forces._base import Substep
from pyverlet.state.slots import Slots
from pyverlet.state.state import State

_TOUCH = 1e-3
"""Gap in sums of radii up to which circles touch: contacts at rest hold them at about none."""


class Cohesion(Shown):
    """Capture and break: circles that touch are bonded, and pull on each other until their rims are `break_distance` apart.

    With the gap g between the rims, F = -strength (1 - g / break_distance), and -strength where they overlap; U = -strength
    (break_distance - g)^2 / (2 break_distance), 0 where the bond breaks. As with a liquid bridge between wet grains there is no
    pull before they have touched. To part two circles at rest takes strength break_distance / 2; that much is lost, too, when
    they touch: it is in the ledger's `forces`. One object is of one world, for it holds the bonds.

    Args:
        strength: N, the pull of two circles in contact.
        break_distance: m.

    Attributes:
        bonds: (k, 2) int64 indices of the particles that hold on to each other, the lower first, in ascending order.
    """

    _shows = ("strength", "break_distance")

    _world: str | None = None  # the key of the one that the bonds are of
    velocity_dependent = False
    account = "forces"

    strength = Checked(checks.number, least=0.0)
    break_distance = Checked(checks.number, above=0.0)

    def __init__(self, *, strength: float, break_distance: float) -> None:
        self.strength, self.break_distance = strength, break_distance
        self.bonds = np.zeros((0, 2), np.int64)

    def among(self, state: Slots) -> Array:
        """Slots of those whose forces on each other add up to nothing."""
        return np.asarray(np.unique(state.slots_of(self.bonds)))

    def _look_at(self, state: State | Slots) -> None:
        """Be of this world from now on.

        Raises:
            InputError: it is of another one.
        """
        if self._world not in (None, state.key):
            raise InputError(f"{self!r} holds the bonds of another world; allowed is an object of its own for each world")
        self._world = state.key

    def apply(self, state: Slots, t: float) -> None:
        self._look_at(state)
        i, j = np.ascontiguousarray(state.slots_of(self.bonds).T)
        if len(i):
            gap, way = self._gaps(state, i, j)
            pull = -self.strength * (1.0 - gap.clip(0.0, self.break_distance) / self.break_distance)
            state.motion.add_along(state.force, i, j, way, pull, pull)

    def potential(self, state: State) -> float:
        self._look_at(state)
        gap = self._gaps(state, *self.bonds.T)[0]
        return float(self._energy(gap[np.isfinite(state.mass[self.bonds]).any(axis=1)]).sum())

    def end_substep(self, state: Slots, at: Substep) -> float:
        """Bond those that touch, let go those too far apart; returns what that changes the energy by, J."""
        found = state.near(2.0 * float(state.radius.max(initial=1e-300)) * (1.0 + _TOUCH))
        touch = found.distance <= (state.radius[found.i].astype(float) + state.radius[found.j]) * (1.0 + _TOUCH)
        count, pairs = len(state), np.sort(state.particle[np.column_stack((found.i, found.j))[touch]], axis=1).astype(np.int64)
        keys, held = pairs @ np.array([count, 1]), self.bonds @ np.array([count, 1])
        new, kept = np.sort(np.setdiff1d(keys, held)), held
        made = np.column_stack(np.divmod(new, count))
        if len(held):
            far = self._gaps(state, *state.slots_of(self.bonds).T)[0] >= self.break_distance
            kept = held[~far]
        if not len(made) and len(kept) == len(held):
            return 0.0
        self.bonds = np.column_stack(np.divmod(np.sort(np.concatenate((kept, new))), count))
        free = (state.inverse_mass[state.slots_of(made)] > 0).any(axis=1)
        return float(self._energy(self._gaps(state, *state.slots_of(made).T)[0][free]).sum())

    def virial(self, state: State) -> float:
        """Sum over bonds of force times distance, J."""
        self._look_at(state)
        gap = self._gaps(state, *self.bonds.T)[0].clip(0.0, self.break_distance)
        distance = np.hypot(*state.seam.nearest(np.diff(state.position[self.bonds].astype(float), axis=1)[:, 0]).T)
        return float(-self.strength * ((1.0 - gap / self.break_distance) * distance).sum())

    def _energy(self, gap: Array) -> Array:
        inside = np.minimum(gap, 0.0)
        left = self.break_distance - gap.clip(0.0, self.break_distance)
        return np.asarray(self.strength * (inside - 0.5 * left**2 / self.break_distance))

    @staticmethod
    def _gaps(state: Any, i: Array, j: Array) -> tuple[Array, Array]:
        """Between the rims, m, and unit vectors from i to j."""
        way = state.seam.nearest(state.position[j].astype(float) - state.position[i])
        distance = np.hypot(*way.T)
        gap = distance - state.radius[i] - state.radius[j]
        return gap, np.divide(way, distance[:, None], out=np.zeros_like(way), where=distance[:, None] > 0)

    # ---- what is kept ----------------------------------------------------------------------------------------------------

    def renumber(self, now: Array) -> None:
        """Particles were removed: their bonds are no more."""
        bonds = now[self.bonds]
        self.bonds = np.ascontiguousarray(bonds[(bonds >= 0).all(axis=1)], np.int64)

    def save(self) -> Array:
        """The bonds; a copy."""
        return self.bonds.copy()

    def restore(self, saved: Array) -> None:
        """Back to what `save` returned."""
        self.bonds = saved.copy()
