"""Circles added on top of others start smaller and grow: at a stated speed, or more slowly where that would lift too much."""

from __future__ import annotations

import math

import numpy as np

from pyverlet.core import unit
from pyverlet.ground.constants import GROWTH, PACE_FRAMES, SMALLEST, SURPLUS_SOUGHT
from pyverlet.state.slots import Slots


class Growth:
    """Lets circles start smaller, and grow. A crowd that grows lifts itself, and its energy must not rise faster than it may.

    So the speed is GROWTH times a pace between 0 and 1. It follows what the energy has risen by in each frame, averaged over some
    PACE_FRAMES: a pile that is stirred up gains and loses from frame to frame. 1 where nothing is watched.
    """

    def __init__(self) -> None:
        self.pace, self._risen = 1.0, 0.0

    def fit(self, state: Slots, listed: tuple[np.ndarray, ...], fresh: np.ndarray) -> None:
        """Shrink those marked in `fresh` (n,), and whom they overlap, until they just touch; listed: pairs, by cell rows."""
        shrink_to_fit = unit("engine", state.position.dtype).shrink_to_fit
        shrink_to_fit(state.position, state.radius, *state.seam.period, listed, fresh, SMALLEST, state.grown)
        state.resize()

    def grow(self, state: Slots, h: float) -> None:
        """A substep of h seconds."""
        real = state.real
        # In proportion at first: a crowd in one point would otherwise double its size in every substep.
        growth = np.minimum(real(GROWTH), real(10 * GROWTH) * state.grown) * real(self.pace)
        np.minimum(state.grown + growth * real(h), 1, out=state.grown)
        state.resize()

    def heed(self, risen: float) -> None:
        """What the energy has risen by in this frame, as a part of what is allowed; beyond 4 it says no more, nor a loss."""
        self._risen += (min(max(risen, -1.0), 4.0) - self._risen) / PACE_FRAMES
        if self.pace < 1.0 or self._risen > SURPLUS_SOUGHT:  # else the pace stays 1
            change = min(max(1.0 - self._risen / SURPLUS_SOUGHT, -2.0), 1.0) / PACE_FRAMES
            self.pace = min(max(self.pace * math.exp(change), 1e-3), 1.0)

    def save(self) -> tuple[float, float]:
        """What `restore` needs."""
        return self.pace, self._risen

    def restore(self, saved: tuple[float, float]) -> None:
        """Go on as at the time of `save`."""
        self.pace, self._risen = saved
