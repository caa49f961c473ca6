"""Laws between pairs of particles, each a class with its formula."""

from __future__ import annotations

from typing import Any

import numpy as np

from pyverlet.ground import checks
from pyverlet.ground.arrays import Array
from pyverlet.ground.checked import Checked
from pyverlet.laws.forces.pair import PairLaw


class LennardJones(PairLaw):
    """Attraction of neutral atoms, and repulsion where they would overlap (Lennard-Jones 1924).

    U = 4 epsilon ((sigma / r)^12 - (sigma / r)^6) - U_c up to the cutoff, and 0 beyond; U_c is the first part at the cutoff, so
    that the energy does not jump there. The force is -dU/dr; it is 0 at r = 2^(1/6) sigma, and small but not 0 at the cutoff.

    A substep of 0.005 sigma sqrt(m / epsilon) s keeps the energy to 1e-3 epsilon. Without collisions particles are points.

    Args:
        epsilon: depth of the well, J.
        sigma: distance at which the unshifted energy is 0, m.
        cutoff: m; 2.5 sigma if None. 2^(1/6) sigma leaves the repulsion alone (Weeks, Chandler, Andersen 1971).
    """

    _shows = ("epsilon", "sigma", "cutoff")
    looks_at_particles = False

    epsilon = Checked(checks.number, least=0.0)
    sigma = Checked(checks.number, above=0.0)
    cutoff = Checked(checks.number, above=0.0)

    def __init__(self, *, epsilon: float, sigma: float, cutoff: float | None = None) -> None:
        self.epsilon, self.sigma = epsilon, sigma
        self.cutoff = 2.5 * self.sigma if cutoff is None else cutoff

    @property
    def range(self) -> float:  # type: ignore[override]
        """The cutoff, m."""
        return self.cutoff

    def _sixth(self, distance: Any) -> Any:
        square = (self.sigma / distance) ** 2
        return square * square * square  # a tenth of the time of a sixth power

    def force(self, distance: Array, i: Array, j: Array) -> Array:
        sixth = self._sixth(distance)
        return np.asarray(24.0 * self.epsilon * sixth * (2.0 * sixth - 1.0) / distance)

    def energy(self, distance: Array, i: Array, j: Array) -> Array:
        sixth, last = self._sixth(distance), self._sixth(self.cutoff)
        return np.asarray(4.0 * self.epsilon * (sixth * (sixth - 1.0) - last * (last - 1.0)))


class Yukawa(PairLaw):
    """Charges in a medium that screens them: colloids, dusty plasmas.

    U = strength exp(-r / screening_length) / r - U_c up to the cutoff, with U_c the first part there. F = strength exp(-r /
    screening_length) (1 / r + 1 / screening_length) / r. The exponential is NumPy's, its last bit differs between processors.

    Args:
        strength: J m; negative attracts.
        screening_length: m (Debye).
        cutoff: m; 8 screening lengths if None, where the force is below 1e-4 of that at one.
    """

    _shows = ("strength", "screening_length", "cutoff")
    looks_at_particles = False

    strength = Checked(checks.number)
    screening_length = Checked(checks.number, above=0.0)
    cutoff = Checked(checks.number, above=0.0)

    def __init__(self, *, strength: float, screening_length: float, cutoff: float | None = None) -> None:
        self.strength, self.screening_length = strength, screening_length
        self.cutoff = 8.0 * self.screening_length if cutoff is None else cutoff

    @property
    def range(self) -> float:  # type: ignore[override]
        """The cutoff, m."""
        return self.cutoff

    def _unshifted(self, distance: Any) -> Any:
        return self.strength * np.exp(-distance / self.screening_length) / distance

    def force(self, distance: Array, i: Array, j: Array) -> Array:
        return np.asarray(self._unshifted(distance) * (1.0 / distance + 1.0 / self.screening_length))

    def energy(self, distance: Array, i: Array, j: Array) -> Array:
        return np.asarray(self._unshifted(distance) - self._unshifted(self.cutoff))


class SoftRepulsion(PairLaw):
    """Particles that push each other apart, and may pass through each other: blobs, crowds, dissipative particle dynamics.

    F = strength (1 - r / range), U = strength range (1 - r / range)^2 / 2 (Groot and Warren 1997). Particles at the very same
    place part along x.

    Args:
        strength: N at no distance.
        range: m, where the force has fallen to 0.
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
