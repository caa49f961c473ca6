"""Whom the broad phase sees: the circles and, in a periodic room, copies of those near the seam a period further."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.kernels import seam as kernels
from pyverlet.state.slots import Slots

if TYPE_CHECKING:
    from pyverlet.laws.contacts.grids import Grids

Array = NDArray[Any]

_ROUNDINGS = 8
"""Roundings of the largest coordinate that two images may differ by from where they are."""

_KNOWN = 2.0
"""Skins: rims that are nearer across the seam stand near each other, for one of both has a copy."""


class Crowd(NamedTuple):
    """Circles, and behind them `copies`, as arrays over both (n + copies,).

    Attributes:
        owner: (copies,) whose copy each is.
        rounding: m, what images are rounded by.
        above: m, y of the upper seam; infinite without one.
        known: m; rims that are nearer than that across the seam are near those of a copy.
    """

    position: Array
    radius: Array
    inverse_mass: Array
    category: Array
    mask: Array
    owner: Array
    copies: int = 0
    rounding: float = 0.0
    above: float = np.inf
    known: float = np.inf

    @classmethod
    def of(cls, state: Slots, skin: float) -> Crowd:
        """The circles of now, of which those count as near whose rims are nearer than `skin`, m."""
        seam, columns = state.seam, (state.radius, state.inverse_mass, state.category, state.mask)
        if not seam:
            return cls(state.position, *columns, np.empty(0, np.int32))
        position, rounding = seam.wrapped(state.position), float(np.finfo(state.dtype).eps) * _ROUNDINGS * _largest(state)
        largest = float(state.radius.max(initial=0.0))
        known = _KNOWN * skin + rounding
        where, size, owner = np.empty((0, 2), state.dtype), np.empty(0, state.dtype), np.empty(0, np.int32)
        copy: Any = kernels.ghosts
        numbers = state.reals(*seam, largest + known)
        while (copies := int(copy(position, state.radius, *numbers, where, size, owner))) > len(owner):
            where, size, owner = np.empty((copies, 2), state.dtype), np.empty(copies, state.dtype), np.empty(copies, np.int32)
        above = seam.low_y + seam.period_y if seam.period_y else np.inf
        weight, category, mask = (np.concatenate((column, column[owner])) if len(column) else column for column in columns[1:])
        position, radius = np.concatenate((position, where)), np.concatenate((state.radius, size))
        return cls(position, radius, weight, category, mask, owner, copies, rounding, above, known)

    def originals(self, order: Array) -> Array:
        """Those of an order (n + copies,) that are no copies."""
        return order[order < len(self.radius) - self.copies] if self.copies else order

    def bring_home(self, listed: tuple[Array, Array, Array, Array], grids: Grids) -> None:
        """Pairs of copies become pairs of their owners, in a list and in the order of the grids."""
        if not self.copies:
            return
        count = len(self.radius) - self.copies
        kernels.bring_home(*listed, count, self.owner)
        grids.order = np.concatenate((np.arange(count, dtype=np.int32), self.owner))[grids.order]


def free_skin(state: Slots) -> float:
    """m; with a thicker skin a pair could be near each other on both sides of a periodic room."""
    return max(0.5 * state.seam.shortest - 2.0 * float(state.radius.max(initial=0.0)), 0.0) if state.seam else np.inf


def _largest(state: Slots) -> float:
    """The largest coordinate of the room and its copies, m."""
    low_x, low_y, period_x, period_y = map(abs, state.seam)
    return max(low_x + 2 * period_x, low_y + 2 * period_y)
