"""What the core does not do itself: substeps of any integrator, in the form in which the contact law takes them, and own walls.

The law works on the mean velocity u of a substep. A step of an integrator from (x, v) to (x*, v*) has u* = (x* - x) / h and
the mean acceleration a = (v* - v) / h. Contacts that give c h in a substep, as they did in the last, change u by c h / 2, as
forces do in x* = x + v h + a h^2 / 2; what they give more or less goes into u whole. Then x' = x + u h and
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
    """x - x_prev is kept, whatever the new step, and a h^2 comes to it: the flaw of plain Verlet, shown on purpose."""
    known = ~np.isnan(state.acceleration[:, 0])
    a, half, more = state.acceleration[known], state.real(0.5 * before), state.real(before / h - 1.0)
    state.velocity[known] += more * (state.velocity[known] - half * a) + state.real(0.5 * (h - before)) * a


class FreeSteps:
    """What an integrator does where nothing touches, substep by substep."""

    def __init__(self) -> None:
        self._left = self._particle = np.empty(0)

    def take(self, integrator: Integrator, state: SortedState, forces: Forces, t: float, h: float) -> None:
        """Leave positions, and have the mean velocity and acceleration of the substep from t on."""
        position, before, acceleration = state.position.copy(), state.velocity.copy(), state.acceleration
        integrator.full_step(state, forces, t, h)
        if state.acceleration is not acceleration:  # the core holds that array
            state._scratch[0], state.acceleration = state.acceleration, acceleration
        self._left, self._particle = np.empty_like(before), state.particle
        state.motion.mean_of_step(state.position, state.velocity, state.acceleration, position, before, h, self._left)

    def end(self, state: SortedState, given: NDArray[Any], given_spin: NDArray[Any], share: float) -> None:
        """Velocities at the end of the substep, in which contacts gave `share` times these, as if evenly."""
        if self._particle is not state.particle:  # the list of pairs has been made anew since, and particles sorted
            by_particle = np.empty_like(self._left)
            by_particle[self._particle] = self._left
            self._left = by_particle[state.particle]
        state.velocity += self._left + state.real(0.5 * share) * given
        state.spin += state.real(0.5 * share) * given_spin


class OwnWalls:
    """What a room that the core does not know, one of a user's own class, does in a frame.

    Attributes:
        gave, gave_spin: (n, 2) m/s and (n,) rad/s that it gave in the last substep to those that rest at its walls, for others
            0, and for all if it cannot say where its walls are (`facing`). Velocities are those of the middle of a substep until
            the frame ends: half of it is then still to come.
    """

    def __init__(self, boundary: Any) -> None:
        self._boundary = boundary
        self.gave: NDArray[Any]
        self.gave_spin: NDArray[Any]

    def confine(self, state: SortedState, ledger: Any, h: float, lag: float, strongest: float) -> None:
        """After a substep of h seconds; velocities are those of `lag` s ago; ledger: that of the frame, or None."""
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
        """The frame ends: of what was given in the last substep, `part` is still to come."""

        def give(state: SortedState, part: float, lag: float) -> None:
            state.velocity += state.real(part) * self.gave
            state.spin += state.real(part) * self.gave_spin

        if ledger:
            ledger.confined(give, part, 0.0)
        else:
            give(state, part, 0.0)
