"""Particles in square cells, for queries by kernels, and pairs within a range of each other.

In a periodic room cells contain images of particles, too. Pairs are computed anew, or taken from a Verlet list while it is valid.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet import core
from pyverlet.ground import checks
from pyverlet.ground.arrays import Array, Floats, Indices
from pyverlet.ground.errors import InputError
from pyverlet.state.seam import NONE, Seam

FEW = 8
"""Number of queries up to which testing every particle costs less than sorting them into cells."""

LISTED = 16
"""Most cells per disc, on average."""

ROUNDED_OFF = 1e-6
"""Margin of listed discs, over the cell size: rays compute their cells with other rounding."""

SAMPLE, OUTSIDE, SPARE = 1024, 50, 0.1
"""The grid of centres spans all but one in OUTSIDE of a sample on each side, plus this fraction."""

SKIN = 0.2  # margin of a list over its range; remade after a particle has moved by half of it (Verlet 1967)
SHARED = 1.3  # a list serves smaller ranges down to this ratio: testing far pairs costs less than another list


class Images(NamedTuple):
    """Centres (m, 2) and radii (m,), in m, of particles and images, and the particle of each."""

    position: Array
    radius: Array
    owner: Indices | None

    @classmethod
    def of(cls, position: Array, radius: Array, seam: Seam, reach: float) -> Images:
        """All particles and, in a periodic room, the images within `reach`, m, of it."""
        if not seam:
            return cls(position, radius, None)
        inside = seam.wrapped(position)
        low, high = np.array((seam.low_x, seam.low_y)), np.array((seam.low_x + seam.period_x, seam.low_y + seam.period_y))
        periodic = np.array(seam.period) > 0
        places, owners = [inside], [np.arange(len(radius))]
        for shift in seam.images()[1:]:
            moved = inside + shift
            near = np.flatnonzero((((moved >= low - reach) & (moved <= high + reach)) | ~periodic).all(axis=1))
            places.append(moved[near].astype(inside.dtype))
            owners.append(near)
        owner = np.concatenate(owners)
        return cls(np.concatenate(places), radius[owner], owner)

    def named(self, found: Indices) -> Indices:
        """Particle indices instead of image indices; -1 stays."""
        return found if self.owner is None else np.where(found >= 0, self.owner[found], -1)


def cells_of(position: Array, radius: Array | None = None, reach: float = 0.0, *, few: bool) -> tuple[Any, ...]:
    """Cells over all particles, about one per particle, with their contents, as kernels take them; a single cell for few queries.

    Without radii (n,), m, each particle is in the cell of its centre, else in all cells within `reach` m of its disc. Distant
    outliers are in rim cells; for discs the cells cover everything.
    """
    tools, size = core.unit("tools", position.dtype), np.zeros(0, position.dtype) if radius is None else radius
    margin = reach + float(size.max(initial=0.0))
    x0, y0, x1, y1 = tools.extent(position)
    if not few and radius is None:
        some = np.sort(position[:: 1 + len(position) // SAMPLE].astype(float), axis=0)
        low, high = some[len(some) // OUTSIDE], some[-1 - len(some) // OUTSIDE]
        (x0, y0), (x1, y1) = np.fmax((x0, y0), low - SPARE * (high - low)), np.fmin((x1, y1), high + SPARE * (high - low))
    x0, y0, width, height = x0 - margin, y0 - margin, x1 - x0 + 2 * margin, y1 - y0 + 2 * margin
    if few:
        member = np.arange(len(position), dtype=np.int32)
        if core.unit("motion", position.dtype).first_non_finite(position) >= 0:
            member = member[np.isfinite(position).all(axis=1)]
        return x0, y0, max(width, height) or 1.0, 1, 1, np.array([0, len(member), 0], np.int32), member
    cell = max(np.sqrt(width * height / len(position)), max(width, height) / len(position)) or 1.0
    if len(size):
        cell = max(cell, reach + size.mean(dtype=float))
        while ((2.0 * (size.astype(float) + reach) / cell + 1.0) ** 2).mean() > LISTED:
            cell *= 2.0
        reach += ROUNDED_OFF * cell
    columns, rows = int(width / cell) + 1, int(height / cell) + 1
    begin, member = np.empty(columns * rows + 2, np.int32), np.empty((1 + 3 * (len(size) > 0)) * len(position), np.int32)
    while (found := tools.list_discs(position, size, reach, x0, y0, cell, columns, rows, begin, member)) > len(member):
        member = np.empty(found, np.int32)
    return x0, y0, cell, columns, rows, begin, member


def regions(
    low: Floats, high: Floats, middle: Floats, size: Floats, cells: tuple[Any, ...], position: Array, *, later: bool = False
) -> tuple[Indices, Indices]:  # fmt: skip
    """(k,) regions and (k,) particles, unordered: particles in boxes from `low` to `high` (q, 2) and, where `size` (q,) is
    finite, at most that far from `middle` (q, 2). later: only particles with a higher index than the region's.
    """
    found, room, size = 0, 64 + 8 * len(low), np.ascontiguousarray(size)
    query, particle = (np.zeros(0, np.int64) for _ in range(2))
    while room > len(query):
        query, particle = (np.empty(room, np.int64) for _ in range(2))
        found = core.unit("tools", position.dtype).in_regions(low, high, middle, size, cells, position, query, particle, later)
        room = max(room, found)
    return query[:found], particle[:found]


class Near(NamedTuple):
    """k pairs i < j, sorted by i, then j; without coincident particles, unless they are requested (`together`)."""

    i: NDArray[np.int32]  # (k,) indices in the order of the positions, within a frame the engine's
    j: NDArray[np.int32]
    distance: NDArray[np.float64]  # (k,) between centres or nearest images, m
    way: NDArray[np.float64]  # (k, 2) unit vectors from i to j; (1, 0) if coincident


def list_pairs(position: Array, reach: float | Array, seam: Seam = NONE) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """i, j (k,) of all pairs closer than `reach` m, i < j, sorted by i, then j. The time is proportional to the number of pairs.

    Args:
        position: (n, 2) m, float32 or float64.
        reach: m, or (n,), of which that of i is used.
        seam: periodicity of the room; each pair counts once, with its nearest images.
    """
    count, numbers = max(len(position), 1), np.zeros(0, np.int64)
    if len(position):
        spot, size = seam.wrapped(np.ascontiguousarray(position, np.float64)), np.broadcast_to(reach, count)
        seen = Images.of(spot, size, seam, float(size.max()))
        cells, far = cells_of(seen.position, few=count <= FEW), size[:, None]
        i, j = regions(spot - far, spot + far, spot, size, cells, seen.position, later=True)
        numbers = np.sort((i * count + seen.named(j))[i < seen.named(j)] if seam else i * count + j)
        numbers = numbers[np.diff(numbers, prepend=-1) > 0]  # two images of a particle may be near another one
    i, j = np.divmod(numbers, count)
    return i.astype(np.int32), j.astype(np.int32)


def near(position: Array, reach: float, seam: Seam = NONE, *, together: bool = False) -> Near:
    """All pairs currently closer than `reach` m."""
    i, j = list_pairs(position, reach * (1 + 1e-9), seam)  # a margin for rounded images; pairs too far apart are dropped
    return _measured(position, i, j, reach, seam, together, *_room_for(len(i)))


def check_range(reach: float, seam: Seam) -> float:
    """A checked range, m: in a periodic room a particle must interact with one image of each other one only.

    Raises:
        InputError: the range is not greater than 0, or a periodic room is narrower than twice the range.
    """
    reach = checks.number("range", reach, above=0.0)
    if 2 * reach > seam.shortest:
        raise InputError(f"range is {reach:g}; allowed in this periodic room is at most {seam.shortest / 2:g}, half its period")
    return reach


def _room_for(count: int) -> tuple[Array, Array, Array]:
    return np.empty((2, count), np.int32), np.empty(count), np.empty((count, 2))


def _measured(position: Array, i: Array, j: Array, reach: float, seam: Seam, together: bool, *room: Array) -> Near:
    pairs, distance, way = room
    found = core.unit("motion", position.dtype).measure_near(position, i, j, reach, *seam.period, together, *room)
    return Near(pairs[0, :found], pairs[1, :found], distance[:found], way[:found])


class VerletList:
    """Pairs within a range plus a skin: valid until a particle has moved by half the skin, or particles are re-sorted.

    The resulting pairs do not depend on the list, which only affects the time.
    """

    def __init__(self, reach: float) -> None:
        self.reach, self.skin = reach, SKIN * reach
        self._order: Any = None
        self._seam = NONE
        self._from: Array = np.empty(0)
        self._i: Array = self._from
        self._j: Array = self._from
        self._room = _room_for(0)
        self.made = 0  # number of times it was made

    def within(self, position: Array, order: Array, seam: Seam, reach: float, *, together: bool = False) -> Near:
        """The pairs closer than `reach`, at most its own range, in arrays that the next call overwrites, as new ones are slow.

        order: an array that is replaced when particles are re-sorted.
        """
        motion = core.unit("motion", position.dtype)
        known = self._order is order and self._seam == seam
        if not known or motion.moved_beyond(position, self._from, 0.5 * self.skin, *seam.period):
            self._i, self._j = list_pairs(position, self.reach + self.skin, seam)
            self._from, self._order, self._seam, self._room = position.copy(), order, seam, _room_for(len(self._i))
            self.made += 1
        return _measured(position, self._i, self._j, reach, seam, together, *self._room)


class VerletLists(list[VerletList]):
    """The Verlet lists of a world; similar ranges share one."""

    def within(self, position: Array, order: Array, seam: Seam, reach: float, *, together: bool = False) -> Near:
        """The pairs closer than `reach`, as `VerletList.within` returns them.

        Raises:
            InputError: a periodic room is narrower than twice the range.
        """
        reach = check_range(reach, seam)
        for known in self:
            if known.reach / SHARED <= reach <= known.reach:
                return known.within(position, order, seam, reach, together=together)
        self[:] = [*self[-7:], VerletList(reach)]  # drop old lists of forces whose range changes
        return self[-1].within(position, order, seam, reach, together=together)
