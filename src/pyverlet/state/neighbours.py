"""Pairs of particles within a range of each other: all of them now, or from a Verlet list that is kept while it is good."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet import core
from pyverlet.ground.arrays import Array
from pyverlet.ground.errors import InputError
from pyverlet.state.cells import FEW, Images, cells_of, regions
from pyverlet.state.seam import NONE, Seam

SKIN = 0.2  # part of its range that a list reaches beyond it: made anew when a particle has moved by half of it (Verlet 1967)
SHARED = 1.3  # a list serves ranges down to its own over this: looking at pairs too far away costs less than another list


class Near(NamedTuple):
    """k pairs i < j, ascending by i, then j: of different places, unless those at the same one are asked for (`together`)."""

    i: NDArray[np.int32]  # (k,) indices in the order of the positions: the engine's in a frame
    j: NDArray[np.int32]
    distance: NDArray[np.float64]  # (k,) between the centres, m; of the nearest images in a periodic room
    way: NDArray[np.float64]  # (k, 2) unit vectors from i to j; of those at the same place (1, 0)


def list_pairs(position: Array, reach: float | Array, seam: Seam = NONE) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """i, j (k,) of all pairs nearer than `reach` m, i < j, ascending by i, then j. The time grows with the number of pairs.

    Args:
        position: (n, 2) m, float32 or float64.
        reach: m, or (n,): what counts is that of i.
        seam: that of a periodic room: each pair counts once, with its nearest images.
    """
    count, numbers = max(len(position), 1), np.zeros(0, np.int64)
    if len(position):
        spot, size = seam.wrapped(np.ascontiguousarray(position, np.float64)), np.broadcast_to(reach, count)
        seen = Images.of(spot, size, seam, float(size.max()))
        cells, far = cells_of(seen.position, few=count <= FEW), size[:, None]
        i, j = regions(spot - far, spot + far, spot, size, cells, seen.position, later=True)
        numbers = np.sort((i * count + seen.named(j))[i < seen.named(j)] if seam else i * count + j)
        numbers = numbers[np.diff(numbers, prepend=-1) > 0]  # two images of a particle may be near to another one
    i, j = np.divmod(numbers, count)
    return i.astype(np.int32), j.astype(np.int32)


def near(position: Array, reach: float, seam: Seam = NONE, *, together: bool = False) -> Near:
    """All pairs nearer than `reach` m now."""
    i, j = list_pairs(position, reach * (1 + 1e-9), seam)  # rounded images; what is too far is dropped
    return _measured(position, i, j, reach, seam, together, *_room_for(len(i)))


def check_range(reach: float, seam: Seam) -> None:
    """A particle feels one image of each other one, the nearest.

    Raises:
        InputError: a periodic room is narrower than twice the range.
    """
    if 2 * reach > seam.shortest:
        raise InputError(f"range is {reach:g}; allowed in this periodic room is at most {seam.shortest / 2:g}, half its period")


def _room_for(count: int) -> tuple[Array, Array, Array]:
    return np.empty((2, count), np.int32), np.empty(count), np.empty((count, 2))


def _measured(position: Array, i: Array, j: Array, reach: float, seam: Seam, together: bool, *room: Array) -> Near:
    pairs, distance, way = room
    found = core.unit("motion", position.dtype).measure_near(position, i, j, reach, *seam.period, together, *room)
    return Near(pairs[0, :found], pairs[1, :found], distance[:found], way[:found])


class VerletList:
    """Pairs of one range and a skin: good until a particle has moved by half the skin, or they are sorted anew.

    Whatever the list was made of, the pairs it gives are the same: it decides how long that takes, and nothing else.
    """

    def __init__(self, reach: float) -> None:
        self.reach, self.skin = reach, SKIN * reach
        self._order: Any = None
        self._seam = NONE
        self._from: Array = np.empty(0)
        self._i: Array = self._from
        self._j: Array = self._from
        self._room = _room_for(0)
        self.made = 0  # how often

    def within(self, position: Array, order: Array, seam: Seam, reach: float, *, together: bool = False) -> Near:
        """The pairs nearer than `reach`, at most its own, in arrays that the next call fills again: new ones take twice the time.

        order: an array that is another when particles are sorted anew.
        """
        if self._order is not order or self._seam != seam or self._moved(position):
            self._i, self._j = list_pairs(position, self.reach + self.skin, seam)
            self._from, self._order, self._seam, self._room = position.copy(), order, seam, _room_for(len(self._i))
            self.made += 1
        return _measured(position, self._i, self._j, reach, seam, together, *self._room)

    def _moved(self, position: Array) -> bool:
        motion = core.unit("motion", position.dtype)
        return bool(motion.moved_beyond(position, self._from, 0.5 * self.skin, *self._seam.period))


class VerletLists(list[VerletList]):
    """Those of a world. Similar ranges share one."""

    def within(self, position: Array, order: Array, seam: Seam, reach: float, *, together: bool = False) -> Near:
        """The pairs nearer than `reach`, as `VerletList.within` gives them.

        Raises:
            InputError: a periodic room is narrower than twice the range.
        """
        check_range(reach, seam)
        for known in self:
            if known.reach / SHARED <= reach <= known.reach:
                return known.within(position, order, seam, reach, together=together)
        self[:] = [*self[-7:], VerletList(reach)]  # forces whose range changes leave lists behind
        return self[-1].within(position, order, seam, reach, together=together)
