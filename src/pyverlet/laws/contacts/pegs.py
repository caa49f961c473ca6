"""Circles that do not fit between two pinned ones: found whenever the list of pairs is made anew, and held in every substep."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.kernels import pegs as kernels
from pyverlet.laws.contacts.broadphase import PairList
from pyverlet.state.slots import Slots

Array = NDArray[Any]


class Pegs:
    """Which circles have which two pegs near them, that are too near to each other to let them through."""

    def __init__(self) -> None:
        self._between: tuple[Array, Array, Array] = (np.empty(0, np.int64),) * 3
        self._side = np.empty(0)

    def __bool__(self) -> bool:
        return len(self._side) > 0

    def look(self, state: Slots, pairs: PairList) -> None:
        """The list is new: who is near two pegs."""
        circle, first, second = self._between = _near_two(state.inverse_mass, pairs)
        found = np.empty(len(circle), np.int64)
        kernels.narrow(state.position, state.radius, circle, first, second, found)
        self._between = circle[found > 0], first[found > 0], second[found > 0]
        self._side = np.empty(len(self._between[0]))

    def before(self, state: Slots, h: float) -> None:
        """The circles have moved, by h times their velocities, and contacts have not changed that yet."""
        if self:
            kernels.note_sides(state.position, state.velocity, *self._between, h, self._side)

    def hold(self, state: Slots) -> None:
        """Contacts have done what they can."""
        if self:
            kernels.hold(state.position, state.velocity, state.resting, state.size, *self._between, self._side)


def _near_two(inverse_mass: Array, pairs: PairList) -> tuple[Array, Array, Array]:
    """Slots of circles and of two pegs that are listed as near them; each circle with any two of its pegs."""
    none = np.empty(0, np.int64)
    if np.count_nonzero(inverse_mass) > len(inverse_mass) - 2:
        return none, none, none
    circle, peg = (np.empty(int(pairs.count.sum()), np.int64) for _ in range(2))
    near = kernels.beside(*pairs.listed(), inverse_mass, circle, peg)
    circle, peg = circle[:near], peg[:near]
    order = np.lexsort((peg, circle))
    circle, peg, found = circle[order], peg[order], []
    for apart in range(1, int(np.bincount(circle).max(initial=0))):
        k = np.flatnonzero(circle[apart:] == circle[:-apart])
        found.append((circle[k], peg[k], peg[k + apart]))
    return tuple(np.concatenate(column) for column in zip(*found, strict=True)) if found else (none, none, none)  # type: ignore[return-value]
