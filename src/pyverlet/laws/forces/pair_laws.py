"""Laws between pairs of particles, each a class with its formula: within a range, between bonded particles, and gravitation."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import numpy as np

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.checked import Checked
from pyverlet.common.errors import InputError
from pyverlet.common.shown import Shown
from pyverlet.core import unit
from pyverlet.laws.forces._base import Substep, swing_time
from pyverlet.laws.forces.pair import PairLaw
from pyverlet.state.group import Group, checked_group, members
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State

_TOUCH = 1e-3
"""Gap, over the sum of radii, up to which circles count as touching; resting contacts have a gap of about 0."""

FEW = 256
"""Number of particles up to which summing all pairs is faster than the tree."""


SWING = 0.015
"""Longest substep for Lennard-Jones, over sigma sqrt(m / epsilon). With twice as much molecules of a vapour fly apart."""

SOFT_SWING = 0.3
"""Longest substep for a soft repulsion, over sqrt(m range / strength); in a crowd several add up."""


class LennardJones(PairLaw):
    """Attraction of neutral atoms, and repulsion where they would overlap (Lennard-Jones 1924).

    U = 4 epsilon ((sigma / r)^12 - (sigma / r)^6) - U_c up to the cutoff, and 0 beyond; U_c is the first part at the cutoff, so
    that the energy does not jump there. The force is -dU/dr; it is 0 at r = 2^(1/6) sigma, and small but not 0 at the cutoff.

    A substep of 0.005 sigma sqrt(m / epsilon) s conserves the energy to 1e-3 epsilon; frames whose substeps exceed SWING of that
    unit are divided. Without collisions particles are points.

    Args:
        epsilon: depth of the well, J.
        sigma: distance at which the unshifted energy is 0, m.
        cutoff: m; None: 2.5 sigma. 2^(1/6) sigma leaves only the repulsion (Weeks, Chandler, Andersen 1971).
    """

    _shows = ("epsilon", "sigma", "cutoff")
    looks_at_particles = False

    epsilon = Checked(checks.number, least=0.0)
    sigma = Checked(checks.number, above=0.0)
    cutoff = Checked(checks.number, above=0.0)
    range = property(attrgetter("cutoff"), doc="The cutoff, m.")

    def __init__(self, *, epsilon: float, sigma: float, cutoff: float | None = None) -> None:
        self.epsilon, self.sigma = epsilon, sigma
        self.cutoff = 2.5 * self.sigma if cutoff is None else cutoff

    def _sixth(self, distance: Any) -> Any:
        square = (self.sigma / distance) ** 2
        return square * square * square  # ten times as fast as a sixth power

    def force(self, distance: Array, i: Array, j: Array) -> Array:
        sixth = self._sixth(distance)
        return np.asarray(24.0 * self.epsilon * sixth * (2.0 * sixth - 1.0) / distance)

    def energy(self, distance: Array, i: Array, j: Array) -> Array:
        sixth, last = self._sixth(distance), self._sixth(self.cutoff)
        return np.asarray(4.0 * self.epsilon * (sixth * (sixth - 1.0) - last * (last - 1.0)))

    def longest_substep(self, state: SortedState) -> float:
        """The longest allowed substep, s; longer frames are divided."""
        return SWING * self.sigma * swing_time(self.epsilon * float(state.inverse_mass.max(initial=0.0)))


class Yukawa(PairLaw):
    """Screened charges: colloids, dusty plasmas.

    U = strength exp(-r / screening_length) / r - U_c up to the cutoff, with U_c the first part there. F = strength exp(-r /
    screening_length) (1 / r + 1 / screening_length) / r. NumPy's exponential may differ in its last bit between processors.

    Args:
        strength: J m; negative attracts.
        screening_length: m (Debye).
        cutoff: m; None: 8 screening lengths, where the force is below 1e-4 of that at one.
    """

    _shows = ("strength", "screening_length", "cutoff")
    looks_at_particles = False

    strength = Checked(checks.number)
    screening_length = Checked(checks.number, above=0.0)
    cutoff = Checked(checks.number, above=0.0)
    range = property(attrgetter("cutoff"), doc="The cutoff, m.")

    def __init__(self, *, strength: float, screening_length: float, cutoff: float | None = None) -> None:
        self.strength, self.screening_length = strength, screening_length
        self.cutoff = 8.0 * self.screening_length if cutoff is None else cutoff

    def _unshifted(self, distance: Any) -> Any:
        return self.strength * np.exp(-distance / self.screening_length) / distance

    def force(self, distance: Array, i: Array, j: Array) -> Array:
        return np.asarray(self._unshifted(distance) * (1.0 / distance + 1.0 / self.screening_length))

    def energy(self, distance: Array, i: Array, j: Array) -> Array:
        return np.asarray(self._unshifted(distance) - self._unshifted(self.cutoff))


class SoftRepulsion(PairLaw):
    """Repulsion of particles that may pass through each other: blobs, crowds, dissipative particle dynamics.

    F = strength (1 - r / range), U = strength range (1 - r / range)^2 / 2 (Groot and Warren 1997). Coincident particles separate
    along x.

    Args:
        strength: force at distance 0, N.
        range: m, where the force becomes 0.
    """

    _shows = ("strength", "range")
    looks_at_particles = False
    parts_all = True

    strength = Checked(checks.number)
    range = Checked(checks.number, above=0.0)

    def __init__(self, *, strength: float, range: float) -> None:  # noqa: A002
        self.strength, self.range = strength, range

    def force(self, distance: Array, i: Array, j: Array) -> Array:
        return np.asarray(self.strength * (1.0 - distance / self.range))

    def energy(self, distance: Array, i: Array, j: Array) -> Array:
        return np.asarray(0.5 * self.strength * self.range * (1.0 - distance / self.range) ** 2)

    def longest_substep(self, state: SortedState) -> float:
        """The longest allowed substep, s; longer frames are divided."""
        return SOFT_SWING * swing_time(abs(self.strength) / self.range * float(state.inverse_mass.max(initial=0.0)))


class Cohesion(Shown):
    """Bonds that form and break: circles that touch attract each other until their rims are `break_distance` apart.

    With the gap g between the rims, F = -strength (1 - g / break_distance), and -strength where they overlap; U = -strength
    (break_distance - g)^2 / (2 break_distance), 0 where the bond breaks. As with a liquid bridge between wet grains there is no
    force before the first contact. Separating two circles at rest takes strength break_distance / 2; the same energy is lost when
    they touch, and booked in the ledger's `forces`. An object holds the bonds of one world.

    Args:
        strength: N, the attraction of two circles in contact.
        break_distance: m.

    Attributes:
        bonds: (k, 2) int64 indices of the bonded particles, the lower first, in ascending order.
    """

    _shows = ("strength", "break_distance")

    _world: str | None = None  # key of the world that the bonds belong to
    velocity_dependent = False
    account = "forces"

    strength = Checked(checks.number, least=0.0)
    break_distance = Checked(checks.number, above=0.0)

    def __init__(self, *, strength: float, break_distance: float) -> None:
        self.strength, self.break_distance = strength, break_distance
        self.bonds = np.zeros((0, 2), np.int64)

    def among(self, state: SortedState) -> Array:
        """Rows of particles whose mutual forces sum to zero."""
        return np.asarray(np.unique(state.sorted_index(self.bonds)))

    def _look_at(self, state: State | SortedState) -> None:
        """Use the bonds for this world from now on.

        Raises:
            InputError: they belong to another world.
        """
        if self._world not in (None, state.key):
            raise InputError(f"{self!r} holds the bonds of another world; allowed is an object of its own for each world")
        self._world = state.key

    def apply(self, state: SortedState, t: float) -> None:
        self._look_at(state)
        i, j = np.ascontiguousarray(state.sorted_index(self.bonds).T)
        if len(i):
            gap, way = self._gaps(state, i, j)
            pull = -self.strength * (1.0 - gap.clip(0.0, self.break_distance) / self.break_distance)
            state.motion.add_along(state.force, i, j, way, pull, pull)

    def potential(self, state: State) -> float:
        self._look_at(state)
        gap = self._gaps(state, *self.bonds.T)[0]
        return float(self._energy(gap[np.isfinite(state.mass[self.bonds]).any(axis=1)]).sum())

    def end_substep(self, state: SortedState, at: Substep) -> float:
        """Add bonds of touching circles and remove broken ones; returns the change of energy, J."""
        if not len(state):
            return 0.0
        found = state.near(2.0 * float(state.radius.max()) * (1.0 + _TOUCH))
        touch = found.distance <= (state.radius[found.i].astype(float) + state.radius[found.j]) * (1.0 + _TOUCH)
        count, pairs = len(state), np.sort(state.particle[np.column_stack((found.i, found.j))[touch]], axis=1).astype(np.int64)
        keys, held = pairs @ np.array([count, 1]), self.bonds @ np.array([count, 1])
        new, far = np.setdiff1d(keys, held), self._gaps(state, *state.sorted_index(self.bonds).T)[0] >= self.break_distance
        if not len(new) and not far.any():
            return 0.0
        self.bonds = np.column_stack(np.divmod(np.union1d(held[~far], new), count))
        made = state.sorted_index(np.column_stack(np.divmod(new, count)))
        free = (state.inverse_mass[made] > 0).any(axis=1)
        return float(self._energy(self._gaps(state, *made.T)[0][free]).sum())

    def virial(self, state: State) -> float:
        """Sum over bonds of force times distance, J."""
        self._look_at(state)
        gap = self._gaps(state, *self.bonds.T)[0].clip(0.0, self.break_distance)
        distance = np.hypot(*state.periodic.nearest(np.diff(state.position[self.bonds].astype(float), axis=1)[:, 0]).T)
        return float(-self.strength * ((1.0 - gap / self.break_distance) * distance).sum())

    def _energy(self, gap: Array) -> Array:
        inside = np.minimum(gap, 0.0)
        left = self.break_distance - gap.clip(0.0, self.break_distance)
        return np.asarray(self.strength * (inside - 0.5 * left**2 / self.break_distance))

    @staticmethod
    def _gaps(state: Any, i: Array, j: Array) -> tuple[Array, Array]:
        """Gaps between the rims, m, and unit vectors from i to j."""
        way = state.periodic.nearest(state.position[j].astype(float) - state.position[i])
        distance = np.hypot(*way.T)
        gap = distance - state.radius[i] - state.radius[j]
        return gap, np.divide(way, distance[:, None], out=np.zeros_like(way), where=distance[:, None] > 0)

    # ---- what is kept ----------------------------------------------------------------------------------------------------

    def renumber(self, now: Array) -> None:
        """After particles were removed: remove their bonds."""
        bonds = now[self.bonds]
        self.bonds = np.ascontiguousarray(bonds[(bonds >= 0).all(axis=1)], np.int64)

    def save(self) -> Array:
        """A copy of the bonds."""
        return self.bonds.copy()

    def restore(self, saved: Array) -> None:
        """Set the bonds that `save` returned."""
        self.bonds = saved.copy()


class Gravitation(Shown):
    """Gravitation between particles: F = strength m_i m_j d / (|d|^2 + softening^2)^(3/2) for every pair, and its potential.

    Pinned particles are ignored. More than FEW particles are summed by a tree (Barnes and Hut 1986, with second moments), in
    O(n log n): a part of them whose size is below `theta` times its distance counts as a whole. With theta = 0.5 accelerations in
    a cloud, in a lattice and on a ring are within 1 % of their root mean square. The error of the total force is removed from
    each force in proportion to its size, so that momentum is conserved up to rounding; torques sum to less than 1e-4 of their
    sizes. The potential is that of the tree, within 1e-3, and costs as much as the forces. Fewer particles are summed pair by
    pair, in O(n^2), as are all for theta = 0 and with periodic boundaries.

    Args:
        group: the particles that attract each other; None for all.
        strength: G, N m^2/kg^2; negative repels.
        softening: distance within which the pull stops growing, m.
        theta: 0 to 1; errors grow with its third power.
    """

    _shows = ("group", "strength", "softening", "theta")

    velocity_dependent = False

    group = Checked(checked_group)
    strength = Checked(checks.number)
    softening = Checked(checks.number, least=0.0)
    theta = Checked(checks.fraction)

    def __init__(self, group: Group | None = None, *, strength: float, softening: float = 0.0, theta: float = 0.5) -> None:
        self.group, self.strength, self.softening, self.theta = group, strength, softening, theta
        self._last: tuple[Array, ...] = ()
        self._pull: Any = None
        self._work: list[Array] = []

    def among(self, state: SortedState) -> Array:
        """Rows of particles whose mutual forces sum to zero."""
        return np.asarray(state.sorted_index(np.arange(len(state))[members(self.group)]))

    def _law(self, count: int, state: SortedState | State) -> tuple[float, float, float]:
        return self.strength, self.softening, 0.0 if count <= FEW or state.periodic else self.theta

    def apply(self, state: SortedState, t: float) -> None:
        which = self.among(state)
        law = self._law(len(which), state)
        given = state.position, state.mass, which, np.array((*law, *state.periodic))
        if not (self._last and all(map(np.array_equal, given, self._last))):  # a frame begins where the last one ended
            self._last, self._pull = tuple(map(np.copy, given)), np.zeros_like(state.force)
            state.motion.gravitate(self._pull, *given[:3], *law, state.periodic, *state.thread_team, self._work, False)
        state.force += self._pull

    def potential(self, state: State) -> float:
        where = members(self.group)
        position, mass = state.position[where].astype(np.float64), state.mass[where].astype(np.float64)
        given = np.zeros_like(position), position, mass, np.arange(len(mass), dtype=np.int32)
        return float(unit("motion", np.float64).gravitate(*given, *self._law(len(mass), state), state.periodic, 0, 1))

    def __getstate__(self) -> dict[str, Any]:
        return vars(self) | {"_last": (), "_pull": None, "_work": []}
