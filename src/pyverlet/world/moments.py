"""A snapshot of a world between two substeps, for pictures of worlds whose frames take long."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.state.slots import Slots


class Moment:
    """A world after some of a frame's substeps, for observers: a true state at a true time. Reading it changes nothing.

    It is valid only until the function that received it returns. The world's own arrays still hold the start of the frame.

    Args:
        slots: the engine's arrays.
        time: s.
        lag: how far the velocities in `slots` are behind that time, s.

    Attributes:
        time: s.
    """

    def __init__(self, slots: Slots, time: float, lag: float) -> None:
        self.time = time
        self._slots, self._lag = slots, lag

    def __len__(self) -> int:
        return len(self._slots)

    def positions(self) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Copies of positions (n, 2), m, in the engine's order, and the particle of each row; half the cost of `look`."""
        return np.array(self._slots.seam.wrapped(self._slots.position), dtype=np.float32), self._slots.particle

    def look(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
        """Copies of positions (n, 2), m, and velocities (n, 2), m/s, in the engine's order, and the particle of each row."""
        slots: Any = self._slots
        position, velocity = np.empty((2, len(slots), 2), np.float32)
        lag = slots.real(self._lag)
        copy = unit("tools", slots.position.dtype).copy_moving
        copy(slots.position, slots.velocity, slots.acceleration, lag, position, velocity)
        if slots.seam:
            slots.seam.wrap(position)
        return position, velocity, slots.particle  # reordering makes a new array and leaves this one
