"""Candidate pairs in packs of eight that share no particle, so that `kernels.contact` can treat them eight at a time.

- The pairs of a strip, which come ordered by colour, are cut into packs. What one lane of a pack writes no other one reads. A
  pack that is not full repeats its last pair: both lanes write the same.
- Where a pair stood when the list was made is kept: how far its circles have moved since are small numbers, which keep their
  digits in float32. So what circles are fed can be had from how far they have been pushed, and velocities need not be carried.

Everything runs strip by strip as kernels.pairs explains: even strips in parallel, then odd ones.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import ALL, LANES, larger, pick, spread, store, take, which_above
from pyverlet.ground.constants import CLOSE
from pyverlet.kernels.motion import differs

# Golden angle, rad: coincident centres part in directions spread evenly over the circle.
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))

# Pairs that are looked at again for each new pack.
_WAITING = 32

# Of the contact distance: how far apart coincident centres are taken to be, for the direction's sake.
_ASIDE = 1e-6


@kernel
def _choose(pair_i, pair_j, used, number, lane_i, lane_j):
    """Which pair stands in each lane; returns how many lanes there are, also beyond the room.

    Pairs are taken in their order. One that shares a particle with the pack waits for the next: around a large circle many do.
    used[i]: the last pack of particle i, by a number that no other strip gives; this strip's are `number` and up.
    """
    pairs, room, k, lanes = pair_i.shape[0], lane_i.shape[0], 0, 0
    waiting, waits = np.empty(pairs, np.int64), 0
    while k < pairs or waits > 0:
        pack, end, last = number + lanes // LANES, lanes + LANES, 0
        # Those that came last first: the others would have to be moved up.
        first = max(waits - _WAITING, 0)
        left = first
        w = first
        while lanes < end and (w < waits or k < pairs):
            again = w < waits
            p = waiting[w] if again else k
            i, j = pair_i[p], pair_j[p]
            if used[i] != pack and used[j] != pack:
                used[i] = pack
                used[j] = pack
                last = p
                if lanes < room:
                    lane_i[lanes] = i
                    lane_j[lanes] = j
                lanes += 1
            else:
                waiting[left] = p
                left += 1
            if again:
                w += 1
            else:
                k += 1
        while w < waits:  # the pack was full before they came
            waiting[left] = waiting[w]
            left += 1
            w += 1
        waits = left
        for lane in range(lanes, min(end, room)):
            lane_i[lane] = pair_i[last]
            lane_j[lane] = pair_j[last]
        lanes = end
    return lanes


@kernel
def aside(zero, i, j):
    """A hair, m, in a direction of the pair's own."""
    angle = _GOLDEN_ANGLE * (i + j)
    return zero + _ASIDE * np.cos(angle), zero + _ASIDE * np.sin(angle)


@kernel
def _measure(origin, radius, lane_i, lane_j, gap_x, gap_y):
    """From i to j of every lane, m; of coincident ones a hair in a direction of their own.

    Returns in how many, at first, no pair is close.
    """
    zero, factor = spread(origin.dtype.type(0)), spread(origin.dtype.type(CLOSE))
    apart = lane_i.shape[0]
    for k in range(0, lane_i.shape[0], LANES):
        xi, yi = take(origin, lane_i, k)
        xj, yj = take(origin, lane_j, k)
        dx, dy = xj - xi, yj - yi
        store(gap_x, k, dx)
        store(gap_y, k, dy)
        soon = factor * (pick(radius, lane_i, k) + pick(radius, lane_j, k))
        if apart > k and which_above(soon * soon, dx * dx + dy * dy) != 0:
            apart = k
        if which_above(larger(dx * dx, dy * dy), zero) != ALL:
            for lane in range(k, k + LANES):
                if gap_x[lane] == 0 and gap_y[lane] == 0:
                    gap_x[lane], gap_y[lane] = aside(gap_x[lane], lane_i[lane], lane_j[lane])
    return apart


@parallel_kernel
def pack(origin, radius, first, count, pair_i, pair_j, used, begin, lanes, apart, lane_i, lane_j, gap):
    """Pack the pairs of every strip s into the lanes from begin[s] up to begin[s + 1] at most; lanes[s]: how many they take.

    A strip that needs more room than it has reports how much, and its packs are not complete: the caller makes room. apart[s]:
    those before the first pack with a pair that is close. origin: (n, 2) positions the list was made from. used: (n,), -1.
    gap: (2, lanes), m.
    """
    for parity in range(2):
        for half in prange((first.shape[0] + 1 - parity) // 2):
            s = 2 * half + parity
            a, b = first[s], first[s] + count[s]
            low, high = begin[s], begin[s + 1]
            lanes[s] = _choose(pair_i[a:b], pair_j[a:b], used, low, lane_i[low:high], lane_j[low:high])
            if lanes[s] <= high - low:
                high = low + lanes[s]
                apart[s] = _measure(origin, radius, lane_i[low:high], lane_j[low:high], gap[0, low:high], gap[1, low:high])


@kernel
def vary(inverse_mass, size, radius, restitution, friction):
    """(varied, sized, mixed) of `tables.Law`: what is not the same for all circles."""
    varied, sized = differs(inverse_mass[:1], inverse_mass), differs(size[:1], size)
    mixed = differs(radius[:1], radius) or differs(restitution[:1], restitution) or differs(friction[:1], friction)
    return int(varied), int(sized), int(mixed)


@kernel
def add_radii(begin, lanes, lane_i, lane_j, radius, reach):
    """reach: r_i + r_j."""
    for s in range(lanes.shape[0]):
        for k in range(begin[s], begin[s] + lanes[s]):
            reach[k] = radius[lane_i[k]] + radius[lane_j[k]]


@kernel
def compose(begin, lanes, lane_i, lane_j, radius, restitution, friction, e, mu, made_of):
    """What each pair is made of, the rows of `tables.Pairs.made_of`.

    Of two circles the larger restitution counts, and the geometric mean of the frictions; e and mu, those of all, stand for ones
    that are negative: not given.
    """
    zero = e - e
    two = made_of.dtype.type(2)
    for s in range(lanes.shape[0]):
        for k in range(begin[s], begin[s] + lanes[s]):
            i, j = lane_i[k], lane_j[k]
            ei, ej = restitution[i] if restitution[i] >= zero else e, restitution[j] if restitution[j] >= zero else e
            given = friction[i] >= zero or friction[j] >= zero
            mui, muj = friction[i] if friction[i] >= zero else mu, friction[j] if friction[j] >= zero else mu
            made_of[0, k] = max(ei, ej)
            made_of[1, k] = np.sqrt(mui * muj) if given else mu
            made_of[2, k], made_of[3, k] = radius[i], radius[j]
            made_of[4, k], made_of[5, k] = two / radius[i], two / radius[j]


@kernel
def _share_strip(begin, end, lane_i, lane_j, inverse_mass, share, reduced):
    one = spread(share.dtype.type(1))
    for k in range(begin, end, LANES):
        wi, wj = pick(inverse_mass, lane_i, k), pick(inverse_mass, lane_j, k)
        store(share, k, wi / (wi + wj))
        if reduced.shape[0] > 0:
            store(reduced, k, one / (wi + wj))


@parallel_kernel
def share_out(begin, lanes, lane_i, lane_j, cut, inverse_mass, share, reduced):
    """share: the part of a push that moves i, w_i / (w_i + w_j); j has the rest. reduced: 1 / (w_i + w_j), kg, if it has room.

    cut: as for `kernels.sweeps.push`.
    """
    for parity in range(2):
        for part in prange(cut.shape[1] - 1):
            for half in range(cut[parity, part], cut[parity, part + 1]):
                a = begin[2 * half + parity]
                _share_strip(a, a + lanes[2 * half + parity], lane_i, lane_j, inverse_mass, share, reduced)
