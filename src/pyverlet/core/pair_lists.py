# mypy: ignore-errors
"""Candidate pairs: circles closer than the sum of their radii plus a skin, found in neighbouring cells.

Rows of the first grid are cut into groups. A pair belongs to the group of its lower circle, so a group writes only to its own
particles and to the lowest row of the next: even groups are processed in parallel, then odd ones. Pairs with one of the few
circles too large for cells are the last group, which is processed alone.

For circles of different grids, the larger searches for the smaller, along the rows of small cells that its reach crosses. Those
rows are empty inside of it, so it finds few circles except its neighbours.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import above, any_lane, bits_of, lanes, load, lowest_bit, mask, real, spread
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int32_t, int64_t, uint8_t, uint32_t

from pyverlet.core.cells import COLUMNS, Cells, cell_number, whole_below
from pyverlet.core.kernels import inlined, kernel

CLOSE = cython.declare(real, 1.05)
"""Listed pairs closer than this, over the contact distance, come last in their group; few of the others touch soon."""

CLOSE_BIT = cython.declare(uint32_t, 1 << 31)
"""Set in the second place of a close pair."""

PLACE_BITS = cython.declare(uint32_t, (1 << 31) - 1)

INDEX_WORDS = cython.declare(cython.Py_ssize_t, cython.sizeof(real) // 4)
"""32-bit words per number: an index stored in place of number k is word INDEX_WORDS k of its array."""

Lists = cython.struct(
    listed=cython.bint,  # whether there are lanes, with current impulses
    good=cython.bint,  # whether they match the current particles
    stale=cython.bint,  # whether it may be invalid in the next substep
    impulses_stored=cython.bint,  # whether contact state is stored in `kept`
    short=cython.bint,  # whether arrays were too small
    refill=cython.bint,  # whether materials of pairs have changed
    patching=cython.bint,  # whether particles were added or removed since it was made
    anew=cython.bint,  # whether all groups must be listed, not only `dirty` ones
    tied=cython.bint,  # whether coincident particles were listed: the direction of their pair depends on their numbers
    rebuilds=int64_t,
    # ---- how thick the skin is
    adapts=cython.bint,
    diameters=cython.double,  # mean diameters
    mean_radius=cython.double,  # m
    largest=cython.double,  # radius, m
    half_skin=cython.double,  # m
    age=int64_t,  # substeps since it was made
    hold=int64_t,  # lists before the skin may grow again
    excess=cython.double,  # pairs per particle that a skin thinner by a step would not list
    momenta=cython.p_double,  # (blocks, 3) sum of velocities of free particles, and their number
    speeds=cython.pointer(real),  # (blocks,) square of the largest speed relative to their mean
    # ---- who makes no pairs
    tests_pairs=cython.bint,
    brute=cython.bint,  # whether all pairs are listed
    filtered=cython.bint,
    category=cython.pointer(uint32_t),
    mask=cython.pointer(uint32_t),
    particle=cython.pointer(int32_t),  # the user's index of each
    linked=cython.bint,  # whether links exclude pairs
    linked_begin=cython.pointer(int64_t),  # by the user's index of the lower
    linked_to=cython.pointer(int32_t),
    # ---- groups of rows
    rows=cython.Py_ssize_t,  # number of groups of rows; one more if there are circles without a cell
    row=cython.pointer(int64_t),  # (groups + 1,)
    cut=cython.pointer(int64_t),  # (groups + 1,) first row and number of particles of each, for the next list
    held=cython.pointer(int64_t),
    dirty=cython.pointer(uint8_t),  # (groups,) whether particles of its pairs were added or removed since it was listed
    place=cython.pointer(int32_t),  # new row of each row, or -1; while rows are renumbered
    # ---- pairs as they are found: places in the order of the cells, one group at a time in the scratch memory of a thread
    found=cython.pointer(int64_t),  # (groups,)
    most=int64_t,  # most pairs, or lanes, of any group
    scratch_capacity=cython.Py_ssize_t,  # pairs, and lanes, of each thread's scratch memory
    raw_i=cython.pointer(uint32_t),  # (threads scratch_capacity,)
    raw_j=cython.pointer(uint32_t),
    key=cython.pointer(uint8_t),  # colour of each
    sorted=cython.pointer(uint32_t),  # pairs by colour
    rest=cython.pointer(uint32_t),  # pairs left over from batches of one colour
    put_i=cython.pointer(uint32_t),  # lanes of the group: rows, and the vector from i to j, m
    put_j=cython.pointer(uint32_t),
    put_x=cython.pointer(real),
    put_y=cython.pointer(real),
    used=cython.pointer(uint32_t),  # (count,) colours used at each place
    batch=cython.pointer(uint32_t),  # (count,) last batch at each place
    lanes_capacity=cython.Py_ssize_t,  # room of the lane arrays
    held_lanes=cython.pointer(int64_t),  # (groups,) lanes reserved for each
    looked=cython.pointer(int64_t),  # (groups,) pairs that were checked
    beyond=cython.pointer(int64_t),  # (groups,) pairs of these that a thinner skin would not list
    # ---- what contacts remember while the list is made anew, on chains of their lower particles: in the lanes of before
    fan=cython.Py_ssize_t,  # chains per particle, a power of two
    head=cython.pointer(int32_t),  # (count fan,) -1: none
    kept_next=cython.pointer(int32_t),  # in place of normals, which are unused then: see `INDEX_WORDS`
    kept_other=cython.pointer(uint32_t),
    source=cython.pointer(int32_t),  # in place of depths: previous lane of the same contact, or -1
    carried=cython.int,  # which values are transferred: see `pick_values_stage`
    # ---- what circles without values of their own are made of
    restitution=cython.double,
    friction=cython.double,
    rolling=cython.double,
)


@kernel
def may_touch(
    c: cython.pointer(Cells), ls: cython.pointer(Lists), inverse_mass: cython.pointer(real), a: int64_t, b: int64_t
) -> cython.bint:
    """Whether two places may collide: one is free, filters match, and no link excludes the pair."""
    i: int64_t = c.order[a]
    j: int64_t = c.order[b]
    if not (inverse_mass[i] > 0 or inverse_mass[j] > 0):
        return False
    if ls.filtered and ((ls.category[i] & ls.mask[j]) == 0 or (ls.category[j] & ls.mask[i]) == 0):
        return False
    if ls.linked:
        p: int64_t = ls.particle[i]
        q: int64_t = ls.particle[j]
        k: int64_t
        for k in range(ls.linked_begin[min(p, q)], ls.linked_begin[min(p, q) + 1]):
            if ls.linked_to[k] == max(p, q):
                return False
    return True


@inlined
def test_run(
    c: cython.pointer(Cells), ls: cython.pointer(Lists), inverse_mass: cython.pointer(real), a: int64_t, u: real, v: real,
    low: int64_t, end: int64_t, found: int64_t, capacity: int64_t,
) -> int64_t:  # fmt: skip
    """Write the places `low` up to `end` that are near place a, seen at (u, v), from `found` on; returns the end of pairs."""
    b: int64_t
    lane: cython.int
    for b in range(low, end, 8):
        du: lanes = load(c.spot_u, b) - spread(u)
        dv: lanes = load(c.spot_v, b) - spread(v)
        reach: lanes = load(c.spot_r, b) + spread(c.spot_r[a])
        square: lanes = du * du + dv * dv
        wide: lanes = reach + spread(c.skin)
        near: mask = above(wide * wide, square)
        if not any_lane(near):
            continue
        bits: cython.int = bits_of(near)
        if end - b < 8:
            bits &= (1 << cython.cast(cython.int, end - b)) - 1
        soon: lanes = reach * spread(CLOSE)
        close: cython.int = bits_of(above(soon * soon, square))
        while bits != 0:
            lane = lowest_bit(bits)
            bits &= bits - 1
            if not ls.tests_pairs or may_touch(c, ls, inverse_mass, a, b + lane):
                if found < capacity:
                    ls.raw_i[found] = cython.cast(uint32_t, a)
                    ls.raw_j[found] = cython.cast(uint32_t, b + lane) | (cython.cast(uint32_t, (close >> lane) & 1) << 31)
                found += 1
    return found


@kernel
def test_row(
    c: cython.pointer(Cells), ls: cython.pointer(Lists), inverse_mass: cython.pointer(real), a: int64_t, level: cython.int,
    row: int64_t, left: int64_t, right: int64_t, shift_v: real, found: int64_t, capacity: int64_t,
) -> int64_t:  # fmt: skip
    """`test_run` for columns `left` to `right` of a row, which continues with images in a periodic room."""
    wide: int64_t = c.width[level]
    first: int64_t = c.base[level] + row * wide
    u: real = c.spot_u[a]
    v: real = c.spot_v[a] - shift_v
    low: int64_t = c.start[first + max(left, 0)]
    end: int64_t = c.start[first + max(min(right, wide - 1), -1) + 1]  # NaN is in the lowest cell
    if low < end:
        found = test_run(c, ls, inverse_mass, a, u, v, low, end, found, capacity)
    if c.wraps_u and left < 0:
        low, end = c.start[first + max(wide + left, 0)], c.start[first + wide]
        if low < end:
            found = test_run(c, ls, inverse_mass, a, u + c.period_u, v, low, end, found, capacity)
    if c.wraps_u and right >= wide:
        low, end = c.start[first], c.start[first + min(right - wide, wide - 1) + 1]
        if low < end:
            found = test_run(c, ls, inverse_mass, a, u - c.period_u, v, low, end, found, capacity)
    return found


@kernel
def test_smaller(
    c: cython.pointer(Cells), ls: cython.pointer(Lists), inverse_mass: cython.pointer(real), a: int64_t, other: cython.int,
    least: int64_t, most: int64_t, ahead: real, found: int64_t, capacity: int64_t,
) -> int64_t:  # fmt: skip
    """`test_row` for the grid `other` of smaller circles, in its rows from `least` up to `most`, around place a.

    ahead: shift of place a along v, m: a period, or 0.
    """
    reach: real = (c.spot_r[a] + c.largest[other] + c.skin) * cython.cast(real, 1.001)
    x: real = c.spot_u[a] - c.u0
    y: real = c.spot_v[a] + ahead - c.v0
    wide: int64_t = c.width[other]
    high: int64_t = c.height[other]
    tall: real = 1 / c.along[other]
    across: real = c.across[other]
    first: int64_t
    last: int64_t
    if c.wraps_v:
        first, last = whole_below((y - reach) * c.along[other]), whole_below((y + reach) * c.along[other])
    else:
        first, last = cell_number((y - reach) * c.along[other], high), cell_number((y + reach) * c.along[other], high)
    row: int64_t
    for row in range(max(first, least), min(last + 1, most)):
        # The chord of the circle of this reach at its widest within the row; rim rows have no outer edge.
        below: real = row * tall - y
        away: real = 0
        if below > 0 and (c.wraps_v or row > 0):
            away = below
        if -below - tall > 0 and (c.wraps_v or row < high - 1):
            away = -below - tall
        half: real = cython.cast(real, sqrt(max(reach * reach - away * away, cython.cast(real, 0))))
        turns: int64_t = -1 if row < 0 else 1 if row >= high else 0
        left: int64_t
        right: int64_t
        if c.wraps_u:
            left, right = whole_below((x - half) * across), whole_below((x + half) * across)
        else:
            left, right = cell_number((x - half) * across, wide), cell_number((x + half) * across, wide)
        found = test_row(
            c, ls, inverse_mass, a, other, row - turns * high, left, right, turns * c.period_v - ahead, found, capacity
        )
    return found


@kernel
def none_collide(c: cython.pointer(Cells), ls: cython.pointer(Lists), s: cython.Py_ssize_t, level: cython.int) -> cython.bint:
    """Whether in a grid no two circles of group s and the row above may collide, such as particles of a fluid."""
    first: int64_t = c.base[level] + (ls.row[s] << c.shift[level]) * c.width[level]
    end: int64_t = c.base[level] + min((ls.row[s + 1] + 1) << c.shift[level], c.height[level]) * c.width[level]
    category: uint32_t = 0
    taken: uint32_t = 0
    k: int64_t
    if not ls.filtered or (c.wraps_v and ls.row[s + 1] == c.height[0]):
        return False
    for k in range(c.start[first], c.start[end]):
        category |= ls.category[c.order[k]]
        taken |= ls.mask[c.order[k]]
    return (category & taken) == 0


@kernel
def list_rows(
    c: cython.pointer(Cells), ls: cython.pointer(Lists), inverse_mass: cython.pointer(real), s: cython.Py_ssize_t,
    found: int64_t, capacity: int64_t,
) -> int64_t:  # fmt: skip
    """Write the pairs of group s, a group of rows, from `found` on; returns their end, even beyond the room."""
    level: cython.int
    other: cython.int
    row: int64_t
    a: int64_t
    for level in range(c.levels):
        shift: int64_t = c.shift[level]
        wide: int64_t = c.width[level]
        high: int64_t = c.height[level]
        alone: cython.bint = none_collide(c, ls, s, level)
        for row in range(ls.row[s] << shift, ls.row[s + 1] << shift):
            this: int64_t = c.base[level] + row * wide
            for a in range(c.start[this], c.start[this + wide]):
                if not alone:
                    column: int64_t = cell_number((c.spot_u[a] - c.u0) * c.across[level], wide)
                    # The rest of this row; in the row above, COLUMNS to the left and to the right.
                    end: int64_t = c.start[this + min(column + COLUMNS, wide - 1) + 1]
                    if a + 1 < end:
                        found = test_run(c, ls, inverse_mass, a, c.spot_u[a], c.spot_v[a], a + 1, end, found, capacity)
                    if c.wraps_u and column + COLUMNS >= wide:
                        end = c.start[this + min(column + COLUMNS - wide, wide - 1) + 1]
                        found = test_run(
                            c, ls, inverse_mass, a, c.spot_u[a] - c.period_u, c.spot_v[a], c.start[this], end, found, capacity
                        )
                    left: int64_t = column - COLUMNS
                    if row + 1 < high:
                        found = test_row(c, ls, inverse_mass, a, level, row + 1, left, column + COLUMNS, 0, found, capacity)
                    elif c.wraps_v:
                        found = test_row(c, ls, inverse_mass, a, level, 0, left, column + COLUMNS, c.period_v, found, capacity)
                for other in range(level + 1, c.levels):
                    least: int64_t = ls.row[s] << c.shift[other]
                    found = test_smaller(c, ls, inverse_mass, a, other, least, 2 * c.height[other], 0, found, capacity)
    # Pairs of a circle in the first row above and a smaller one below belong to this group, too.
    over: int64_t = ls.row[s + 1]
    ahead: real = 0
    if over == c.height[0]:
        if not c.wraps_v:
            return found
        over, ahead = 0, c.period_v
    for level in range(c.levels - 1):
        wide = c.width[level]
        for row in range(over << c.shift[level], (over + 1) << c.shift[level]):
            this = c.base[level] + row * wide
            for a in range(c.start[this], c.start[this + wide]):
                for other in range(level + 1, c.levels):
                    shift = c.shift[other]
                    found = test_smaller(
                        c, ls, inverse_mass, a, other, ls.row[s] << shift, ls.row[s + 1] << shift, ahead, found, capacity
                    )
    return found


@kernel
def list_alone(
    c: cython.pointer(Cells), ls: cython.pointer(Lists), inverse_mass: cython.pointer(real), found: int64_t, capacity: int64_t
) -> int64_t:
    """Write the pairs of circles without a cell, the last group."""
    a: int64_t
    level: cython.int
    across: cython.int
    along: cython.int
    for a in range(c.celled, c.count):
        for level in range(c.levels):
            high: int64_t = c.height[level]
            found = test_smaller(c, ls, inverse_mass, a, level, -high if c.wraps_v else 0, 2 * high, 0, found, capacity)
        for along in range(-1, 2):
            for across in range(-1, 2):
                if (along == 0 or c.wraps_v) and (across == 0 or c.wraps_u):
                    u: real = c.spot_u[a] - across * c.period_u
                    v: real = c.spot_v[a] - along * c.period_v
                    found = test_run(c, ls, inverse_mass, a, u, v, a + 1, c.count, found, capacity)
    return found
