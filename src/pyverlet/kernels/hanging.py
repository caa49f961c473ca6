"""Who hangs together by contacts, kept from substep to substep: of a heap's contacts hardly any comes or goes in one.

One that has come joins two clusters, or none. Of one that has gone the question is whether its two circles still hang together by
others. They mostly do, by way of a neighbour, and that is soon found; or one of them is left with nobody or a few, who become a
cluster of their own. Who was held together by those alone is asked when others of their contacts have gone in the same substep:
whether these others' circles hang together with the one that the few have left first. Where it takes longer to find out, all are
joined anew. One thread: there is little to do.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.bits import count_bits, lowest_bit, which_are
from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import ALL, LANES
from pyverlet.kernels.clusters import join

AROUND = 128
"""Circles looked at around one that has lost a contact, at most."""

# And at first: who is left alone is found out sooner from its own side.
_NEXT = 16

# One in so many circles may have lost a contact; if more have, all are joined anew.
_MANY = 64


@kernel
def list_lanes(begin, lanes, lane_i, lane_j, first, where):
    """where[first[i] : first[i + 1]]: the lanes in which circle i is."""
    for i in range(first.shape[0]):
        first[i] = 0
    for s in range(lanes.shape[0]):
        for k in range(begin[s], begin[s] + lanes[s]):
            first[lane_i[k]] += 1
            first[lane_j[k]] += 1
    total = 0
    for i in range(first.shape[0]):
        total += first[i]
        first[i] = total
    for s in range(lanes.shape[0]):
        for k in range(begin[s], begin[s] + lanes[s]):
            for i in (lane_i[k], lane_j[k]):
                first[i] -= 1
                where[first[i]] = k


@kernel
def _around(i, j, most, pairs, hanging):
    """How many circles hang together with i: they are listed in `found`. 0 if j is one of them, -1 if more than `most`."""
    first, where, touch, found, seen = hanging.first, hanging.where, hanging.touch, hanging.found, hanging.seen
    hanging.sets[1] += 1
    turn, count, k = hanging.sets[1], 1, 0
    found[0] = i
    seen[i] = turn
    while k < count:
        at = found[k]
        k += 1
        for n in range(first[at], first[at + 1]):
            lane = where[n]
            if (touch[lane // LANES] >> (lane % LANES)) & 1:
                other = np.int64(pairs.lane_i[lane]) + np.int64(pairs.lane_j[lane]) - at
                if other == j:
                    return 0
                if seen[other] != turn:
                    if count == most:
                        return -1
                    found[count] = other
                    seen[other] = turn
                    count += 1
    return count


@kernel
def _take_out(count, stays, hanging):
    """Those in `found` become a cluster of their own, and leave `stays`. False: without them it would be without its root."""
    root, found, lowest = hanging.root, hanging.found, hanging.found[0]
    for k in range(count):
        if root[found[k]] == found[k]:
            return False
        lowest = min(lowest, found[k])
    for k in range(count):
        root[found[k]] = lowest
    hanging.left[lowest] = stays
    hanging.heads[hanging.sets[0]] = lowest
    hanging.sets[0] += 1
    return True


@kernel
def _stayed(i, hanging):
    """Circle i, or, if it has been taken out in this substep, whom it has left, as far as that has not been taken out since."""
    while hanging.left[hanging.root[i]] >= 0:
        i = np.int64(hanging.left[hanging.root[i]])
    return i


@kernel
def _part(i, j, pairs, hanging):
    """The pair i, j no longer touches. False: it is not known what follows."""
    i, j = _stayed(i, hanging), _stayed(j, hanging)
    if i == j:
        return True
    if hanging.root[i] != hanging.root[j]:
        return False
    for most in (_NEXT, AROUND):
        count, stays = _around(i, j, most, pairs, hanging), j
        if count < 0:
            count, stays = _around(j, i, most, pairs, hanging), i
        if count >= 0:
            return count == 0 or _take_out(count, stays, hanging)
    return False


@kernel
def _part_each(pairs, hanging):
    """`_part_all`, one after the other; whom clusters have left is remembered."""
    changed, changes, begin, touch, lost = hanging.changed, hanging.changes, pairs.begin, hanging.touch, 0
    for s in range(changes.shape[0]):
        for m in range(begin[s] // LANES, begin[s] // LANES + changes[s]):
            lost += count_bits(changed[m] & ALL & ~np.int64(touch[(changed[m] >> LANES) // LANES]))
    if hanging.sets[0] < 0 or lost * _MANY > hanging.root.shape[0]:
        return False
    for s in range(changes.shape[0]):
        for m in range(begin[s] // LANES, begin[s] // LANES + changes[s]):
            k = changed[m] >> LANES
            bits = changed[m] & ALL & ~np.int64(touch[k // LANES])
            while bits != 0:
                lane = k + lowest_bit(bits)
                bits &= bits - 1
                if not _part(np.int64(pairs.lane_i[lane]), np.int64(pairs.lane_j[lane]), pairs, hanging):
                    return False
    return True


@kernel
def _part_all(pairs, hanging):
    """Pairs that no longer touch. False: all are to be joined anew."""
    before = hanging.sets[0]
    known = _part_each(pairs, hanging)
    for k in range(max(before, 0), hanging.sets[0]):
        hanging.left[hanging.heads[k]] = -1
    return known


@kernel
def _join_pack(k, bits, pairs, root):
    """Those pairs of eight; whether any were of two clusters."""
    joined = False
    while bits != 0:
        lane = k + lowest_bit(bits)
        bits &= bits - 1
        joined |= join(root, pairs.lane_i[lane], pairs.lane_j[lane])
    return joined


@kernel
def _settle(root, heads):
    """`clusters.settle`, and who is its own root; returns how many are."""
    count = 0
    for k in range(0, root.shape[0], LANES):
        one = np.int64(root[k])
        if k + LANES <= root.shape[0] and root[one] == one and one < k and which_are(root, k, one) == ALL:
            continue  # in a heap nearly always
        for i in range(k, min(k + LANES, root.shape[0])):
            root[i] = root[root[i]]
            heads[count] = i
            count += root[i] == i
    return count


@kernel
def join_links(hanging, slot, assembly):
    """After `follow`, group and chiefs: who hangs together by contacts or by links.

    slot: (k,) of the linked; assembly: (k,) for each the place in there of the lowest of those that links join it to.
    """
    root, group, chiefs, count = hanging.root, hanging.group, hanging.chiefs, 0
    for i in range(root.shape[0]):
        group[i] = root[i]
    for k in range(slot.shape[0]):
        join(group, np.int64(slot[k]), np.int64(slot[assembly[k]]))
    for i in range(root.shape[0]):
        group[i] = group[group[i]]
        chiefs[count] = i
        count += group[i] == i
    hanging.sets[2] = count


@kernel
def follow(pairs, hanging):
    """Bring root and heads up to date after `kernels.loans.share`."""
    root, touch, begin, joined = hanging.root, hanging.touch, pairs.begin, False
    if _part_all(pairs, hanging):
        for s in range(hanging.changes.shape[0]):
            for m in range(begin[s] // LANES, begin[s] // LANES + hanging.changes[s]):
                k = hanging.changed[m] >> LANES
                joined |= _join_pack(k, hanging.changed[m] & np.int64(touch[k // LANES]), pairs, root)
    else:
        joined = True
        for i in range(root.shape[0]):
            root[i] = i
        for s in range(pairs.lanes.shape[0]):
            for k in range(begin[s], begin[s] + pairs.lanes[s], LANES):
                _join_pack(k, np.int64(touch[k // LANES]), pairs, root)
    if joined:
        hanging.sets[0] = _settle(root, hanging.heads)
