"""Where there is room for another circle."""

from __future__ import annotations

from pyverlet.compile.jit import kernel
from pyverlet.kernels.seam import nearest


@kernel
def free_places(place, size, position, radius, period_x, period_y, wanted, taken):
    """Mark in `taken` (k,) the first `wanted` of the places (k, 2) at which a circle of this size (k,) overlaps nobody.

    Nobody: neither the circles that are there, `position` (n, 2) and `radius` (n,), nor one marked before. Returns how many.
    """
    found = 0
    for i in range(place.shape[0]):
        if found == wanted:
            break
        free = True
        for j in range(radius.shape[0]):
            dx = nearest(position[j, 0] - place[i, 0], period_x)
            dy = nearest(position[j, 1] - place[i, 1], period_y)
            reach = radius[j] + size[i]
            free = free and dx * dx + dy * dy >= reach * reach
        for j in range(i):
            dx = nearest(place[j, 0] - place[i, 0], period_x)
            dy = nearest(place[j, 1] - place[i, 1], period_y)
            reach = size[j] + size[i]
            free = free and not (taken[j] and dx * dx + dy * dy < reach * reach)
        if free:
            taken[i] = True
            found += 1
    return found
