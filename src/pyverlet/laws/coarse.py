"""Says once that a step is too coarse for a gas: circles that move by much of their radius in a substep meet late."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from pyverlet.ground.constants import GAS_FROM, GAS_LOOK_FRAMES, GAS_STEP
from pyverlet.ground.errors import CoarseStepWarning


class Coarse:
    """Looks at a gas now and then: many circles that bounce off each other, without gravity."""

    def __init__(self) -> None:
        self._said = False

    def look(self, world: Any, h: float) -> None:
        """After a frame in substeps of h seconds.

        Warns:
            CoarseStepWarning: once for a world, if the root mean square way of its circles in a substep is beyond GAS_STEP radii.
        """
        if self._said or world.frames % GAS_LOOK_FRAMES or len(world) < GAS_FROM or any(world.gravity) or not world.collisions:
            return
        if not max(world.collisions.restitution, world._slots.most_restitution) > 0.0:
            return
        x, y = world.velocity.T
        way = np.sqrt(x * x + y * y) * h / world.radius
        mean = float(np.sqrt(np.mean(np.square(way, dtype=float))))
        if mean > GAS_STEP:
            self._said = True
            most, needed = int(way.argmax()), int(np.ceil(world.substeps * mean / GAS_STEP))
            warnings.warn(
                f"particle {most} moves by {way[most]:.2g} of its radius in a substep, and all by {mean:.2g} (root mean square): "
                f"a gas loses pressure beyond {GAS_STEP:g}; allowed are substeps of at least {needed}",
                CoarseStepWarning,
                stacklevel=5,  # who has called World.step, which waits for its turn
            )
