# mypy: ignore-errors
"""A fluid's particles and images in the order of cells, as high as its support and part of it wide."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.lanes import LANES, real
from cython.cimports.libc.math import INFINITY, sqrt
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import team_stage, thread_team

from pyverlet.core.fluid_images import BLOCK_OF_FLUID, Images, copy_stage, make_images
from pyverlet.core.kernels import inlined, kernel

SIDE = cython.declare(cython.Py_ssize_t, 4)
"""Columns that the support is wide."""

SPAN = cython.declare(cython.int, 12)
"""Columns that eight particles, which look at the same neighbours, may be apart."""

Fluid = cython.struct(
    images=cython.pointer(Images),  # particles, and their images
    columns=cython.Py_ssize_t,
    cell=cython.pointer(int32_t),  # (count,) of each place
    begin=cython.pointer(int32_t),  # (cells + 2,) first place of each cell
    cells=cython.Py_ssize_t,
    most_cells=cython.Py_ssize_t,  # that there is room for
    low_x=cython.double,  # corner of the cells that are not empty, m
    low_y=cython.double,
    per=cython.double,  # rows a metre
    place=cython.pointer(int32_t),  # (count,) of each particle, and of the images after them, in the order of the cells
    x=cython.pointer(real),  # (count,) by place, as all below; in supports
    y=cython.pointer(real),
    vx=cython.pointer(real),  # times 8 nu / rho_0 R, so that they are a force where they meet
    vy=cython.pointer(real),
    m=cython.pointer(real),
    share=cython.pointer(real),  # p / rho^2
    at=cython.pointer(int32_t),  # (count,) which particle or image it is
    force=cython.pointer(real),  # (slots, 2) N
    slot=cython.pointer[cython.const[int32_t]],  # (owned,)
    density=cython.pointer(cython.double),  # (owned,) kg/m^2
    pressure=cython.pointer(cython.double),  # (owned,) N/m
    forces=cython.bint,  # whether they are asked for
    sorted=cython.bint,  # whether there was room enough
    support=real,
    rest=real,
    stiffness=real,
    viscosity=real,
    threads=cython.pointer(thread_team),
)


@inlined
def group_end(f: cython.pointer(Fluid), first: cython.Py_ssize_t, stop: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Where a group ends that begins at this place: at most eight, all in a row of cells, and not far apart."""
    row: cython.Py_ssize_t = f.cell[first] // f.columns
    end: cython.Py_ssize_t = min(min(first + LANES, stop), f.begin[(row + 1) * f.columns])
    while f.cell[end - 1] - f.cell[first] > SPAN:
        end -= 1
    return end


@kernel
def place_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Copy a block to its places."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    c: cython.pointer(Images) = f.images
    per: real = 1 / f.support
    drag: real = 8 * f.viscosity / f.rest * per
    k: cython.Py_ssize_t
    for k in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), c.count)):
        i: cython.Py_ssize_t = f.at[k]
        f.x[k], f.y[k], f.vx[k], f.vy[k], f.m[k] = per * c.x[i], per * c.y[i], drag * c.vx[i], drag * c.vy[i], c.m[i]


@kernel
def cell_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """The cells of a block of particles and images."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    c: cython.pointer(Images) = f.images
    k: cython.Py_ssize_t
    for k in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), c.count)):
        column: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (c.x[k] - f.low_x) * f.per * SIDE) + SIDE
        row: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (c.y[k] - f.low_y) * f.per) + 1
        f.place[k] = cython.cast(int32_t, row * f.columns + column)


@kernel
def lay_cells(f: cython.pointer(Fluid), blocks: cython.Py_ssize_t) -> cython.void:
    """Cells over all particles and images."""
    c: cython.pointer(Images) = f.images
    k: cython.Py_ssize_t
    f.low_x, f.low_y = INFINITY, INFINITY
    high_x: cython.double = -INFINITY
    high_y: cython.double = -INFINITY
    for k in range(blocks):
        f.low_x, high_x = min(f.low_x, c.box[4 * k]), max(high_x, c.box[4 * k + 2])
        f.low_y, high_y = min(f.low_y, c.box[4 * k + 1]), max(high_y, c.box[4 * k + 3])
    for k in range(c.owned, c.count):
        f.low_x, high_x = min(f.low_x, c.x[k]), max(high_x, c.x[k])
        f.low_y, high_y = min(f.low_y, c.y[k]), max(high_y, c.y[k])
    wide: cython.double = high_x - f.low_x
    high: cython.double = high_y - f.low_y
    # Wider cells where particles are far between: there are at most about ten cells for each.
    width: cython.double = max(max(f.support * 1.000001, sqrt(wide * high / (4 * c.count))), max(wide, high) / (2 * c.count))
    f.per = 1 / width
    f.columns = SIDE * cython.cast(cython.Py_ssize_t, wide / width) + 3 * SIDE + 1  # with empty ones on each side
    f.cells = f.columns * (cython.cast(cython.Py_ssize_t, high / width) + 3)


@kernel
def sort_fluid(f: cython.pointer(Fluid)) -> cython.bint:
    """Put particles and their images in the order of the cells. False: there is not enough room for these, or for cells."""
    c: cython.pointer(Images) = f.images
    blocks: cython.int = cython.cast(cython.int, (c.owned + BLOCK_OF_FLUID - 1) // BLOCK_OF_FLUID)
    k: cython.Py_ssize_t
    team_stage(f.threads, copy_stage, c, blocks)
    make_images(c)
    if c.count > c.room:
        return False
    lay_cells(f, blocks)
    if f.cells > f.most_cells:
        return False
    blocks = cython.cast(cython.int, (c.count + BLOCK_OF_FLUID - 1) // BLOCK_OF_FLUID)
    team_stage(f.threads, cell_stage, f, blocks)
    for k in range(f.cells + 2):
        f.begin[k] = 0
    for k in range(c.count):
        f.begin[f.place[k] + 2] += 1
    for k in range(1, f.cells):
        f.begin[k + 1] += f.begin[k]
    for k in range(c.count):
        cell: int32_t = f.place[k]
        place: int32_t = f.begin[cell + 1]
        f.begin[cell + 1] = place + 1
        f.place[k], f.cell[place], f.at[place] = place, cell, cython.cast(int32_t, k)
    for k in range(c.count, c.count + LANES):  # loaded beside the last ones, and not used
        f.x[k], f.y[k], f.vx[k], f.vy[k], f.m[k], f.share[k] = 0, 0, 0, 0, 0, 0
    team_stage(f.threads, place_stage, f, blocks)
    return True


def fluid_work(count: cython.Py_ssize_t, cells: cython.Py_ssize_t, here):
    """Arrays for so many particles and images, and cells, which may be used again: to have them anew takes longer."""
    room = count + LANES
    floats = (np.empty(n, here) for n in (*11 * (room,), 4 * (room // BLOCK_OF_FLUID + 1)))
    return *floats, *(np.empty(n, np.int32) for n in (*5 * (room,), cells + 2))
