"""Where there is room for another circle."""

from __future__ import annotations

from pyverlet.compile.jit import kernel


@kernel
def free_places(place, size, position, radius, wanted, taken):
    """Mark in `taken` (k,) the first `wanted` of the places (k, 2) at which a circle of this size (k,) overlaps nobody.

    Nobody: neither the circles that are there, `position` (n, 2) and `radius` (n,), nor one marked before. Returns how many.
    """
    found = 0
    for i in range(place.shape[0]):
        if found == wanted:
            break
        free = True
        for j in range(radius.shape[0]):
            dx, dy, reach = position[j, 0] - place[i, 0], position[j, 1] - place[i, 1], radius[j] + size[i]
            free = free and dx * dx + dy * dy >= reach * reach
        for j in range(i):
            dx, dy, reach = place[j, 0] - place[i, 0], place[j, 1] - place[i, 1], size[j] + size[i]
            free = free and not (taken[j] and dx * dx + dy * dy < reach * reach)
        if free:
            taken[i] = True
            found += 1
    return found
