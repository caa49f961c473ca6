"""Substeps of arbitrary integrators, in the form that the contact law needs, and rooms of user-defined classes.

The law works on the mean velocity u of a substep. A step of an integrator from (x, v) to (x*, v*) has u* = (x* - x) / h and
the mean acceleration a = (v* - v) / h. Contacts that give c h in a substep, as in the last one, change u by c h / 2, as
forces do in x* = x + v h + a h^2 / 2; any difference from c h goes into u whole. Then x' = x + u h and
v' = u + (v* - u*) + c' h / 2: the integrator's own step where nothing touches.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.constants import REST_ACCELERATIONS
from pyverlet.laws.integrators import Forces, Integrator, PositionVerlet, SemiImplicitEuler
from pyverlet.state.sorted_state import SortedState


def kicks(integrator: Integrator) -> bool:
    """Whether a substep is a kick and a drift, which the core does itself."""
    return type(integrator).step in (PositionVerlet.step, SemiImplicitEuler.step)


def keep_way(state: SortedState, before: float, h: float) -> None:
    """Keep x - x_prev when the step length changes, and add a h^2: the error of plain Verlet, shown on purpose."""
    known = ~np.isnan(state.acceleration[:, 0])
    a, half, more = state.acceleration[known], state.real(0.5 * before), state.real(before / h - 1.0)
    state.velocity[known] += more * (state.velocity[known] - half * a) + state.real(0.5 * (h - before)) * a


class FreeSteps:
    """Applies an integrator to the motion between contacts, substep by substep."""

    def __init__(self) -> None:
        self._left = self._particle = np.empty(0)

    def take(self, integrator: Integrator, state: SortedState, forces: Forces, t: float, h: float) -> None:
        """Replace velocities and accelerations by their means over the substep from t on; positions stay."""
        position, before, acceleration = state.position.copy(), state.velocity.copy(), state.acceleration
        integrator.full_step(state, forces, t, h)
        if state.acceleration is not acceleration:  # the core holds that array
            state._scratch[0], state.acceleration = state.acceleration, acceleration
        self._left, self._particle = np.empty_like(before), state.particle
        state.motion.mean_of_step(state.position, state.velocity, state.acceleration, position, before, h, self._left)

    def end(self, state: SortedState, given: NDArray[Any], given_spin: NDArray[Any], share: float) -> None:
        """Set velocities at the end of the substep, in which contacts gave `share` times these, as if evenly over time."""
        if self._particle is not state.particle:  # a new pair list has re-sorted the rows
            by_particle = np.empty_like(self._left)
            by_particle[self._particle] = self._left
            self._left = by_particle[state.particle]
        state.velocity += self._left + state.real(0.5 * share) * given
        state.spin += state.real(0.5 * share) * given_spin


class OwnWalls:
    """Walls of a user-defined room class, which the core does not know.

    Attributes:
        gave, gave_spin: (n, 2) m/s and (n,) rad/s that it gave in the last substep to particles at rest at its walls, 0 for
            others, and for all if it cannot say where its walls are (`facing`). Velocities are those of the middle of a substep
            until the frame ends: half of it is then still to be added.
    """

    def __init__(self, boundary: Any) -> None:
        self._boundary = boundary
        self.gave: NDArray[Any]
        self.gave_spin: NDArray[Any]

    def confine(self, state: SortedState, ledger: Any, h: float, lag: float, strongest: float) -> None:
        """Confine particles after a substep of h seconds; velocities are `lag` s old; ledger: that of the frame, or None."""
        velocity, spin, about = state.velocity.copy(), state.spin.copy(), (h, lag, REST_ACCELERATIONS * strongest * h)
        if ledger:
            ledger.confined(self._boundary.confine, *about)
        else:
            self._boundary.confine(state, *about)
        self.gave, self.gave_spin = state.velocity - velocity, state.spin - spin
        others = np.hypot(*self.gave.T) > about[2]
        others |= self._boundary.facing(state.position[:1]) is None
        self.gave[others] = self.gave_spin[others] = 0

    def go_on(self, state: SortedState, ledger: Any, part: float) -> None:
        """At the end of the frame: add `part` of what the walls gave in the last substep."""

        def give(state: SortedState, part: float, lag: float) -> None:
            state.velocity += state.real(part) * self.gave
            state.spin += state.real(part) * self.gave_spin

        if ledger:
            ledger.confined(give, part, 0.0)
        else:
            give(state, part, 0.0)
