# mypy: ignore-errors
"""Particles sorted by cell: nested grids, each with cells half as large as those of the one before.

A circle stands in the smallest cells that its diameter and the skin fit into. Very few that are much larger than all others
(`bulk` and up), and a few that get farther in a substep than the skin, stand in no cell. Rows of cells follow each other along
v, columns along u; u and v are x and y, or y and x in rooms that are much longer than high. Columns are a third as wide as rows
are high, so that the neighbours of a circle, which stand together along a row, are cut out more closely. In a periodic room the
last row, or column, is followed by the first.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import floor, sqrt
from cython.cimports.libc.stdint import int64_t, uint32_t

from pyverlet.core.kernels import inlined
from pyverlet.core.periodic import wrapped

BLOCK = cython.declare(cython.Py_ssize_t, 512)
"""Particles that are gone through together by one thread."""

LEVELS = cython.declare(cython.int, 10)
COLUMNS = cython.declare(cython.int, 3)
"""Columns in the width of a row's height."""


Cells = cython.struct(
    count=cython.Py_ssize_t,
    position=cython.pointer(real),
    radius=cython.pointer(real),
    low_x=cython.double,  # corner of a periodic room, m, and its periods, 0: none
    low_y=cython.double,
    period_x=cython.double,
    period_y=cython.double,
    bulk=real,  # largest radius in cells, m
    widest=real,  # the same of how far particles reach: of those that move far it is more than their radius
    smallest=real,
    skin=real,  # rims that are nearer are listed, m
    velocity=cython.pointer(real),  # m/s, of particle i at stride * i
    stride=cython.Py_ssize_t,
    common_x=real,  # m/s, which most of them have in common
    common_y=real,
    pace=real,  # seconds at the rest of the velocity that a list has to last; 0: none gets farther than half the skin by that
    farthest=real,  # reach in a periodic room, m: a pair may be near on one side only
    # ---- the grids
    swapped=cython.int,  # 1: u is y
    u0=real,
    v0=real,
    wraps_u=cython.bint,
    wraps_v=cython.bint,
    period_u=real,
    period_v=real,
    levels=cython.int,
    total=int64_t,  # cells
    shift=cython.pointer(int64_t),  # (LEVELS,) log2 of rows of this grid in a row of the first
    base=cython.pointer(int64_t),  # number of its first cell
    width=cython.pointer(int64_t),
    height=cython.pointer(int64_t),
    across=cython.pointer(real),  # columns, and rows, a metre
    along=cython.pointer(real),
    largest=cython.pointer(real),  # radius that stands in it, m
    held=cython.pointer(int64_t),
    # ---- what stands in them
    extent=cython.pointer(real),  # (blocks, 4) x0, y0, x1, y1
    cell=cython.pointer(uint32_t),  # (count,)
    bits=cython.int,  # cell >> bits is the bucket of a cell: see `cell_sorting`
    tally=cython.pointer(uint32_t),  # (pieces + 1, pieces) particles of each piece in each bucket; falls of `order` in each
    mixed=cython.pointer(uint32_t),  # (count,) particles by bucket; while a list is made
    start=cython.pointer(uint32_t),  # (4 count + 66,) particles in all cells before each
    order=cython.pointer(uint32_t),  # (count,) by cell; those in no cell come last
    spot_u=cython.pointer(real),  # (count + 8,) in that order, inside a periodic room; while a list is made
    spot_v=cython.pointer(real),
    spot_r=cython.pointer(real),
    celled=cython.Py_ssize_t,  # how many stand in cells
    falls=cython.Py_ssize_t,  # how often `order` falls
    # ---- squares of two by two cells of the first grid, to see how differently neighbours move
    patches_u=int64_t,
    patches_v=int64_t,
    box=cython.pointer(real),  # (patches, 4) around how far the particles of each have moved, m; in memory that is shared
)


@inlined
def cell_number(value: real, cells: int64_t) -> int64_t:
    """floor(value), not below 0 and below `cells`: what is outside stands in the rim, which keeps neighbours neighbours."""
    last: int64_t = cells - 1
    if value >= last:
        return last
    if value > 0:
        return cython.cast(int64_t, value)
    return 0


@inlined
def whole_below(value: real) -> int64_t:
    """floor(value)."""
    whole: int64_t = cython.cast(int64_t, value)
    return whole - 1 if value < whole else whole


@inlined
def level_of(c: cython.pointer(Cells), radius: real) -> cython.int:
    """The grid that a circle stands in."""
    level: cython.int = 0
    while level + 1 < c.levels and radius <= c.largest[level + 1]:
        level += 1
    return level


@inlined
def image_of(value: real, seen: real, low: cython.double, period: cython.double) -> real:
    """The image of a coordinate that belongs to that of `seen` inside the room: itself where the period is 0."""
    if period > 0:
        value = cython.cast(real, value - period * floor((seen - low) / period))
    return value


@inlined
def reach_of(c: cython.pointer(Cells), i: cython.Py_ssize_t) -> real:
    """The radius of a particle, and how much farther than half the skin it gets while a list lasts: see `cells_stage`."""
    radius: real = c.radius[i]
    if c.pace > 0:
        x: real = c.velocity[c.stride * i] - c.common_x
        y: real = c.velocity[c.stride * i + 1] - c.common_y
        way: real = c.pace * cython.cast(real, sqrt(x * x + y * y)) - c.skin / 2
        if way > 0:
            radius = max(radius, min(radius + way, c.farthest))
    return radius


@inlined
def grid_coordinate(c: cython.pointer(Cells), position: cython.pointer(real), i: cython.Py_ssize_t, axis: cython.int) -> real:
    """The coordinate u (0) or v (1) of a particle, inside a periodic room."""
    y: cython.int = axis ^ c.swapped
    return wrapped(position[2 * i + y], c.low_y if y else c.low_x, c.period_v if axis else c.period_u)
