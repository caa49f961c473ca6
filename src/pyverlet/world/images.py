"""Particles as questions see them: in a periodic room each has an image in every room beside it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.arrays import Indices
from pyverlet.state.seam import Seam


class Images(NamedTuple):
    """Centres (m, 2) and radii (m,) in m, and whose image each is."""

    position: NDArray[Any]
    radius: NDArray[Any]
    owner: Indices | None

    @classmethod
    def of(cls, position: NDArray[Any], radius: NDArray[Any], seam: Seam, reach: float) -> Images:
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
