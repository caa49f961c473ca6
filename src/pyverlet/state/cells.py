"""Particles in square cells, as kernels that answer questions about them take them; in a periodic room with their images."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pyverlet.core import unit
from pyverlet.ground.arrays import Array, Floats, Indices
from pyverlet.state.seam import Seam

FEW = 8
"""Questions up to which looking at every particle costs less than sorting them into cells."""

LISTED = 16
"""Cells that a disc is listed in at most, on average."""

ROUNDED_OFF = 1e-6
"""Part of a cell that discs are listed too far: rays find their cells by other sums."""


SAMPLE, OUTSIDE, SPARE = 1024, 50, 0.1
"""Cells of centres cover what all but one in OUTSIDE of a sample do on each side, and so much of that more."""


class Images(NamedTuple):
    """Centres (m, 2) and radii (m,) in m, and whose image each is."""

    position: Array
    radius: Array
    owner: Indices | None

    @classmethod
    def of(cls, position: Array, radius: Array, seam: Seam, reach: float) -> Images:
        """All particles and, of a periodic room, those images that are within `reach`, m, of it."""
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
        """Particles in place of images; -1 stays."""
        return found if self.owner is None else np.where(found >= 0, self.owner[found], -1)


def cells_of(position: Array, radius: Array | None = None, reach: float = 0.0, *, few: bool) -> tuple[Any, ...]:
    """Cells over all particles, with about one in each, and who is in them, as kernels take them; for few questions a single one.

    Without radii (n,), m, each is in the cell of its centre, else in all that its disc comes within `reach` m of. Centres far
    away from almost all others are in a cell at the rim; cells cover all discs.
    """
    tools, size = unit("tools", position.dtype), np.zeros(0, position.dtype) if radius is None else radius
    margin = reach + float(size.max(initial=0.0))
    x0, y0, x1, y1 = tools.extent(position)
    if not few and radius is None:
        some = np.sort(position[:: 1 + len(position) // SAMPLE].astype(float), axis=0)
        low, high = some[len(some) // OUTSIDE], some[-1 - len(some) // OUTSIDE]
        (x0, y0), (x1, y1) = np.fmax((x0, y0), low - SPARE * (high - low)), np.fmin((x1, y1), high + SPARE * (high - low))
    x0, y0, width, height = x0 - margin, y0 - margin, x1 - x0 + 2 * margin, y1 - y0 + 2 * margin
    if few:
        member = np.arange(len(position), dtype=np.int32)
        if unit("motion", position.dtype).first_non_finite(position) >= 0:
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
    """(k,) regions and (k,) particles, in no order: those in boxes from `low` to `high` (q, 2) and, where `size` (q,) is
    finite, no farther than that from `middle` (q, 2). later: of particles with a higher number than the region's alone.
    """
    found, room, size = 0, 64 + 8 * len(low), np.ascontiguousarray(size)
    query, particle = (np.zeros(0, np.int64) for _ in range(2))
    while room > len(query):
        query, particle = (np.empty(room, np.int64) for _ in range(2))
        found = unit("tools", position.dtype).in_regions(low, high, middle, size, cells, position, query, particle, later)
        room = max(room, found)
    return query[:found], particle[:found]
