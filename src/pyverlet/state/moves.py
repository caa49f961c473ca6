"""The moves integrators are made of, on slots: each a call of the compiled core."""

from __future__ import annotations

from pyverlet import core
from pyverlet.ground.arrays import Array
from pyverlet.state.slots import Slots


def advance(out: Array, base: Array, slope: Array, h: float) -> None:
    """out = base + h * slope on (n, 2) arrays; the move every integrator is made of. out may be base."""
    core.unit("motion", out.dtype).advance(out, base, slope, h)


def first_non_finite(state: Slots) -> int:
    """The user's index of a particle whose position or velocity is NaN or infinite; -1 if all are finite."""
    if state.motion.all_finite(state.position, state.velocity):
        return -1
    for array in (state.position, state.velocity):
        slot = int(state.motion.first_non_finite(array))
        if slot >= 0:
            return int(state.particle[slot])
    return -1
