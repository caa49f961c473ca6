"""The slips of contacts, what friction remembers, taken from one list of pairs to the next by way of the particles."""

from __future__ import annotations

from pyverlet.compile.jit import kernel
from pyverlet.kernels.tables import NEW


@kernel
def _again(k, begin, pair_i, pair_j):
    """Whether pair k is the one before once more: packs repeat their last pair to be full."""
    return k > begin and pair_i[k] == pair_i[k - 1] and pair_j[k] == pair_j[k - 1]


@kernel
def take_slips(first, count, pair_i, pair_j, slip, owner, begin, low, high, value):
    """List the slips that are not NEW, by the lower of their two particles; owner (slots,): who they are, -1 if no more.

    begin: (particles + 1,) scratch. Returns how many there are.
    """
    begin[:] = 0
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            p, q = owner[pair_i[k]], owner[pair_j[k]]
            if slip[k] < NEW and min(p, q) >= 0 and not _again(k, first[s], pair_i, pair_j):
                begin[min(p, q) + 1] += 1
    for p in range(begin.shape[0] - 1):
        begin[p + 1] += begin[p]
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            p, q = owner[pair_i[k]], owner[pair_j[k]]
            if slip[k] < NEW and min(p, q) >= 0 and not _again(k, first[s], pair_i, pair_j):
                place = begin[min(p, q)]
                begin[min(p, q)] += 1
                low[place], high[place], value[place] = min(p, q), max(p, q), slip[k]
    return begin[-1]


@kernel
def give_slips(first, count, pair_i, pair_j, slip, owner, begin, high, value):
    """Find them again for the pairs of another list; those of the lower particle p are begin[p] to begin[p + 1]."""
    for s in range(first.shape[0]):
        for k in range(first[s], first[s] + count[s]):
            p, q = owner[pair_i[k]], owner[pair_j[k]]
            slip[k] = NEW
            for place in range(begin[min(p, q)], begin[min(p, q) + 1]):
                if high[place] == max(p, q):
                    slip[k] = value[place]
