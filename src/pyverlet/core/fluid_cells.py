# mypy: ignore-errors
"""A fluid's particles and images in the order of cells, as high as its support and part of it wide."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.lanes import LANES, real
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import thread_team

from pyverlet.core.fluid_images import Images

BLOCK_OF_FLUID = cython.declare(cython.Py_ssize_t, 256)
"""Particles that one thread goes through at a time."""

SIDE = cython.declare(cython.Py_ssize_t, 8)
"""Columns that the support is wide."""

SPAN = cython.declare(cython.int, 24)
"""Columns that eight particles, which look at the same neighbours, may be apart."""

Fluid = cython.struct(
    images=cython.pointer(Images),  # particles, and their images
    columns=cython.Py_ssize_t,
    cell=cython.pointer(int32_t),  # (count,) of each place
    begin=cython.pointer(int32_t),  # (cells + 1,) first place of each cell
    cells=cython.Py_ssize_t,
    place=cython.pointer(int32_t),  # (count,) of each particle, and of the images after them, in the order of the cells
    x=cython.pointer(real),  # (count,) by place, as all below
    y=cython.pointer(real),
    vx=cython.pointer(real),
    vy=cython.pointer(real),
    m=cython.pointer(real),
    share=cython.pointer(real),  # p / rho^2
    at=cython.pointer(int32_t),  # (count,) which particle or image it is
    mass=cython.pointer[cython.const[real]],  # (owned,) kg
    force=cython.pointer(real),  # (slots, 2) N
    slot=cython.pointer[cython.const[int32_t]],  # (owned,)
    density=cython.pointer(cython.double),  # (owned,) kg/m^2
    pressure=cython.pointer(cython.double),  # (owned,) N/m
    forces=cython.bint,  # whether they are asked for
    support=real,
    rest=real,
    stiffness=real,
    viscosity=real,
    threads=cython.pointer(thread_team),
)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def group_end(f: cython.pointer(Fluid), first: cython.Py_ssize_t, stop: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Where a group ends that begins at this place: at most eight, all in a row of cells, and not far apart."""
    row: cython.Py_ssize_t = f.cell[first] // f.columns
    end: cython.Py_ssize_t = min(min(first + LANES, stop), f.begin[(row + 1) * f.columns])
    while f.cell[end - 1] - f.cell[first] > SPAN:
        end -= 1
    return end


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def place_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Copy a block to its places."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    c: cython.pointer(Images) = f.images
    k: cython.Py_ssize_t
    for k in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), c.count)):
        i: cython.Py_ssize_t = f.at[k]
        f.x[k], f.y[k], f.m[k] = c.place[2 * i], c.place[2 * i + 1], f.mass[c.owner[i]]
        f.vx[k], f.vy[k] = c.velocity[2 * i], c.velocity[2 * i + 1]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def sort_fluid(f: cython.pointer(Fluid), low_x: cython.double, low_y: cython.double, per: cython.double) -> cython.void:
    """Find the place of each particle and image in the order of the cells. per: rows a metre."""
    at: cython.pointer(real) = f.images.place
    k: cython.Py_ssize_t
    for k in range(f.cells + 1):
        f.begin[k] = 0
    for k in range(f.images.count):
        column: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (at[2 * k] - low_x) * per * SIDE) + SIDE
        row: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (at[2 * k + 1] - low_y) * per) + 1
        f.place[k] = cython.cast(int32_t, row * f.columns + column)
        f.begin[f.place[k] + 1] += 1
    for k in range(f.cells):
        f.begin[k + 1] += f.begin[k]
    for k in range(f.images.count):
        cell: int32_t = f.place[k]
        f.place[k] = f.begin[cell]
        f.cell[f.place[k]] = cell
        f.at[f.place[k]] = cython.cast(int32_t, k)
        f.begin[cell] += 1
    for k in range(f.cells, 0, -1):
        f.begin[k] = f.begin[k - 1]
    f.begin[0] = 0


def fluid_work(count: cython.Py_ssize_t, here):
    """Arrays for so many particles and images of this dtype, which may be used again: to have them anew takes longer."""
    room = count + LANES
    floats = (np.empty(n, here) for n in (*6 * (room,), 2 * room, 2 * room))
    return *floats, *(np.empty(n, np.int32) for n in (*5 * (room,), 20 * room))
