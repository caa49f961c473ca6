"""Runs and colours of links: what is solved together, and what beside each other. Also: which pairs are no contacts."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel


@kernel
def find_runs(first, particle, intact, particles, run_of):
    """Number the runs: run_of[r]. Rows of two particles continue the row before if they begin where it ended.

    Rows given the other way round are turned. A run never comes back to a particle it has met.
    """
    seen = np.full(particles, -1, np.int64)
    runs = 0
    tail = np.int64(-1)
    length = 0
    for r in range(run_of.shape[0]):
        e = first[r]
        if first[r + 1] - e != 2 or not intact[r]:
            run_of[r], tail = runs, -1
            runs += 1
            continue
        i, j = particle[e], particle[e + 1]
        if length == 1 and tail >= 0 and tail != i and tail != j:
            head = particle[e - 2]
            if head in (i, j):  # the row before was given backwards
                particle[e - 2], particle[e - 1] = particle[e - 1], particle[e - 2]
                tail = head
        follows = tail >= 0 and ((tail == i and seen[j] != runs - 1) or (tail == j and seen[i] != runs - 1))
        if follows:
            if tail == j:
                particle[e], particle[e + 1] = j, i
            length += 1
        else:
            runs += 1
            length = 1
        run_of[r] = runs - 1
        seen[i] = seen[j] = runs - 1
        tail = particle[e + 1]
    return runs


@kernel
def colour_runs(first, particle, run_of, particles, colours, colour):
    """Greedy: each run takes the first colour none of its particles has; the last colour takes who finds none."""
    taken = np.zeros(particles, np.uint64)
    one = np.uint64(1)
    r = 0
    rows = run_of.shape[0]
    while r < rows:
        run = run_of[r]
        stop = r
        mask = np.uint64(0)
        while stop < rows and run_of[stop] == run:
            for e in range(first[stop], first[stop + 1]):
                mask |= taken[particle[e]]
            stop += 1
        c = 0
        while c < colours - 1 and (mask >> np.uint64(c)) & one:
            c += 1
        colour[run] = c
        for e in range(first[r], first[stop]):
            taken[particle[e]] |= one << np.uint64(c)
        r = stop


@kernel
def drop_pairs(first, count, pair_i, pair_j, particle, begin, partner):
    """Take pairs of linked particles from a pair list; partner[begin[i] : begin[i + 1]] are those of the user's particle i."""
    for s in range(first.shape[0]):
        kept = first[s]
        for k in range(first[s], first[s] + count[s]):
            i, j = particle[pair_i[k]], particle[pair_j[k]]
            linked = False
            for e in range(begin[i], begin[i + 1]):
                linked |= partner[e] == j
            pair_i[kept], pair_j[kept] = pair_i[k], pair_j[k]
            kept += not linked
        count[s] = kept - first[s]
