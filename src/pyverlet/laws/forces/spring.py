"""A spring to a point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pyverlet.ground import checks
from pyverlet.state.state import Slots, State


class PointSpring:
    """A spring of zero length from every particle to one point.

    F = -stiffness (x - center), with the potential stiffness |x - center|^2 / 2.

    Args:
        center: (x, y), m.
        stiffness: N/m.
    """

    velocity_dependent = False

    def __init__(self, *, center: Sequence[float] = (0.0, 0.0), stiffness: float) -> None:
        self.center = checks.vector("center", center)
        self.stiffness = checks.number("stiffness", stiffness, least=0.0)

    def apply(self, state: Slots, t: float) -> None:
        state.force -= self.stiffness * (state.position - np.asarray(self.center, state.dtype))

    def potential(self, state: State) -> float:
        offset = state.position.astype(np.float64) - self.center
        return float(0.5 * self.stiffness * np.sum(offset * offset))
