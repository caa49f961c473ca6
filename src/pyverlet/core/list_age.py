# mypy: ignore-errors
"""When a pair list expires: whether two circles may have approached each other by the skin, and how thick the skin should be.

For displacements u, the distance of two circles changes by at most |u_i - u_j|, so the relative motion of neighbours counts. It
is at most the diagonal of the box around all displacements in the two by two patches that contain both. Circles that are not in
neighbouring patches have a patch between them.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.cells import COLUMNS, Cells, cell_number, grid_coordinate
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pair_batches import SKIN_STEP
from pyverlet.core.pair_lists import Lists
from pyverlet.core.step import Step

SKIN_LEAST = cython.declare(cython.double, 0.02)
SKIN_MOST = cython.declare(cython.double, 2.0)
"""Bounds of the adaptive skin, in mean diameters."""

SKIN_HOLD = cython.declare(cython.int, 16)
"""Lists before a skin that was too thick is tried again: in a crystal all second neighbours appear at once."""

REBUILD_PAIRS = cython.declare(cython.double, 30.0)
"""Cost of building the list, in pairs per particle that contacts process in a substep."""

REBUILD_CALL = cython.declare(cython.double, 1000.0)
"""The same, in pairs in all, for any number of particles."""

WORTH_THINNING = cython.declare(cython.double, 0.3)
"""Pairs per particle that a thinner skin must save to rebuild a list that is still valid."""

WORTH_LOOKING = cython.declare(cython.double, 0.3)
"""The list is rebuilt when less than this fraction of half the skin is left, as repeated checks would cost as much."""


@inlined
def worth(w: cython.pointer(Step)) -> cython.double:
    """Cost of building the list, in pairs per particle that contacts process in a substep."""
    return REBUILD_PAIRS + REBUILD_CALL / max(w.count, 1)


@kernel
def has_paid(w: cython.pointer(Step), ls: cython.pointer(Lists)) -> cython.bint:
    """Whether pairs that were listed in vain have cost as much as a new list; for example, after all has come to rest."""
    return ls.adapts and ls.excess > WORTH_THINNING and ls.excess * ls.age > worth(w)


@kernel
def adapt_skin(w: cython.pointer(Step), ls: cython.pointer(Lists)) -> cython.void:
    """Adapt the skin to minimise the cost of lists plus that of pairs listed in vain."""
    # A list that no substep has used was remade because arrays were too small, which is no part of the state.
    if not ls.adapts or ls.age == 0:
        return
    # The life of a list is proportional to the skin: a step up saves this much per particle and substep.
    saved: cython.double = worth(w) / max(ls.age, 1) * (1.0 - 1.0 / SKIN_STEP)
    ls.hold = max(ls.hold - 1, 0)
    if ls.excess > saved * SKIN_STEP:
        ls.diameters = max(ls.diameters / SKIN_STEP, SKIN_LEAST)
        ls.hold = SKIN_HOLD
    elif saved > ls.excess * SKIN_STEP and ls.hold == 0:
        ls.diameters = min(ls.diameters * SKIN_STEP, SKIN_MOST)


@kernel
def lay_patches(c: cython.pointer(Cells)) -> cython.void:
    """Divide the first grid into patches of two by two rows; in a periodic room none may be smaller."""
    c.patches_u = c.width[0] // (2 * COLUMNS) if c.wraps_u else (c.width[0] + 2 * COLUMNS - 1) // (2 * COLUMNS)
    c.patches_v = c.height[0] // 2 if c.wraps_v else (c.height[0] + 1) // 2
    c.patches_u, c.patches_v = max(c.patches_u, 1), max(c.patches_v, 1)


@inlined
def way_of(w: cython.pointer(Step), i: int64_t, axis: cython.int) -> real:
    """Displacement of a particle since it was listed, at the end of the next substep if nothing stops it, m."""
    speed: real = w.motion[4 * i + axis] if w.rough else w.velocity[2 * i + axis]
    return w.position[2 * i + axis] + w.h * speed - w.listed[2 * i + axis]


@kernel
def bound_moves(w: cython.pointer(Step), c: cython.pointer(Cells), row: int64_t) -> cython.void:
    """Compute the bounds of displacements in a row of patches. The last row, and the last of a row, include the remainder."""
    for column in range(c.patches_u):
        x0: real = INFINITY
        y0: real = INFINITY
        x1: real = -INFINITY
        y1: real = -INFINITY
        for level in range(c.levels):
            low: int64_t = (2 * row) << c.shift[level]
            high: int64_t = c.height[level] if row == c.patches_v - 1 else (2 * row + 2) << c.shift[level]
            left: int64_t = (2 * COLUMNS * column) << c.shift[level]
            right: int64_t = c.width[level] if column == c.patches_u - 1 else (2 * COLUMNS * (column + 1)) << c.shift[level]
            for line in range(low, high):
                first: int64_t = c.base[level] + line * c.width[level]
                for k in range(c.start[first + left], c.start[first + right]):
                    x: real = way_of(w, c.order[k], 0)
                    y: real = way_of(w, c.order[k], 1)
                    x0, y0 = x if not x >= x0 else x0, y if not y >= y0 else y0
                    x1, y1 = x if not x <= x1 else x1, y if not y <= y1 else y1
        b: int64_t = 4 * (row * c.patches_u + column)
        c.box[b], c.box[b + 1], c.box[b + 2], c.box[b + 3] = x0, y0, x1, y1


@kernel
def spread_of(c: cython.pointer(Cells), row: int64_t, column: int64_t) -> cython.double:
    """Square of the largest relative displacement in two by two patches, of which this is the first, m^2."""
    right: int64_t = column + 1 if column + 1 < c.patches_u else 0 if c.wraps_u else column
    above: int64_t = row + 1 if row + 1 < c.patches_v else 0 if c.wraps_v else row
    x0: real = INFINITY
    y0: real = INFINITY
    x1: real = -INFINITY
    y1: real = -INFINITY
    n: cython.int
    for n in range(4):
        b: int64_t = 4 * ((above if n & 2 else row) * c.patches_u + (right if n & 1 else column))
        x0, y0 = min(x0, c.box[b]), min(y0, c.box[b + 1])
        x1, y1 = max(x1, c.box[b + 2]), max(y1, c.box[b + 3])
    if not x0 <= x1:
        return 0.0
    dx: cython.double = cython.cast(cython.double, x1) - x0
    dy: cython.double = cython.cast(cython.double, y1) - y0
    return dx * dx + dy * dy


@kernel
def spread_around(w: cython.pointer(Step), c: cython.pointer(Cells), a: int64_t) -> cython.double:
    """As `spread_of`, for the particle at place a, which has no cell, and all in the patches around it."""
    i: int64_t = c.order[a]
    x: real = way_of(w, i, 0)
    y: real = way_of(w, i, 1)
    reach: real = c.spot_r[a] + c.bulk + 2 * c.skin
    u: real = grid_coordinate(c, w.listed, i, 0) - c.u0
    v: real = grid_coordinate(c, w.listed, i, 1) - c.v0
    most: cython.double = 0
    row: int64_t
    first: int64_t = 0
    last: int64_t = c.patches_v - 1
    left: int64_t = 0
    right: int64_t = c.patches_u - 1
    if not c.wraps_v:
        first = cell_number((v - reach) * c.along[0], c.height[0]) // 2
        last = min(cell_number((v + reach) * c.along[0], c.height[0]) // 2, last)
    if not c.wraps_u:
        left = cell_number((u - reach) * c.across[0], c.width[0]) // (2 * COLUMNS)
        right = min(cell_number((u + reach) * c.across[0], c.width[0]) // (2 * COLUMNS), right)
    for row in range(first, last + 1):
        for column in range(left, right + 1):
            b: int64_t = 4 * (row * c.patches_u + column)
            if c.box[b] <= c.box[b + 2]:
                dx: cython.double = max(abs(c.box[b] - x), abs(c.box[b + 2] - x))
                dy: cython.double = max(abs(c.box[b + 1] - y), abs(c.box[b + 3] - y))
                most = max(most, dx * dx + dy * dy)
    for row in range(c.celled, c.count):
        j: int64_t = c.order[row]
        dx = way_of(w, j, 0) - x
        dy = way_of(w, j, 1) - y
        most = max(most, dx * dx + dy * dy)
    return most


@kernel
def slack_left(w: cython.pointer(Step), c: cython.pointer(Cells), skin: cython.double) -> cython.double:
    """How much nearer any pair that was farther apart than the skin may still come before it can touch, m; negative: too near.
    By how much any pair that was farther apart than the skin may still approach before it can touch, m; negative: expired.
    Needs the boxes of all rows of patches.
    Needs the bounds of all rows of patches.
    """
    near: cython.double = 0
    x0: cython.double = INFINITY
    y0: cython.double = INFINITY
    x1: cython.double = -INFINITY
    y1: cython.double = -INFINITY
    k: int64_t
    for row in range(c.patches_v):
        for column in range(c.patches_u):
            near = max(near, spread_of(c, row, column))
            k = 4 * (row * c.patches_u + column)
            x0, y0 = min(x0, c.box[k]), min(y0, c.box[k + 1])
            x1, y1 = max(x1, c.box[k + 2]), max(y1, c.box[k + 3])
    for k in range(c.celled, c.count):
        near = max(near, spread_around(w, c, k))
        x: cython.double = way_of(w, c.order[k], 0)
        y: cython.double = way_of(w, c.order[k], 1)
        x0, y0, x1, y1 = min(x0, x), min(y0, y), max(x1, x), max(y1, y)
    if not x0 <= x1:
        return skin
    far: cython.double = sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0))
    gap: cython.double = 2.0 / c.along[0] - 2.0 * c.bulk
    gap = min(gap, 2.0 * COLUMNS / c.across[0] - 2.0 * c.bulk)
    if c.celled < c.count:
        gap = min(gap, 2.0 * c.skin)
    return min(skin - sqrt(near), gap - far)
