"""Contacts of inelastic circles without friction, eight pairs at a time.

What is computed for each pair, and why, is in kernels.contacts; here it is arranged so that a processor does eight at once:

- The pairs of a strip, which come ordered by colour, are cut into packs of eight that share no particle, so that what one lane
  writes no other one reads. A pack that is not full repeats its last pair: both lanes write the same.
- A pair reads how far its circles have moved since the list was made, and adds what it knows of them from then: their distance,
  the sum of their radii, how they share a push. Such small numbers keep their digits in float32, so that the velocities need not
  be carried along: FED_SMOOTH / PUSHED / h times what a circle has been moved is what it is fed.
- The second pass finds the normals where the first has left them, 0 for pairs that do not touch.
- Nothing is decided for a single pair, only, before the first pack with a pair that was close, whether any of the eight touches.
- The few packs with a pair that overlaps by more than DEEP are noted once a frame. What the sweep leaves of them beyond that is
  treated again, as kernels.refine does.

Everything runs strip by strip as kernels.pairs explains: even strips in parallel, then odd ones.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    ALL,
    LANES,
    larger,
    load,
    pick,
    put,
    smaller,
    spread,
    square_root,
    store,
    take,
    where_zero,
    which_above,
)
from pyverlet.compile.stealing import claim, none_claimed
from pyverlet.ground.constants import CLOSE, DEEP, DEEP_PART, DEEP_SWEEPS, LARGEST_PUSH, PUSHED
from pyverlet.kernels.motion import IN_PILE, arrive, set_out

# Golden angle, rad: coincident centres part in directions spread evenly over the circle.
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))

# Particles one thread takes at a time where each is on its own.
_CHUNK = 1024

# Deep packs that are too few to be worth a meeting of the threads.
_FEW = 64

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
                    angle = _GOLDEN_ANGLE * (lane_i[lane] + lane_j[lane])
                    gap_x[lane] = _ASIDE * np.cos(angle)
                    gap_y[lane] = _ASIDE * np.sin(angle)
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
def share_out(begin, lanes, lane_i, lane_j, radius, inverse_mass, reach, share):
    """reach: r_i + r_j. share: the part of a push that moves i, w_i / (w_i + w_j); j has the rest."""
    for s in range(lanes.shape[0]):
        for k in range(begin[s], begin[s] + lanes[s]):
            i, j = lane_i[k], lane_j[k]
            reach[k] = radius[i] + radius[j]
            share[k] = inverse_mass[i] / (inverse_mass[i] + inverse_mass[j])


@kernel
def project_strip(
    moved, apart, lane_i, lane_j, gap_x, gap_y, reach, share, varied, most, normal_x, normal_y, depths, deep, looks
):  # fmt: skip
    """Returns how many packs with a pair that overlaps by more than DEEP it has noted in `deep`."""
    noted, count = depths.shape[0] > 0, 0
    zero, one, limit = spread(most - most), spread(most / most), spread(moved.dtype.type(DEEP))
    pushed, most = spread(moved.dtype.type(PUSHED)), spread(most)
    for k in range(0, lane_i.shape[0], LANES):
        xi, yi = take(moved, lane_i, k)
        xj, yj = take(moved, lane_j, k)
        dx, dy = load(gap_x, k) + (xj - xi), load(gap_y, k) + (yj - yi)
        r, part = load(reach, k * varied), load(share, k * varied)
        distance = square_root(dx * dx + dy * dy)
        if k < apart and which_above(r, distance) == 0:
            store(normal_x, k, zero)
            store(normal_y, k, zero)
            if noted:
                store(depths, k, zero)
            continue
        depth = smaller(larger(r - distance, zero), most * r)
        dx = where_zero(distance, r, dx)
        distance = where_zero(distance, r, distance)
        per_metre = one / distance
        nx, ny = dx * per_metre, dy * per_metre
        push = pushed * depth
        cx, cy = nx * push, ny * push
        put(moved, lane_i, k, xi - cx * part, yi - cy * part)
        put(moved, lane_j, k, xj + cx * (one - part), yj + cy * (one - part))
        store(normal_x, k, where_zero(depth, zero, nx))
        store(normal_y, k, where_zero(depth, zero, ny))
        if noted:
            store(depths, k, depth)
        elif looks and which_above(depth, limit * r) != 0:
            deep[count] = k
            count += 1
    return count


@kernel
def refine_strip(moved, lane_i, lane_j, gap_x, gap_y, reach, share, varied, deep, count):
    """Part again, there and back, the packs in deep[:count] that still overlap by more than DEEP; returns how many those are.

    Beyond LARGEST_PUSH it is no weight but a mistake, and has been pushed enough.
    """
    real = moved.dtype.type
    zero, one, near, nearest = spread(real(0)), spread(real(1)), spread(real(1 - DEEP)), spread(real(1 - LARGEST_PUSH))
    pushed = spread(real(DEEP_PART * PUSHED))
    for sweep in range(DEEP_SWEEPS):
        left = 0
        for m in range(count):
            k = deep[count - 1 - m if sweep % 2 else m]
            xi, yi = take(moved, lane_i, k)
            xj, yj = take(moved, lane_j, k)
            dx, dy = load(gap_x, k) + (xj - xi), load(gap_y, k) + (yj - yi)
            r, part = load(reach, k * varied), load(share, k * varied)
            distance = square_root(dx * dx + dy * dy)
            excess = where_zero(larger(distance - nearest * r, zero), zero, larger(near * r - distance, zero))
            if which_above(excess, zero) == 0:
                continue
            if sweep == 0:
                deep[left] = k
                left += 1
            push = pushed * excess / larger(distance, nearest * r)
            cx, cy = dx * push, dy * push
            put(moved, lane_i, k, xi - cx * part, yi - cy * part)
            put(moved, lane_j, k, xj + cx * (one - part), yj + cy * (one - part))
        if sweep == 0:
            count = left
    return count


@kernel
def _refine_some(first, stop, parity, moved, begin, lanes, lane_i, lane_j, gap, reach, share, varied, deep, deeps):
    """`refine_strip` for the strips 2 half + parity, half from `first` up to `stop`."""
    for half in range(first, stop):
        s = 2 * half + parity
        if deeps[s] > 0:
            a, b = begin[s], begin[s] + lanes[s]
            pairs = (lane_i[a:b], lane_j[a:b], gap[0, a:b], gap[1, a:b], reach[a * varied :], share[a * varied :], varied)
            deeps[s] = refine_strip(moved, *pairs, deep[a // LANES : b // LANES], deeps[s])


@parallel_kernel
def project(
    position, velocity, origin, moved, cut, begin, lanes, apart, lane_i, lane_j, gap, reach, share, varied, feed, most, normal,
    depths, deep, deeps, fresh, sets_out, arrives, claims,
):  # fmt: skip
    """Move overlapping pairs apart, feed their velocities, and note the normals of those that touch.

    varied: 1; or 0 if reach and share are the same for all and have one pack only. feed: FED / PUSHED / h, 1/s. depths: (lanes,)
    for the overlaps, m, of pairs at their turn, 0 for those that do not touch; or (0,) if nobody asks. deep: (lanes / LANES,)
    where in its strip s each of the deeps[s] packs begins that are treated again; noted anew if fresh[0], which is then 0.
    cut: (2, threads + 1), which half s // 2 of the strips s with s % 2 = 0, and 1, each thread begins with. normal: (2, lanes).
    moved: (n, 2) to work with. sets_out: 1 if it is yet to be set to position - origin. arrives: 1 if what becomes of it is to be
    added to positions and fed to velocities, 0 if others do that. claims: `_claims.Claims`.
    """
    n, looks, listed = position.shape[0], fresh[0] != 0, (lane_i, lane_j, gap, reach, share, varied)
    chunks = (n + _CHUNK - 1) // _CHUNK
    if sets_out != 0:
        for c in prange(chunks):
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            set_out(position[a:b], origin[a:b], moved[a:b])
    for parity in range(2):
        none_claimed(claims)
        for part in prange(claims.shape[0]):
            half = claim(claims, cut[parity], part)
            while half >= 0:
                s = 2 * half + parity
                a, b = begin[s], begin[s] + lanes[s]
                pairs = (lane_i[a:b], lane_j[a:b], gap[0, a:b], gap[1, a:b], reach[a * varied :], share[a * varied :], varied)
                noted = (most, normal[0, a:b], normal[1, a:b], depths[a:b], deep[a // LANES : b // LANES], looks)
                count = project_strip(moved, apart[s], *pairs, *noted)
                if looks:
                    deeps[s] = count
                half = claim(claims, cut[parity], part)
    left = 0
    for s in range(deeps.shape[0]):
        left += deeps[s]
    for parity in range(2):
        if left < _FEW:
            _refine_some(0, cut[parity, -1], parity, moved, begin, lanes, *listed, deep, deeps)
        else:
            for part in prange(cut.shape[1] - 1):
                _refine_some(cut[parity, part], cut[parity, part + 1], parity, moved, begin, lanes, *listed, deep, deeps)
    if arrives != 0:
        for c in prange(chunks):
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            arrive(position[a:b], velocity[a:b], origin[a:b], moved[a:b], feed)
    fresh[0] = 0


@kernel
def still_strip(velocity, apart, lane_i, lane_j, share, varied, one, normal_x, normal_y):
    """What `still` does, of one strip."""
    zero, whole = spread(one - one), spread(one)
    for k in range(0, lane_i.shape[0], LANES):
        nx, ny, part = load(normal_x, k), load(normal_y, k), load(share, k * varied)
        if k < apart and which_above(nx * nx + ny * ny, zero) == 0:
            continue
        xi, yi = take(velocity, lane_i, k)
        xj, yj = take(velocity, lane_j, k)
        speed = (xj - xi) * nx + (yj - yi) * ny
        cx, cy = speed * nx, speed * ny
        put(velocity, lane_i, k, xi + cx * part, yi + cy * part)
        put(velocity, lane_j, k, xj - cx * (whole - part), yj - cy * (whole - part))


@parallel_kernel
def still(velocity, cut, begin, lanes, apart, lane_i, lane_j, share, varied, normal, resting, fresh, marks, claims):
    """Set the normal velocity of touching pairs to 0; if `marks` is 1, do what `mark_touching` does, too."""
    one = velocity.dtype.type(1)
    for parity in range(2):
        none_claimed(claims)
        for part in prange(claims.shape[0]):
            half = claim(claims, cut[parity], part)
            while half >= 0:
                s = 2 * half + parity
                a, b = begin[s], begin[s] + lanes[s]
                pairs, normals = (lane_i[a:b], lane_j[a:b]), (normal[0, a:b], normal[1, a:b])
                still_strip(velocity, apart[s], *pairs, share[a * varied :], varied, one, *normals)
                if marks != 0:
                    mark_strip(resting, *pairs, *normals)
                half = claim(claims, cut[parity], part)
    if marks != 0:
        fresh[0] = 1


@kernel
def mark_strip(flag, lane_i, lane_j, normal_x, normal_y):
    """What `mark_touching` does, of one strip."""
    zero = spread(normal_x.dtype.type(0))
    for k in range(0, lane_i.shape[0], LANES):
        nx, ny = load(normal_x, k), load(normal_y, k)
        touches = which_above(nx * nx + ny * ny, zero)
        for lane in range(LANES):
            bit = np.uint8(((touches >> lane) & 1) * IN_PILE)
            flag[lane_i[k + lane]] |= bit
            flag[lane_j[k + lane]] |= bit


@parallel_kernel
def mark_touching(cut, begin, lanes, lane_i, lane_j, normal, flag, fresh):
    """flag[i] gains IN_PILE for every particle of a touching pair. fresh[0] = 1: `project` notes anew who overlaps deeply."""
    fresh[0] = 1
    for parity in range(2):
        for part in prange(cut.shape[1] - 1):
            for half in range(cut[parity, part], cut[parity, part + 1]):
                a, b = begin[2 * half + parity], begin[2 * half + parity] + lanes[2 * half + parity]
                mark_strip(flag, lane_i[a:b], lane_j[a:b], normal[0, a:b], normal[1, a:b])
