"""Periodic rooms: who leaves on one side comes in on the other.

A period is (x, y), m; 0 in a direction that has none. Within a frame positions run on beyond the room, so that ways stay ways; a
difference of two of them stands for the image of it that is nearest to 0.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import LANES, nearest_whole, spread, widen
from pyverlet.compile.rounding import lanes_like
from pyverlet.ground.constants import CLOSE
from pyverlet.kernels.packs import aside

_CHUNK = 2048


@kernel
def nearest(difference, period):
    """The image of a difference that is nearest to 0; the difference itself where the period is 0."""
    return difference - period * np.rint(difference / period) if period > 0 else difference


@kernel
def nearest_lanes(difference, period):
    """`nearest`, lane by lane; period: one number for all."""
    if not period > 0:
        return difference
    wide = spread(period)
    return difference - wide * nearest_whole(difference / wide)


@kernel
def apart_lanes(a, b, period, like):
    """From a to the nearest image of b, lane by lane, in the dtype of `like`; by float64, for no float32 holds a period."""
    if not period > 0:
        return b - a
    return lanes_like(nearest_lanes(widen(b) - widen(a), period), like)


@kernel
def image_near(x, reference, period):
    """The image of x that is nearest to `reference`; x itself where the period is 0."""
    return x + period * np.rint((reference - x) / period) if period > 0 else x


@kernel
def _inside(x, low, period):
    """The image of x from `low` on, and below low + period."""
    zero = low - low
    if not period > zero or (low <= x and x < low + period):
        return x
    x -= period * np.floor((x - low) / period)
    if x >= low + period:  # rounding
        x -= period
    return low if x < low else x


@parallel_kernel
def wrap(position, low_x, low_y, period_x, period_y, out):
    """out (n, 2): the images of these positions inside the room; `out` may be `position`."""
    for c in prange((position.shape[0] + _CHUNK - 1) // _CHUNK):
        for i in range(c * _CHUNK, min((c + 1) * _CHUNK, position.shape[0])):
            out[i, 0] = _inside(position[i, 0], low_x, period_x)
            out[i, 1] = _inside(position[i, 1], low_y, period_y)


@parallel_kernel
def follow(position, reference, period_x, period_y):
    """Positions become the images nearest to `reference` (n, 2)."""
    for c in prange((position.shape[0] + _CHUNK - 1) // _CHUNK):
        for i in range(c * _CHUNK, min((c + 1) * _CHUNK, position.shape[0])):
            position[i, 0] = image_near(position[i, 0], reference[i, 0], period_x)
            position[i, 1] = image_near(position[i, 1], reference[i, 1], period_y)


@kernel
def ghosts(position, radius, low_x, low_y, period_x, period_y, reach, to_position, to_radius, owner):
    """Copies of circles near the seam, a period further: of two that are near each other across it, one has a copy there.

    Half of the neighbouring rooms will do: those to the right, above, above to the left and to the right. position: (n, 2),
    inside the room. reach: m, how near rims count, and the largest radius. owner[k]: whose copy it is. Returns how many copies
    there are, also beyond the room for them.
    """
    found, room = 0, owner.shape[0]
    for i in range(position.shape[0]):
        x, y = position[i, 0], position[i, 1]
        near = radius[i] + reach
        right = period_x > 0 and x - low_x < near
        left = period_x > 0 and low_x + period_x - x < near
        above = period_y > 0 and y - low_y < near
        for copy in range(4):
            if (
                (copy == 0 and right)
                or (copy == 1 and above)
                or (copy == 2 and above and right)
                or (copy == 3 and above and left)
            ):
                if found < room:
                    to_position[found, 0] = x + period_x if copy == 0 or copy == 2 else (x - period_x if copy == 3 else x)
                    to_position[found, 1] = y + period_y if copy > 0 else y
                    to_radius[found] = radius[i]
                    owner[found] = i
                found += 1
    return found


@parallel_kernel
def bring_home(first, count, pair_i, pair_j, circles, owner):
    """Pairs of a list become those of the circles themselves; two copies are no pair, for their originals are one.

    circles: how many there are; from there on the numbers are those of copies, of `owner`.
    """
    for s in prange(first.shape[0]):
        kept = first[s]
        for k in range(first[s], first[s] + count[s]):
            i, j = np.int64(pair_i[k]), np.int64(pair_j[k])
            if i < circles or j < circles:
                pair_i[kept] = i if i < circles else owner[i - circles]
                pair_j[kept] = j if j < circles else owner[j - circles]
                kept += 1
        count[s] = kept - first[s]


@parallel_kernel
def close_gaps(begin, lanes, lane_i, lane_j, radius, period_x, period_y, gap, apart):
    """The gaps of packed pairs, (2, lanes) m, become those of nearest images; `apart` is found anew. See `packs.pack`."""
    for s in prange(lanes.shape[0]):
        a, b = begin[s], begin[s] + lanes[s]
        apart[s] = lanes[s]
        for k in range(a, b):
            i, j = lane_i[k], lane_j[k]
            dx, dy = nearest(gap[0, k], period_x), nearest(gap[1, k], period_y)
            if dx == 0 and dy == 0:
                dx, dy = aside(gap.dtype.type(0), i, j)
            gap[0, k], gap[1, k] = dx, dy
            soon = gap.dtype.type(CLOSE) * (radius[i] + radius[j])
            if dx * dx + dy * dy < soon * soon:
                apart[s] = min(apart[s], (k - a) // LANES * LANES)
