"""Which circles overlap others that are there, or that come with them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.arrays import Array, Floats
from pyverlet.state.cells import FEW, Images, cells_of, regions
from pyverlet.state.seam import Seam
from pyverlet.state.state import State, meet

ROUNDING = 1e-9
"""Of what is touched: a circle that just fits is not refused for the last digit."""

DIGITS = 4
"""Units in the last place of the largest coordinate by which circles may overlap that just touch."""


def overlapping(points: Floats, radius: Floats, position: Floats, size: Floats) -> NDArray[np.int64]:
    """(m, 2) rows (k, i): the circle about points[k] (k, 2) overlaps that about position[i] (n, 2); radii (k,) and (n,), m."""
    if not len(points) or not len(position):
        return np.zeros((0, 2), np.int64)
    reach = radius + float(size.max())
    far = reach[:, None]
    pairs = regions(points - far, points + far, points, reach, cells_of(position, few=len(points) <= FEW), position)
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
    j, i = on_top(position, radius, len(state), state.seam).T
    apart = meet(category[i], mask[i], category[j], mask[j]) & np.isfinite(np.minimum(mass[i], mass[j]))
    return np.column_stack((j[apart] - len(state), i[apart]))


def on_top(position: Array, radius: Array, there: int, seam: Seam) -> NDArray[np.int64]:
    """(m, 2) rows (j, i), sorted: circle j, from number `there` on, overlaps circle i < j. position: (n, 2), radius: (n,), m."""
    size = radius.astype(np.float64)
    first = seam.wrapped(np.ascontiguousarray(position[there:])).astype(np.float64)
    seen = Images.of(position, size, seam, 2 * float(size.max(initial=0.0)))
    places = seen.position.astype(np.float64)
    slack = DIGITS * float(np.finfo(position.dtype).eps) * float(np.abs(places).max(initial=0.0))
    k, image = overlapping(first, size[there:] - slack, places, seen.radius).T
    i, j = seen.named(image), there + k
    return np.unique(np.column_stack((j, i))[i < j], axis=0)


def free_in_order(pairs: NDArray[np.int64], there: int, allowed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(n,) which new particles are put down one after the other: of those allowed none that is on top of any before it.

    pairs: what `on_others` found beside so many that were there.
    """
    free: NDArray[np.bool_] = allowed.copy()
    for k, i in pairs.tolist():
        free[k] &= i >= there and not free[i - there]
    return free
