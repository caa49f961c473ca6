# mypy: ignore-errors
"""Nested grids in which particles are sorted by cell; each grid has cells half as large as the one before.

A circle belongs to the smallest cells that its diameter plus the skin fits into. A few that are much larger than all others
(`bulk` and up), or move farther in a substep than the skin, belong to none. Rows of cells follow each other along v, columns
along u; u and v are x and y, or y and x in worlds that are much longer than high. Columns are a third as wide as rows are high,
so that the neighbours of a circle, consecutive along a row, are cut out more tightly. In a periodic room the last row, or
column, is followed by the first.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import floor, sqrt
from cython.cimports.libc.stdint import int64_t, uint32_t

from pyverlet.core.kernels import inlined
from pyverlet.core.periodic import wrapped

BLOCK = cython.declare(cython.Py_ssize_t, 512)
"""Particles per block, the work item of a thread."""

LEVELS = cython.declare(cython.int, 10)
COLUMNS = cython.declare(cython.int, 3)
"""Columns per row height."""


Cells = cython.struct(
    count=cython.Py_ssize_t,
    position=cython.pointer(real),
    radius=cython.pointer(real),
    low_x=cython.double,  # corner and periods of a periodic room, m; 0: none
    low_y=cython.double,
    period_x=cython.double,
    period_y=cython.double,
    bulk=real,  # largest radius in cells, m
    widest=real,  # largest reach, m; fast particles reach farther than their radius
    smallest=real,
    skin=real,  # pairs with smaller gaps are listed, m
    velocity=cython.pointer(real),  # m/s, of particle i at stride * i
    stride=cython.Py_ssize_t,
    common_x=real,  # mean velocity, m/s
    common_y=real,
    pace=real,  # s that a list must last for velocities relative to the mean; 0: no particle moves more than half the skin
    farthest=real,  # reach in a periodic room, m: pairs must have one near image only
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
    largest=cython.pointer(real),  # largest radius in it, m
    held=cython.pointer(int64_t),
    # ---- what stands in them
    extent=cython.pointer(real),  # (blocks, 4) x0, y0, x1, y1
    cell=cython.pointer(uint32_t),  # (count,)
    bits=cython.int,  # cell >> bits is the bucket of a cell: see `cell_sorting`
    tally=cython.pointer(uint32_t),  # (pieces + 1, pieces) particles of each piece in each bucket; then descents of `order`
    mixed=cython.pointer(uint32_t),  # (count,) particles by bucket, while a list is made
    start=cython.pointer(uint32_t),  # (4 count + 66,) number of particles in the cells before each
    order=cython.pointer(uint32_t),  # (count,) by cell; those without a cell come last
    spot_u=cython.pointer(real),  # (count + 8,) in cell order, inside a periodic room; while a list is made
    spot_v=cython.pointer(real),
    spot_r=cython.pointer(real),
    celled=cython.Py_ssize_t,  # number of particles in cells
    falls=cython.Py_ssize_t,  # how often `order` descends
    # ---- squares of two by two cells of the first grid, to see how differently neighbours move
    patches_u=int64_t,
    patches_v=int64_t,
    box=cython.pointer(real),  # (patches, 4) bounds of the displacements in each, m; in shared memory
)


@inlined
def cell_number(value: real, cells: int64_t) -> int64_t:
    """floor(value) clamped to 0 .. cells - 1: particles outside use rim cells, so that neighbours stay neighbours."""
    last: int64_t = cells - 1
    if value >= last:
        return last
    if value > 0:
        return cython.cast(int64_t, value)
    return 0


@inlined
def whole_below(value: real) -> int64_t:
    """floor(value) as an integer."""
    whole: int64_t = cython.cast(int64_t, value)
    return whole - 1 if value < whole else whole


@inlined
def level_of(c: cython.pointer(Cells), radius: real) -> cython.int:
    """The grid level of a circle."""
    level: cython.int = 0
    while level + 1 < c.levels and radius <= c.largest[level + 1]:
        level += 1
    return level


@inlined
def image_of(value: real, seen: real, low: cython.double, period: cython.double) -> real:
    """The image of a coordinate that matches that of `seen` inside the room; unchanged if the period is 0."""
    if period > 0:
        value = cython.cast(real, value - period * floor((seen - low) / period))
    return value


@inlined
def reach_of(c: cython.pointer(Cells), i: cython.Py_ssize_t) -> real:
    """Radius of a particle plus how much farther than half the skin it moves while a list lasts: see `cells_stage`."""
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
    """Coordinate u (0) or v (1) of a particle, inside a periodic room."""
    y: cython.int = axis ^ c.swapped
    return wrapped(position[2 * i + y], c.low_y if y else c.low_x, c.period_v if axis else c.period_u)
