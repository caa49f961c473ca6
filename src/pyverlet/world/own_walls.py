"""Walls of a room that the core does not know: those of a user's own class confine particles after each substep."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.constants import REST_ACCELERATIONS
from pyverlet.state.slots import Slots


class OwnWalls:
    """What such a room does in a frame.

    Attributes:
        gave, gave_spin: (n, 2) m/s and (n,) rad/s that it gave in the last substep to those that rest at its walls, for others
            0, and for all if it cannot say where its walls are (`facing`). Velocities are those of the middle of a substep until
            the frame ends: half of it is then still to come.
    """

    def __init__(self, room: Any) -> None:
        self._room = room
        self.gave: NDArray[Any]
        self.gave_spin: NDArray[Any]

    def confine(self, state: Slots, page: Any, h: float, lag: float, strongest: float) -> None:
        """After a substep of h seconds; velocities are those of `lag` s ago; page: of a ledger, or None."""
        velocity, spin, about = state.velocity.copy(), state.spin.copy(), (h, lag, REST_ACCELERATIONS * strongest * h)
        if page:
            page.confined(self._room.confine, *about)
        else:
            self._room.confine(state, *about)
        self.gave, self.gave_spin = state.velocity - velocity, state.spin - spin
        others = np.hypot(*self.gave.T) > about[2]
        others |= self._room.facing(state.position[:1]) is None
        self.gave[others] = self.gave_spin[others] = 0

    def go_on(self, state: Slots, page: Any, part: float) -> None:
        """The frame ends: of what was given in the last substep, `part` is still to come."""

        def give(state: Slots, part: float, lag: float) -> None:
            state.velocity += state.real(part) * self.gave
            state.spin += state.real(part) * self.gave_spin

        if page:
            page.confined(give, part, 0.0)
        else:
            give(state, part, 0.0)
