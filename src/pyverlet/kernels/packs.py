"""Contacts of inelastic circles without friction, eight pairs at a time.

What is computed for each pair, and why, is in kernels.contacts; here it is arranged so that a processor does eight at once:

- The pairs of a strip are cut into packs of eight that share no particle (greedy colouring), so that what one lane writes no
  other one reads. A pack that is not full repeats its last pair: both lanes write the same.
- A pair reads how far its circles have moved since the list was made, and adds what it knows of them from then: their distance,
  the sum of their radii, how they share a push. Such small numbers keep their digits in float32, so that the velocities need not
  be carried along: FED / PUSHED / h times what a circle has been moved is what it is fed.
- The second pass finds the normals where the first has left them, 0 for pairs that do not touch, and has nothing to decide.

Everything runs strip by strip as kernels.grid explains: even strips in parallel, then odd ones.
"""

from __future__ import annotations

import numpy as np

from pyverlet._jit import kernel, parallel_kernel, prange
from pyverlet._lanes import LANES, larger, load, put, smaller, spread, square_root, store, take, where_zero
from pyverlet.constants import PUSHED

# Golden angle, rad: coincident centres part in directions spread evenly over the circle.
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))

# Of the contact distance: how far apart coincident centres are taken to be, for the direction's sake.
_ASIDE = 1e-6

# Bits in a set of colours.
_COLOURS = 64


@kernel
def _colour_strip(pair_i, pair_j, colour):
    """Give every pair the first colour that none of its two particles has yet; returns how many lanes their packs need.

    Particles with more pairs than there are bits take their colours in rounds of 64.
    """
    low, high = np.int64(pair_i[0]), np.int64(pair_i[0])
    for k in range(pair_i.shape[0]):
        low = min(low, min(np.int64(pair_i[k]), np.int64(pair_j[k])))
        high = max(high, max(np.int64(pair_i[k]), np.int64(pair_j[k])))
    colour[:] = -1
    left, first, lanes = pair_i.shape[0], 0, 0
    while left > 0:
        taken = np.zeros(high - low + 1, np.uint64)
        size = np.zeros(_COLOURS, np.int64)
        left = 0
        for k in range(pair_i.shape[0]):
            if colour[k] < 0:
                i, j = pair_i[k] - low, pair_j[k] - low
                free = ~(taken[i] | taken[j])
                if free == 0:
                    left += 1
                    continue
                c = 0
                while free & np.uint64(1) == 0:
                    free >>= np.uint64(1)
                    c += 1
                taken[i] |= np.uint64(1) << np.uint64(c)
                taken[j] |= np.uint64(1) << np.uint64(c)
                colour[k] = first + c
                size[c] += 1
        for c in range(_COLOURS):
            lanes += (size[c] + LANES - 1) // LANES * LANES
        first += _COLOURS
    return lanes


@parallel_kernel
def colour_pairs(first, count, pair_i, pair_j, colour, lanes):
    """Colour the pairs of every strip; lanes[s]: room its packs need."""
    for s in prange(first.shape[0]):
        a, b = first[s], first[s] + count[s]
        lanes[s] = _colour_strip(pair_i[a:b], pair_j[a:b], colour[a:b]) if a < b else 0


@kernel
def _pack_strip(pair_i, pair_j, colour, lane_i, lane_j):
    """Write the pairs into packs of one colour each."""
    size = np.zeros(colour.max() + 2, np.int64)
    for k in range(colour.shape[0]):
        size[colour[k] + 1] += 1
    begin = np.zeros_like(size)  # of each colour's packs
    for c in range(1, begin.shape[0]):
        begin[c] = begin[c - 1] + (size[c] + LANES - 1) // LANES * LANES
    following = begin.copy()
    for k in range(colour.shape[0]):
        at = following[colour[k]]
        following[colour[k]] += 1
        lane_i[at] = pair_i[k]
        lane_j[at] = pair_j[k]
    for c in range(begin.shape[0] - 1):
        for at in range(following[c], begin[c + 1]):
            lane_i[at] = lane_i[at - 1]
            lane_j[at] = lane_j[at - 1]


@kernel
def _measure_strip(origin, lane_i, lane_j, gap):
    zero = origin.dtype.type(0)
    for k in range(lane_i.shape[0]):
        i, j = lane_i[k], lane_j[k]
        gap[0, k] = origin[j, 0] - origin[i, 0]
        gap[1, k] = origin[j, 1] - origin[i, 1]
        if gap[0, k] == zero and gap[1, k] == zero:
            angle = _GOLDEN_ANGLE * (i + j)
            gap[0, k] = _ASIDE * np.cos(angle)
            gap[1, k] = _ASIDE * np.sin(angle)


@parallel_kernel
def fill(first, count, pair_i, pair_j, colour, begin, origin, lane_i, lane_j, gap):
    """Make the packs of strip s from lane begin[s] to begin[s + 1].

    origin: (n, 2) positions at which the list was made. gap: (2, lanes), from i to j, m.
    """
    for s in prange(first.shape[0]):
        a, b = first[s], first[s] + count[s]
        low, high = begin[s], begin[s + 1]
        if a < b:
            _pack_strip(pair_i[a:b], pair_j[a:b], colour[a:b], lane_i[low:high], lane_j[low:high])
            _measure_strip(origin, lane_i[low:high], lane_j[low:high], gap[:, low:high])


@parallel_kernel
def share_out(lane_i, lane_j, radius, inverse_mass, reach, share):
    """reach: r_i + r_j. share: the part of a push that moves i, w_i / (w_i + w_j); j has the rest. Both may be short."""
    for k in prange(reach.shape[0]):
        i, j = lane_i[k], lane_j[k]
        reach[k] = radius[i] + radius[j]
        share[k] = inverse_mass[i] / (inverse_mass[i] + inverse_mass[j])


@kernel
def _project_strip(moved, lane_i, lane_j, gap_x, gap_y, reach, share, varied, most, normal_x, normal_y):
    zero, one = spread(most - most), spread(most / most)
    pushed, most = spread(moved.dtype.type(PUSHED)), spread(most)
    for k in range(0, lane_i.shape[0], LANES):
        xi, yi = take(moved, lane_i, k)
        xj, yj = take(moved, lane_j, k)
        dx, dy = load(gap_x, k) + (xj - xi), load(gap_y, k) + (yj - yi)
        r, part = load(reach, k * varied), load(share, k * varied)
        distance = square_root(dx * dx + dy * dy)
        depth = smaller(larger(r - distance, zero), most * r)
        dx = where_zero(distance, r, dx)
        distance = where_zero(distance, r, distance)
        nx, ny = dx / distance, dy / distance
        push = pushed * depth
        cx, cy = nx * push, ny * push
        put(moved, lane_i, k, xi - cx * part, yi - cy * part)
        put(moved, lane_j, k, xj + cx * (one - part), yj + cy * (one - part))
        store(normal_x, k, where_zero(depth, zero, nx))
        store(normal_y, k, where_zero(depth, zero, ny))


@parallel_kernel
def project(position, velocity, origin, moved, begin, lane_i, lane_j, gap, reach, share, varied, feed, most, normal):
    """Move overlapping pairs apart, feed their velocities, and note the normals of those that touch.

    varied: 1; or 0 if reach and share are the same for all and have one pack only. feed: FED / PUSHED / h, 1/s.
    moved: (n, 2) to work with. normal: (2, lanes).
    """
    for i in prange(position.shape[0]):
        moved[i, 0] = position[i, 0] - origin[i, 0]
        moved[i, 1] = position[i, 1] - origin[i, 1]
    for parity in range(2):
        for half in prange((begin.shape[0] - parity) // 2):
            s = 2 * half + parity
            a, b = begin[s], begin[s + 1]
            _project_strip(
                moved, lane_i[a:b], lane_j[a:b], gap[0, a:b], gap[1, a:b], reach[a * varied :], share[a * varied :], varied, most,
                normal[0, a:b], normal[1, a:b],
            )  # fmt: skip
    for i in prange(position.shape[0]):
        for axis in range(2):
            by = moved[i, axis] - (position[i, axis] - origin[i, axis])
            position[i, axis] += by
            velocity[i, axis] += feed * by


@kernel
def _still_strip(velocity, lane_i, lane_j, share, varied, one, normal_x, normal_y):
    whole = spread(one)
    for k in range(0, lane_i.shape[0], LANES):
        xi, yi = take(velocity, lane_i, k)
        xj, yj = take(velocity, lane_j, k)
        nx, ny, part = load(normal_x, k), load(normal_y, k), load(share, k * varied)
        speed = (xj - xi) * nx + (yj - yi) * ny
        cx, cy = speed * nx, speed * ny
        put(velocity, lane_i, k, xi + cx * part, yi + cy * part)
        put(velocity, lane_j, k, xj - cx * (whole - part), yj - cy * (whole - part))


@parallel_kernel
def still(velocity, begin, lane_i, lane_j, share, varied, normal):
    """Set the normal velocity of touching pairs to 0."""
    one = velocity.dtype.type(1)
    for parity in range(2):
        for half in prange((begin.shape[0] - parity) // 2):
            s = 2 * half + parity
            a, b = begin[s], begin[s + 1]
            _still_strip(velocity, lane_i[a:b], lane_j[a:b], share[a * varied :], varied, one, normal[0, a:b], normal[1, a:b])


@kernel
def mark_touching(lane_i, lane_j, normal, flag):
    """flag[i] = 1 for every particle of a touching pair."""
    for k in range(lane_i.shape[0]):
        touches = (normal[0, k] != 0) | (normal[1, k] != 0)
        flag[lane_i[k]] |= touches
        flag[lane_j[k]] |= touches
