"""A look at a world between two substeps, for pictures of worlds that take long for a frame."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.state.sorted_state import SortedState


class SubstepSnapshot:
    """Where all particles are once some of a frame's substeps are done: a true state at a true time. Reading it changes nothing.

    Good only until the function that was given it returns. The world's own arrays still hold the beginning of the frame.

    Args:
        state: the engine's arrays.
        time: s.
        lag: how far the velocities in `state` are behind that time, s.

    Attributes:
        time: s.
    """

    def __init__(self, state: SortedState, time: float, lag: float) -> None:
        self.time = time
        self._sorted, self._lag = state, lag

    def __len__(self) -> int:
        return len(self._sorted)

    def positions(self) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Copies of positions (n, 2) in m, in the engine's order, and whose each row is: less than half the work of `look`."""
        return np.array(self._sorted.periodic.wrapped(self._sorted.position), dtype=np.float32), self._sorted.particle

    def look(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
        """Copies of positions (n, 2) in m and velocities (n, 2) in m/s, in the engine's order, and whose each row is."""
        state: Any = self._sorted
        position, velocity = np.empty((2, len(state), 2), np.float32)
        lag = state.real(self._lag)
        copy = unit("tools", state.position.dtype).copy_moving
        copy(state.position, state.velocity, state.acceleration, lag, position, velocity)
        if state.periodic:
            state.periodic.wrap(position)
        return position, velocity, state.particle  # reordering makes a new one, and leaves this as it is
