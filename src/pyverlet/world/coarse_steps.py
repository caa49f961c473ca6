"""Says once that substeps are too long for a function of the user's own that depends on velocities."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from pyverlet.ground.arrays import Array
from pyverlet.ground.errors import CoarseStepsWarning

FRAMES = 20
"""Between looks."""

FOLLOWED = 0.15
"""c h / m up to which forces that change by c with the velocity are followed: at 0.2 a magnetic one gains 4 % in ten seconds, at
0.3 a half."""

SMALL = 1e-3
"""Of a velocity: what the iteration changes less is rounding."""


class CoarseSteps:
    """Looks now and then by how much functions change forces when the fixed-point iteration has changed velocities."""

    def __init__(self) -> None:
        self._change = 0.0  # the largest c h / m so far; infinite: it has been told

    def before(self, world: Any, state: Any) -> tuple[Array, Array] | None:
        """Velocities and accelerations before a pass that is to be looked at."""
        looks = self._change <= FOLLOWED and world.frames % FRAMES == 0
        return (state.velocity.copy(), state.acceleration.copy()) if looks else None

    def note(self, state: Any, velocity: Array, acceleration: Array, ahead: float) -> None:
        """After that pass, with velocities of so many seconds ahead, half a substep."""
        moved = np.hypot(*(state.velocity - velocity).T.astype(float))
        told = moved > SMALL * np.hypot(*velocity.T.astype(float))
        if told.any():
            changed = np.hypot(*(state.acceleration - acceleration).T.astype(float))
            self._change = max(self._change, float((changed[told] / moved[told]).max()) * 2.0 * ahead)

    def tell(self) -> None:
        """Warn if it is so, and has not been told.

        Warns:
            CoarseStepsWarning: c h / m is more than FOLLOWED.
        """
        if FOLLOWED < self._change < np.inf:
            told, self._change = self._change, np.inf
            warnings.warn(
                f"a force of a function changes with the velocity by c with c h / m = {told:.2g}; allowed is up to {FOLLOWED:g}, "
                "with more substeps or a smaller dt (pyverlet.Drag and Wind have no such limit)",
                CoarseStepsWarning,
                stacklevel=3,  # who has called World.step
            )
