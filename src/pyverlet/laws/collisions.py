"""Collisions between particles: what a user sets (`Collisions`), and which particles overlap."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.state.state import State

Array = NDArray[Any]


@dataclass(frozen=True)
class Fast:
    """Pairs from nested grids, kept in a list until somebody has moved by the skin.

    Args:
        skin: extra distance, in mean diameters, within which pairs are listed. None adapts it to the motion.
    """

    skin: float | None = None

    def __post_init__(self) -> None:
        if self.skin is not None:
            checks.number("skin", self.skin, least=0.0)


@dataclass(frozen=True)
class BruteForce:
    """All pairs, in O(n^2): the reference for `Fast`."""


@dataclass(frozen=True, kw_only=True)
class Collisions:
    """How particles collide with each other.

    Both numbers are for circles added without values of their own. Of two that differ the larger restitution counts, and the
    geometric mean of the frictions, as in Box2D; of a circle with values of its own and a wall likewise.

    Args:
        restitution: e, 0 to 1. An impact leaves with e times the normal speed it came with; contact at rest never bounces.
        friction: mu of Coulomb, 0 or more. 0 leaves spin alone.
        method: how pairs are found, Fast() or the O(n^2) reference BruteForce(). Both find the same contacts.
    """

    restitution: float = 0.0
    friction: float = 0.0
    method: Fast | BruteForce = field(default_factory=Fast)

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


def find_contacts(state: State) -> NDArray[np.int64]:
    """(k, 2) user's indices i < j of all overlapping pairs, sorted; not of two that are pinned, or that masks keep apart."""
    core, count = unit("engine", state.dtype), len(state)
    position = state.seam.wrapped(state.position)
    shift = state.seam.images() if state.seam else np.zeros((1, 2))
    heads, following = np.empty(2 << count.bit_length(), np.int64), np.empty(count, np.int64)
    about = np.isinf(state.mass).view(np.uint8), state.category, state.mask, np.ascontiguousarray(shift, float)
    level, pairs, found = np.empty(count, np.int64), np.empty((0, 2), np.int64), 4 * count
    while found > len(pairs):
        pairs = np.empty((found, 2), np.int64)
        found = core.touching(np.ascontiguousarray(position), state.radius, *about, level, heads, following, pairs)
    pairs = pairs[:found]
    return np.asarray(pairs[np.lexsort(pairs.T[::-1])])


def measure_overlap(state: State, apart: Array) -> Overlap:
    """Overlap of all touching pairs of a state but for those of `apart` (k, 2), which links keep from colliding."""
    if len(state) < 2:
        return Overlap(0.0, 0.0, 0)
    pairs, row = find_contacts(state), np.array([len(state), 1])
    if len(apart):
        pairs = pairs[~np.isin(pairs @ row, np.sort(apart, axis=1) @ row)]
    overlaps = unit("engine", state.dtype).overlaps
    number, total, largest = overlaps(state.seam.wrapped(state.position), state.radius, *state.seam.period, pairs)
    return Overlap(total / number if number else 0.0, largest, number)
