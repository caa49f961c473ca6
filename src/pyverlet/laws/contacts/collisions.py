"""Collisions between particles: what a user sets (`Collisions`), and how far particles overlap."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.laws.contacts.methods import BruteForce, Fast
from pyverlet.state.state import State

Array = NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class Collisions:
    """How particles collide with each other.

    Both numbers are for circles added without values of their own. Of two that differ the larger restitution counts, and the
    geometric mean of the frictions, as in Box2D; of a circle with values of its own and a wall likewise.

    Args:
        restitution: e, 0 to 1. An impact leaves with e times the normal speed it came with; contact at rest never bounces.
        friction: mu of Coulomb, 0 or more. 0 leaves spin alone.
        method: how pairs are found, Fast() or the O(n^2) reference BruteForce(). Both find the same contacts.
        impulses: contacts remember impulses (docs/design/impulses.md): heaps stay at rest when the length of frames or the number
            of substeps changes, in the room or on unequal masses. So far in worlds of circles, obstacles, forces and a room,
            without links or sleep. None: where it knows all that there is in the world.
    """

    restitution: float = 0.0
    friction: float = 0.0
    method: Fast | BruteForce = field(default_factory=Fast)
    impulses: bool | None = True

    def __post_init__(self) -> None:
        checks.fraction("restitution", self.restitution)
        checks.number("friction", self.friction, least=0.0)
        if not isinstance(self.method, Fast | BruteForce):
            raise InputError(f"method is {self.method!r}; allowed are pyverlet.Fast() and pyverlet.BruteForce()")


class Overlap(NamedTuple):
    """Overlap of the touching pairs, as a fraction of the contact distance r_i + r_j."""

    mean: float
    max: float
    contacts: int


def touching(state: State) -> Array:
    """(k, 2) indices i < j of all pairs of a state that overlap and may touch each other, in no order."""
    count, found = len(state), 4 * len(state)
    shift = state.seam.images() if state.seam else np.zeros((1, 2))
    work = np.empty(2 << count.bit_length(), np.int32), *np.empty((2, count), np.int32)
    about = state.seam.wrapped(state.position), state.radius, np.isinf(state.mass), state.category, state.mask, shift, work
    i = j = np.empty(0, np.uint32)
    while found > len(i):
        i, j = np.empty((2, found), np.uint32)
        found = int(unit("motion", state.dtype).touching(*about, i, j))
    return np.column_stack((i[:found], j[:found])).astype(np.int64)


def measure_overlap(state: State, apart: Array) -> Overlap:
    """Overlap of all touching pairs of a state, but for those of `apart` (k, 2), i < j; leaves the state alone."""
    if len(state) < 2:
        return Overlap(0.0, 0.0, 0)
    pairs = touching(state)
    if len(apart):
        key = np.array([len(state), 1])
        pairs = pairs[~np.isin(pairs @ key, apart @ key)]
    i, j = np.ascontiguousarray(pairs.T, np.uint32)
    listed = np.zeros(1, np.int64), np.array([len(pairs)]), i, j
    position = state.seam.wrapped(state.position)
    number, total, largest = unit("engine", state.dtype).overlaps(position, state.radius, *state.seam.period, listed)
    return Overlap(total / number if number else 0.0, largest, number)
