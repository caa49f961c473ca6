"""Warns once if substeps are too long for how an integrator handles user-defined forces that depend on velocity."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from pyverlet.common.errors import CoarseStepsWarning
from pyverlet.common.shown import Shown

FRAMES = 20
"""Frames between checks."""

PROBE = 1e-3
"""Fraction of its speed and of the mean speed by which a particle is accelerated to probe a force."""


class TimeStepCheck:
    """Checks now and then how strongly forces change with the velocity."""

    def __init__(self) -> None:
        self._said = False

    def look(self, world: Any, h: float) -> None:
        """Check the forces before a frame in substeps of h seconds.

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
                        stacklevel=7,  # the caller of World.step
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
