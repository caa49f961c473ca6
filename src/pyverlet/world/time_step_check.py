"""Says once that substeps are too long for what an integrator makes of forces of the user's own that depend on velocities."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from pyverlet.common.errors import CoarseStepsWarning
from pyverlet.common.shown import Shown

FRAMES = 20
"""Between looks."""

PROBE = 1e-3
"""By which part of its speed, and of the mean, a particle is made faster to see what that changes."""


class TimeStepCheck:
    """Looks now and then by how much they change with the velocity."""

    def __init__(self) -> None:
        self._said = False

    def look(self, world: Any, h: float) -> None:
        """Before a frame in substeps of h seconds.

        Warns:
            CoarseStepsWarning: once for a world, if a force changes by c with the velocity, and c h / m is more than the
                integrator follows.
        """
        if self._said or world.frames % FRAMES or not np.isfinite(limit := world.integrator.follows) or not len(world):
            return
        for force in world.forces:
            if not isinstance(force, Shown) and getattr(force, "velocity_dependent", True):
                found = h * _rate(force, world._sorted, world.time)
                if found > limit:
                    self._said = True
                    warnings.warn(
                        f"{force!r} changes by c with the velocity, and c h / m is {found:.2g} in substeps of {h:.2g} s; allowed "
                        f"with {type(world.integrator).__name__} is up to {limit:g}, or another integrator: "
                        "pyverlet.TimeCorrectedVerlet, the default, follows any",
                        CoarseStepsWarning,
                        stacklevel=7,  # who has called World.step
                    )
                    return


def _rate(force: Any, state: Any, t: float) -> float:
    """c / m, 1/s, the largest of all free particles."""
    velocity, summed = state.velocity, state.force.copy()
    speed = np.hypot(*velocity.T)
    little = np.maximum(PROBE * (speed + speed.mean()), 1e-6).astype(velocity.dtype)
    rates, before = [0.0], np.zeros(velocity.shape)
    try:
        for way in ((0, 0), (1, 0), (0, 1)):
            state.velocity = velocity + little[:, None] * np.array(way, velocity.dtype)
            state.force.fill(0)
            force.apply(state, t)
            changed, faster = np.hypot(*(state.force - before).T), (state.velocity - velocity).sum(axis=1)
            rate = changed[faster > 0] / faster[faster > 0] * state.inverse_mass[faster > 0]
            rates += [float(rate[np.isfinite(rate)].max(initial=0.0))]
            before = before if any(way) else state.force.astype(float)
    finally:
        state.velocity = velocity
        state.force[:] = summed
    return max(rates)
