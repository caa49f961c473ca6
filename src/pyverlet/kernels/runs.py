"""Runs and colours of links: what is solved together, and what beside each other. Also: which pairs are no contacts."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import LANES

_FREE = -1
_GRID = 16
"""A particle with more links than that is no node of a grid: a hub."""


@kernel
def _match(a, b, p, pair, on):
    """Rows a and b, who share particle p, follow each other there, if neither is followed yet; whether they do."""
    end_a, end_b = 2 * a + (pair[a, 1] == p), 2 * b + (pair[b, 1] == p)
    if a == b or on[end_a] != _FREE or on[end_b] != _FREE:
        return False
    on[end_a], on[end_b] = end_b, end_a
    return True


@kernel
def _follow(pair, intact, particles):
    """(2 rows,) which end of which row, 2 r + (0 or 1), follows each end of each row; _FREE if none."""
    rows = pair.shape[0]
    begin = np.zeros(particles + 1, np.int64)
    for r in range(rows):
        if intact[r]:
            for side in range(2):
                begin[pair[r, side] + 1] += 1
    begin = np.cumsum(begin)
    at, among = begin[:-1].copy(), np.empty(begin[-1], np.int64)
    for r in range(rows):
        if intact[r]:
            for side in range(2):
                p = pair[r, side]
                among[at[p]] = r
                at[p] += 1
    on = np.full(2 * rows, _FREE, np.int64)
    for p in range(particles):
        here = among[begin[p] : begin[p + 1]]
        if len(here) == 2:
            _match(here[0], here[1], p, pair, on)
        elif len(here) <= _GRID:
            for k in range(len(here)):
                for n in range(k + 1, len(here)):
                    if pair[here[k], 0] + pair[here[k], 1] + pair[here[n], 0] + pair[here[n], 1] == 4 * p:
                        _match(here[k], here[n], p, pair, on)
    for r in range(rows - 1):
        if intact[r] and intact[r + 1]:
            for side in range(2):
                p = pair[r, 1 - side]
                if (p == pair[r + 1, 0] or p == pair[r + 1, 1]) and _match(r, r + 1, p, pair, on):
                    break
    return on


@kernel
def find_runs(pair, intact, particles, order, placed, run_of):
    """Sort rows of two particles into runs of links that follow each other; the number of runs.

    Two rows follow each other at a particle that has no others, or whose number lies in the middle between those of their other
    ends, as in the rows, columns and diagonals of a grid, in whatever order they are given; or if one is given right after the
    other. A run never comes back to a particle it has met. pair: (rows, 2); order: becomes the rows, run after run, placed:
    (rows, 2) their particles, the way the run goes, and run_of the run of each.
    """
    rows = pair.shape[0]
    on, seen = _follow(pair, intact, particles), np.full(particles, -1, np.int64)
    done = np.zeros(rows, np.bool_)
    runs = k = 0
    for row in range(rows):
        if done[row]:
            continue
        end = 2 * row  # back to where this run begins, or once around a ring
        while on[end] != _FREE:
            end = on[end] ^ 1
            if end // 2 == row:
                break
        runs += 1
        while True:
            r, i, j = end // 2, pair[end // 2, end % 2], pair[end // 2, 1 - end % 2]
            if seen[j] == runs - 1:
                runs += 1
            order[k], run_of[k], done[r] = r, runs - 1, True
            placed[k, 0], placed[k, 1] = i, j
            seen[i] = seen[j] = runs - 1
            k += 1
            end = on[end ^ 1]
            if end == _FREE or done[end // 2]:
                break
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
def lay_out(given, ends, begin, length, run_at, start, source, node, place):
    """Which row stands in each item of packs of runs, -1 for none, and which particle; and where each row stands first.

    given, ends: rows, run after run, and (rows, 2) their particles; those of a run from its `begin` on. run_at: (packs, LANES).
    """
    for p in range(run_at.shape[0]):
        for lane in range(LANES - 1, -1, -1):  # the last lanes may repeat a run
            first, count = begin[run_at[p, lane]], length[run_at[p, lane]]
            for n in range(start[p] + lane, start[p + 1], LANES):
                step = (n - start[p]) // LANES
                source[n] = -1
                if step < count:
                    source[n], node[n] = given[first + step], ends[first + step, 0]
                    place[given[first + step]] = n
                else:
                    node[n] = ends[first + count - 1, 1]


@kernel
def number_pairs(pairs, particles):
    """(k,) a number for each of the (k, 2) pairs i, j, the same as for j, i."""
    number = np.empty(pairs.shape[0], np.int64)
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        number[k] = min(i, j) * particles + max(i, j)
    return number


@kernel
def numbered_pairs(number, particles):
    """(k, 2) the pairs i < j of these numbers, which are sorted, each once."""
    pairs, count, last = np.empty((number.shape[0], 2), np.int64), 0, np.int64(-1)
    for k in range(number.shape[0]):
        if number[k] != last:
            last = number[k]
            pairs[count, 0], pairs[count, 1] = last // particles, last % particles
            count += 1
    return pairs[:count].copy()


@kernel
def partners(pairs, particles):
    """(begin, partner): partner[begin[i] : begin[i + 1]] stand in one of the (k, 2) pairs with particle i."""
    begin = np.zeros(particles + 1, np.int64)
    for k in range(pairs.shape[0]):
        begin[pairs[k, 0] + 1] += 1
        begin[pairs[k, 1] + 1] += 1
    begin = np.cumsum(begin)
    at, partner = begin[:-1].copy(), np.empty(2 * pairs.shape[0], np.int64)
    for k in range(pairs.shape[0]):
        i, j = pairs[k, 0], pairs[k, 1]
        partner[at[i]], partner[at[j]] = j, i
        at[i] += 1
        at[j] += 1
    return begin, partner


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
