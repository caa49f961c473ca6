"""Particles in square cells, for queries by kernels, and pairs within a range of each other.

In a periodic room cells contain images of particles, too. Pairs are computed anew, or taken from a Verlet list while it is valid.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet import core
from pyverlet.common import checks
from pyverlet.common.arrays import Array, Floats, Indices
from pyverlet.common.errors import InputError
from pyverlet.state.periodicity import NONE, Periodicity

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
    def of(cls, position: Array, radius: Array, periodic: Periodicity, cutoff: float) -> Images:
        """All particles and, in a periodic room, the images within `cutoff`, m, of it."""
        if not periodic:
            return cls(position, radius, None)
        inside = periodic.wrapped(position)
        low, high = (
            np.array((periodic.low_x, periodic.low_y)),
            np.array((periodic.low_x + periodic.period_x, periodic.low_y + periodic.period_y)),
        )
        repeats = np.array(periodic.period) > 0
        places, owners = [inside], [np.arange(len(radius))]
        for shift in periodic.images()[1:]:
            moved = inside + shift
            near = np.flatnonzero((((moved >= low - cutoff) & (moved <= high + cutoff)) | ~repeats).all(axis=1))
            places.append(moved[near].astype(inside.dtype))
            owners.append(near)
        owner = np.concatenate(owners)
        return cls(np.concatenate(places), radius[owner], owner)

    def named(self, found: Indices) -> Indices:
        """Particle indices instead of image indices; -1 stays."""
        return found if self.owner is None else np.where(found >= 0, self.owner[found], -1)


def cells_of(position: Array, radius: Array | None = None, cutoff: float = 0.0, *, few: bool) -> tuple[Any, ...]:
    """Cells over all particles, about one per particle, with their contents, as kernels take them; a single cell for few queries.

    Without radii (n,), m, each particle is in the cell of its centre, else in all cells within `cutoff` m of its disc. Distant
    outliers are in rim cells; for discs the cells cover everything.
    """
    tools, size = core.unit("tools", position.dtype), np.zeros(0, position.dtype) if radius is None else radius
    margin = cutoff + float(size.max(initial=0.0))
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
        cell = max(cell, cutoff + size.mean(dtype=float))
        while ((2.0 * (size.astype(float) + cutoff) / cell + 1.0) ** 2).mean() > LISTED:
            cell *= 2.0
        cutoff += ROUNDED_OFF * cell
    columns, rows = int(width / cell) + 1, int(height / cell) + 1
    begin, member = np.empty(columns * rows + 2, np.int32), np.empty((1 + 3 * (len(size) > 0)) * len(position), np.int32)
    while (found := tools.list_discs(position, size, cutoff, x0, y0, cell, columns, rows, begin, member)) > len(member):
        member = np.empty(found, np.int32)
    return x0, y0, cell, columns, rows, begin, member


def regions(
    low: Floats, high: Floats, middle: Floats, size: Floats, cells: tuple[Any, ...], position: Array, *, later: bool = False
) -> tuple[Indices, Indices]:  # fmt: skip
    """(k,) regions and (k,) particles, unordered: particles in boxes from `low` to `high` (q, 2) and, where `size` (q,) is
    finite, at most that far from `middle` (q, 2). later: only particles with a higher index than the region's.
    """
    found, capacity, size = 0, 64 + 8 * len(low), np.ascontiguousarray(size)
    query, particle = (np.zeros(0, np.int64) for _ in range(2))
    while capacity > len(query):
        query, particle = (np.empty(capacity, np.int64) for _ in range(2))
        found = core.unit("tools", position.dtype).in_regions(low, high, middle, size, cells, position, query, particle, later)
        capacity = max(capacity, found)
    return query[:found], particle[:found]


class Near(NamedTuple):
    """k pairs i < j, sorted by i, then j; without coincident particles, unless they are requested (`together`)."""

    i: NDArray[np.int32]  # (k,) indices in the order of the positions, within a frame the engine's
    j: NDArray[np.int32]
    distance: NDArray[np.float64]  # (k,) between centres or nearest images, m
    way: NDArray[np.float64]  # (k, 2) unit vectors from i to j; (1, 0) if coincident


def list_pairs(
    position: Array, cutoff: float | Array, periodic: Periodicity = NONE
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """i, j (k,) of all pairs closer than `cutoff` m, i < j, sorted by i, then j. The time is proportional to the number of pairs.

    Args:
        position: (n, 2) m, float32 or float64.
        reach: m, or (n,), of which that of i is used.
        periodic: periodicity of the room; each pair counts once, with its nearest images.
    """
    count, numbers = max(len(position), 1), np.zeros(0, np.int64)
    if len(position):
        spot, size = periodic.wrapped(np.ascontiguousarray(position, np.float64)), np.broadcast_to(cutoff, count)
        seen = Images.of(spot, size, periodic, float(size.max()))
        cells, far = cells_of(seen.position, few=count <= FEW), size[:, None]
        i, j = regions(spot - far, spot + far, spot, size, cells, seen.position, later=True)
        numbers = np.sort((i * count + seen.named(j))[i < seen.named(j)] if periodic else i * count + j)
        numbers = numbers[np.diff(numbers, prepend=-1) > 0]  # two images of a particle may be near another one
    i, j = np.divmod(numbers, count)
    return i.astype(np.int32), j.astype(np.int32)


def near(position: Array, cutoff: float, periodic: Periodicity = NONE, *, together: bool = False) -> Near:
    """All pairs currently closer than `cutoff` m."""
    i, j = list_pairs(position, cutoff * (1 + 1e-9), periodic)  # a margin for rounded images; pairs too far apart are dropped
    return _measured(position, i, j, cutoff, periodic, together, *_buffers_for(len(i)))


def check_range(cutoff: float, periodic: Periodicity) -> float:
    """A checked range, m: in a periodic room a particle must interact with one image of each other one only.

    Raises:
        InputError: the range is not greater than 0, or a periodic room is narrower than twice the range.
    """
    cutoff = checks.number("range", cutoff, above=0.0)
    if 2 * cutoff > periodic.shortest:
        raise InputError(
            f"range is {cutoff:g}; allowed in this periodic room is at most {periodic.shortest / 2:g}, half its period"
        )
    return cutoff


def _buffers_for(count: int) -> tuple[Array, Array, Array]:
    return np.empty((2, count), np.int32), np.empty(count), np.empty((count, 2))


def _measured(position: Array, i: Array, j: Array, cutoff: float, periodic: Periodicity, together: bool, *buffers: Array) -> Near:
    pairs, distance, way = buffers
    found = core.unit("motion", position.dtype).measure_near(position, i, j, cutoff, *periodic.period, together, *buffers)
    return Near(pairs[0, :found], pairs[1, :found], distance[:found], way[:found])


class VerletList:
    """Pairs within a range plus a skin: valid until a particle has moved by half the skin, or particles are re-sorted.

    The resulting pairs do not depend on the list, which only affects the time.
    """

    def __init__(self, cutoff: float) -> None:
        self.cutoff, self.skin = cutoff, SKIN * cutoff
        self._order: Any = None
        self._periodic = NONE
        self._from: Array = np.empty(0)
        self._i: Array = self._from
        self._j: Array = self._from
        self._buffers = _buffers_for(0)
        self.made = 0  # number of times it was made

    def within(self, position: Array, order: Array, periodic: Periodicity, cutoff: float, *, together: bool = False) -> Near:
        """The pairs closer than `cutoff`, at most its own range, in arrays that the next call overwrites, as new ones are slow.

        order: an array that is replaced when particles are re-sorted.
        """
        motion = core.unit("motion", position.dtype)
        known = self._order is order and self._periodic == periodic
        if not known or motion.moved_beyond(position, self._from, 0.5 * self.skin, *periodic.period):
            self._i, self._j = list_pairs(position, self.cutoff + self.skin, periodic)
            self._from, self._order, self._periodic, self._buffers = position.copy(), order, periodic, _buffers_for(len(self._i))
            self.made += 1
        return _measured(position, self._i, self._j, cutoff, periodic, together, *self._buffers)


class VerletLists(list[VerletList]):
    """The Verlet lists of a world; similar ranges share one."""

    def within(self, position: Array, order: Array, periodic: Periodicity, cutoff: float, *, together: bool = False) -> Near:
        """The pairs closer than `cutoff`, as `VerletList.within` returns them.

        Raises:
            InputError: a periodic room is narrower than twice the range.
        """
        cutoff = check_range(cutoff, periodic)
        for known in self:
            if known.cutoff / SHARED <= cutoff <= known.cutoff:
                return known.within(position, order, periodic, cutoff, together=together)
        self[:] = [*self[-7:], VerletList(cutoff)]  # drop old lists of forces whose range changes
        return self[-1].within(position, order, periodic, cutoff, together=together)
