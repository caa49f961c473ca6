"""A snapshot of a world between two substeps, for pictures of worlds whose frames take long."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.state.sorted_state import SortedState


class SubstepSnapshot:
    """A world after some of a frame's substeps, for observers: a true state at a true time. Reading it changes nothing.

    It is valid only until the function that received it returns. The world's own arrays still hold the start of the frame.

    Args:
        state: the engine's arrays.
        time: s.
        lag: how far the velocities in `sorted_state` are behind that time, s.

    Attributes:
        time: s.
    """

    def __init__(self, sorted_state: SortedState, time: float, lag: float) -> None:
        self.time = time
        self._sorted, self._lag = sorted_state, lag

    def __len__(self) -> int:
        return len(self._sorted)

    def positions(self) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Copies of positions (n, 2), m, in the engine's order, and the particle of each row; half the cost of `look`."""
        return np.array(self._sorted.periodic.wrapped(self._sorted.position), dtype=np.float32), self._sorted.particle

    def look(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
        """Copies of positions (n, 2), m, and velocities (n, 2), m/s, in the engine's order, and the particle of each row."""
        sorted_state: Any = self._sorted
        position, velocity = np.empty((2, len(sorted_state), 2), np.float32)
        lag = sorted_state.real(self._lag)
        copy = unit("tools", sorted_state.position.dtype).copy_moving
        copy(sorted_state.position, sorted_state.velocity, sorted_state.acceleration, lag, position, velocity)
        if sorted_state.periodic:
            sorted_state.periodic.wrap(position)
        return position, velocity, sorted_state.particle  # reordering makes a new array and leaves this one
