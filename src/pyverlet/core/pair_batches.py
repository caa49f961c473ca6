# mypy: ignore-errors
"""Arranges the pairs of a group in batches of eight that share no particle.

Each pair takes the lowest colour that neither of its circles has; eight of one colour form a batch. The rest fills batches in
order, where pairs that share a particle with the batch wait for the next; around a large circle many do. A partial batch repeats
its last pair: both lanes write the same. Pairs with a pinned circle come after all batches: they are surface contacts of the free
circle, and sweeps over pairs skip them.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import lowest_bit, real
from cython.cimports.libc.stdint import int64_t, uint8_t, uint32_t
from cython.cimports.team import team_reserve

from pyverlet.core.cells import Cells
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pair_lists import CLOSE_BIT, PLACE_BITS, Lists
from pyverlet.core.periodic import nearest_of
from pyverlet.core.step import Step

COLOURS = cython.declare(cython.int, 16)
NO_COLOUR = cython.declare(cython.int, 15)
LAST_COLOUR = cython.declare(uint32_t, 1 << 15)
MOST_COLOURS = cython.declare(uint32_t, (1 << 15) - 1)
PINNED = cython.declare(cython.int, 32)

SPARE_LANES = cython.declare(int64_t, 64)
"""Spare lanes of a group, for particles that are added."""

WAITING = cython.declare(int64_t, 32)
"""Pairs searched for each batch of the rest."""

ASIDE = cython.declare(real, 1e-6)
"""Distance assumed between coincident centres, over the contact distance, to have a direction."""

SKIN_STEP = cython.declare(cython.double, 1.25)
"""Factor by which the skin changes when a list is made."""


@kernel
def forget_colours(c: cython.pointer(Cells), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """Clear the colours of the particles in the rows of group s and the row above."""
    level: cython.int
    k: int64_t
    for level in range(c.levels):
        this: int64_t = c.base[level]
        high: int64_t = min((ls.row[s + 1] + 1) << c.shift[level], c.height[level])
        for k in range(c.start[this + (ls.row[s] << c.shift[level]) * c.width[level]], c.start[this + high * c.width[level]]):
            ls.used[k] = 0
        if c.wraps_v and ls.row[s + 1] == c.height[0]:
            for k in range(c.start[this], c.start[this + (cython.cast(int64_t, 1) << c.shift[level]) * c.width[level]]):
                ls.used[k] = 0


@inlined
def put_pair(ls: cython.pointer(Lists), c: cython.pointer(Cells), k: int64_t, a: int64_t, b: int64_t) -> cython.void:
    """Write places a and b, with the vector from a to b, to lane k of the scratch memory."""
    ls.put_i[k], ls.put_j[k] = c.order[a], c.order[b]
    du: real = nearest_of(c.spot_u[b] - c.spot_u[a], c.period_u)
    dv: real = nearest_of(c.spot_v[b] - c.spot_v[a], c.period_v)
    if du == 0 and dv == 0:  # an arbitrary direction for this pair
        ls.tied = True
        p: int64_t = ls.particle[ls.put_i[k]]
        q: int64_t = ls.particle[ls.put_j[k]]
        chance: int64_t = ((p + q) * 40503 + p * q * 9973) & 1023
        slope: real = cython.cast(real, chance & 511) / 256 - 1
        hair: real = ASIDE * (c.spot_r[a] + c.spot_r[b]) / (1 + slope * slope)
        if chance >= 512:
            hair = -hair
        du, dv = hair * (1 - slope * slope), hair * (slope + slope)
    ls.put_x[k], ls.put_y[k] = (dv, du) if c.swapped else (du, dv)


@kernel
def put_rest(
    ls: cython.pointer(Lists), c: cython.pointer(Cells), low: int64_t, end: int64_t, k: int64_t, capacity: int64_t, phase: int64_t
) -> int64_t:
    """Fill batches from lane k on with the pairs rest[low] to rest[end]; returns the end of lanes, even beyond the room.

    phase: below 4, different for groups that share particles.
    """
    p: int64_t
    lane: int64_t
    while low < end:
        number: uint32_t = cython.cast(uint32_t, 4 * (k // 8) + phase)
        taken: int64_t = 0
        waits: int64_t = 0
        waiting: uint32_t[32]
        p = low
        while p < end and taken < 8 and waits < WAITING:
            pair: uint32_t = ls.rest[p]
            a: uint32_t = ls.raw_i[pair]
            b: uint32_t = ls.raw_j[pair] & PLACE_BITS
            if ls.batch[a] != number and ls.batch[b] != number:
                ls.batch[a] = ls.batch[b] = number
                if k + taken < capacity:
                    put_pair(ls, c, k + taken, a, b)
                taken += 1
            else:
                waiting[waits] = pair
                waits += 1
            p += 1
        low = p - waits
        for lane in range(waits):
            ls.rest[low + lane] = waiting[lane]
        for lane in range(k + taken, min(k + 8, capacity)):
            ls.put_i[lane], ls.put_j[lane] = ls.put_i[lane - 1], ls.put_j[lane - 1]
            ls.put_x[lane], ls.put_y[lane] = ls.put_x[lane - 1], ls.put_y[lane - 1]
        k += 8
    return k


@kernel
def put_batches(
    w: cython.pointer(Step), ls: cython.pointer(Lists), c: cython.pointer(Cells), s: cython.Py_ssize_t, alone: cython.bint,
    low: int64_t, end: int64_t, capacity: int64_t,
) -> int64_t:  # fmt: skip
    """Arrange the pairs `low` to `end` of the scratch memory in lanes from `low` on; returns their end, even beyond the room."""
    first: int64_t[34]
    p: int64_t
    key: cython.int
    for key in range(PINNED + 2):
        first[key] = 0
    if not alone:
        forget_colours(c, ls, s)
    for p in range(low, end):
        a: uint32_t = ls.raw_i[p]
        b: uint32_t = ls.raw_j[p] & PLACE_BITS
        colour: cython.int = NO_COLOUR
        pinned: cython.bint = ls.tests_pairs and (w.inverse_mass[c.order[a]] == 0 or w.inverse_mass[c.order[b]] == 0)
        if not alone and not pinned:
            # Bit NO_COLOUR is always free.
            free: uint32_t = (MOST_COLOURS & ~(ls.used[a] | ls.used[b])) | LAST_COLOUR
            colour = lowest_bit(free)
            free &= ~free + 1
            ls.used[a] |= free
            ls.used[b] |= free
        key = PINNED if pinned else colour + COLOURS if ls.raw_j[p] & CLOSE_BIT else colour
        ls.key[p] = cython.cast(uint8_t, key)
        first[key + 1] += 1
    first[0] = low
    for key in range(PINNED):
        first[key + 1] += first[key]
    for p in range(low, end):
        key = ls.key[p]
        ls.sorted[first[key]] = cython.cast(uint32_t, p)
        first[key] += 1
    k: int64_t = low
    begin: int64_t = low
    left: int64_t = low
    for key in range(2 * COLOURS):
        whole: int64_t = begin
        if key % COLOURS != NO_COLOUR:
            whole = begin + (first[key] - begin) // 8 * 8
        for p in range(begin, whole):
            pair: uint32_t = ls.sorted[p]
            if k < capacity:
                put_pair(ls, c, k, ls.raw_i[pair], ls.raw_j[pair] & PLACE_BITS)
            k += 1
        for p in range(whole, first[key]):
            ls.rest[left] = ls.sorted[p]
            left += 1
        begin = first[key]
        if key % COLOURS == NO_COLOUR:
            k = put_rest(ls, c, low, left, k, capacity, 2 if alone else s % 2)
            left = low
    w.swept[s] = k - low
    for p in range(begin, end):
        pair = ls.sorted[p]
        if k < capacity:
            put_pair(ls, c, k, ls.raw_i[pair], ls.raw_j[pair] & PLACE_BITS)
        k += 1
    return k


@kernel
def place_lanes(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t, low: int64_t) -> cython.bint:
    """Move the lanes of group s from the scratch memory to their place, or a new one; returns whether there is room."""
    k: int64_t
    if w.lanes[s] > ls.held_lanes[s]:
        ls.held_lanes[s] = (w.lanes[s] + 7) // 8 * 8 + SPARE_LANES
        w.begin[s] = team_reserve(w.team, ls.held_lanes[s])
    if w.lanes[s] > 0 and w.begin[s] + ls.held_lanes[s] > ls.lanes_capacity:
        return False
    for k in range(w.lanes[s]):
        w.i[w.begin[s] + k], w.j[w.begin[s] + k] = ls.put_i[low + k], ls.put_j[low + k]
        w.gap_x[w.begin[s] + k], w.gap_y[w.begin[s] + k] = ls.put_x[low + k], ls.put_y[low + k]
    return True


@kernel
def count_far(w: cython.pointer(Step), ls: cython.pointer(Lists), c: cython.pointer(Cells), s: cython.Py_ssize_t) -> cython.void:
    """Count the lanes of group s that were checked, and those of them that a skin thinner by a step would not list."""
    k: int64_t
    thinner: cython.double = c.skin / SKIN_STEP
    ls.looked[s] = ls.beyond[s] = 0
    for k in range(w.begin[s], w.begin[s] + w.lanes[s], 16):
        reach: cython.double = c.radius[w.i[k]] + c.radius[w.j[k]] + thinner
        x: cython.double = w.gap_x[k]
        y: cython.double = w.gap_y[k]
        ls.looked[s] += 1
        ls.beyond[s] += x * x + y * y > reach * reach
