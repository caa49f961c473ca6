"""Which circles overlap others that are there, or that come with them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.state.state import State
from pyverlet.world.images import Images

Array = NDArray[Any]
Floats = NDArray[np.float64]

ROUNDING = 1e-9
"""Of what is touched: a circle that just fits is not refused for the last digit."""

DIGITS = 4
"""Units in the last place of the largest coordinate by which circles may overlap that just touch."""


def overlapping(points: Floats, radius: Floats, position: Floats, size: Floats) -> NDArray[np.int64]:
    """(m, 2) rows (k, i): the circle about points[k] (k, 2) overlaps that about position[i] (n, 2); radii (k,) and (n,), m."""
    if not len(points) or not len(position):
        return np.zeros((0, 2), np.int64)
    reach = radius + float(size.max())
    (x0, y0), (x1, y1) = position.min(axis=0), position.max(axis=0)
    cell = max(2.0 * float(size.max()), (x1 - x0) / 2_000, (y1 - y0) / 2_000) or 1.0
    columns, rows = int((x1 - x0) / cell) + 1, int((y1 - y0) / cell) + 1
    number, start = np.empty(len(position), np.int32), np.empty(columns * rows + 2, np.int64)
    order, tools = np.empty(len(position), np.int64), unit("tools", np.float64)
    tools.sort_into_cells(position, x0, y0, 1 / cell, columns, rows, number, start, order)
    cells, room, found = (x0, y0, cell, columns, rows, start, order), 8 * len(points), np.inf
    far = reach[:, None]
    while found > room:
        room = room if found == np.inf else int(found)
        query, particle = np.empty(room, np.int64), np.empty(room, np.int64)
        found = tools.in_regions(points - far, points + far, points, reach, cells, position, query, particle)
    pairs = np.column_stack((query[: int(found)], particle[: int(found)]))
    between = np.hypot(*(points[pairs[:, 0]] - position[pairs[:, 1]]).T)
    return np.asarray(pairs[between < (radius[pairs[:, 0]] + size[pairs[:, 1]]) * (1 - ROUNDING)])


def on_others(state: State, new: Mapping[str, Array]) -> NDArray[np.int64]:
    """(m, 2) rows (k, i), sorted: new particle k overlaps particle i and would collide with it.

    i counts on behind those of `state`, to new particles before k. Two that are pinned are left alone.

    Args:
        state: those that are there.
        new: the arrays of others by name, as for `State.append`.
    """
    position, radius, mass, category, mask = (
        np.concatenate((getattr(state, name), new[name])) for name in ("position", "radius", "mass", "category", "mask")
    )
    count, size = len(state), radius.astype(np.float64)
    first = state.seam.wrapped(np.ascontiguousarray(position[count:])).astype(np.float64)
    seen = Images.of(position, size, state.seam, 2 * float(size.max(initial=0.0)))
    there = seen.position.astype(np.float64)
    slack = DIGITS * float(np.finfo(position.dtype).eps) * float(np.abs(there).max(initial=0.0))
    k, image = overlapping(first, size[count:] - slack, there, seen.radius).T
    i, j = seen.named(image), count + k
    meet = (i < j) & (category[i] & mask[j] != 0) & (category[j] & mask[i] != 0) & np.isfinite(np.minimum(mass[i], mass[j]))
    return np.unique(np.column_stack((k[meet], i[meet])), axis=0)


def free_in_order(pairs: NDArray[np.int64], there: int, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) which new particles are put down one after the other: of those allowed none that is on top of any before it.

    pairs: what `on_others` found beside so many that were there.
    """
    free: NDArray[np.bool_] = allowed.copy()
    for k, i in pairs.tolist():
        free[k] &= i >= there and not free[i - there]
    return free
