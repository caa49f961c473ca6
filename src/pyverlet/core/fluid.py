# mypy: ignore-errors
"""A weakly compressible fluid by smoothed particles (Monaghan 1994): what its particles do to each other.

Density is summed with the C2 kernel of Wendland (1995), which keeps particles from clumping, for neighbours within the support R:

    rho_i = sum m_j W(r_ij),    W = 7 / (pi R^2) (1 - q)^4 (1 + 4 q),    q = r / R
    p_i = c^2 max(rho_i - rho_0, 0)
    F_ij = m_i m_j ((p_i / rho_i^2 + p_j / rho_j^2) - (8 nu / rho_0) (v_ij . x_ij) / (r^2 + R^2 / 400)) (-W' / r) x_ij

The pressure is that of an energy, e(rho) = c^2 (ln(rho / rho_0) + rho_0 / rho - 1) a kilogram where rho > rho_0, and the
viscosity that of Monaghan (2005), section 4: both act along the line of centres, so that momentum and angular momentum are kept.
Particles are sorted by cells as high as the support and a quarter as wide: neighbours of one stand in three runs of memory.
"""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_reals, const_small_integers, doubles, reals, small_integers
from cython.cimports.lanes import LANES, above, choose, lanes, larger, load, real, spread, square_root, store
from cython.cimports.libc.math import INFINITY, log, sqrt
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import team_free, team_new, team_run, team_stage, thread_team

BLOCK_OF_FLUID = cython.declare(cython.Py_ssize_t, 256)
"""Particles that one thread goes through at a time."""

SIDE = cython.declare(cython.Py_ssize_t, 4)
"""Columns that the support is wide."""

PI = cython.declare(cython.double, 3.141592653589793)

Fluid = cython.struct(
    count=cython.Py_ssize_t,  # of particles and of their images beyond a seam
    owned=cython.Py_ssize_t,  # of particles
    columns=cython.Py_ssize_t,
    cell=cython.pointer(int32_t),  # (count,) of each place
    begin=cython.pointer(int32_t),  # (cells + 1,) first place of each cell
    cells=cython.Py_ssize_t,
    place=cython.pointer(int32_t),  # (count,) of each particle, and of the images after them, in the order of the cells
    owner=cython.pointer[cython.const[int32_t]],  # (count,) whose image that is; particles are their own
    x=cython.pointer(real),  # (count,) by place, as all below
    y=cython.pointer(real),
    vx=cython.pointer(real),
    vy=cython.pointer(real),
    m=cython.pointer(real),
    share=cython.pointer(real),  # p / rho^2
    at=cython.pointer(int32_t),  # (count,) which particle or image it is
    force=cython.pointer(real),  # (slots, 2) N
    on_images=cython.pointer(real),  # (count - owned, 2) N
    slot=cython.pointer[cython.const[int32_t]],  # (owned,)
    density=cython.pointer(cython.double),  # (owned,) kg/m^2
    pressure=cython.pointer(cython.double),  # (owned,) N/m
    forces=cython.bint,  # whether they are asked for
    sums=cython.pointer(real),  # (blocks, 2 LANES)
    ramp=cython.pointer(real),  # 0 to 7
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
def sum_of_lanes(a: cython.pointer(real), k: cython.Py_ssize_t) -> real:
    """Of eight numbers in memory, always in this order."""
    return ((a[k] + a[k + 4]) + (a[k + 1] + a[k + 5])) + ((a[k + 2] + a[k + 6]) + (a[k + 3] + a[k + 7]))


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def density_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Density and p / rho^2 of a block."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    one: lanes = spread(1)
    four: lanes = spread(4)
    zero: lanes = spread(0)
    ramp: lanes = load(f.ramp, 0)
    per: lanes = spread(1 / f.support)
    weight: real = cython.cast(real, 7 / (PI * f.support * f.support))
    sums: cython.Py_ssize_t = 2 * LANES * item
    none: real = 0
    i: cython.Py_ssize_t
    k: cython.Py_ssize_t
    row: cython.Py_ssize_t
    for i in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), f.count)):
        x: lanes = spread(f.x[i])
        y: lanes = spread(f.y[i])
        total: lanes = zero
        for row in range(-1, 2):
            cell: cython.Py_ssize_t = f.cell[i] + row * f.columns
            end: cython.Py_ssize_t = f.begin[cell + SIDE + 1]
            for k in range(f.begin[cell - SIDE], end, 8):
                dx: lanes = load(f.x, k) - x
                dy: lanes = load(f.y, k) - y
                q: lanes = square_root(dx * dx + dy * dy) * per
                near: lanes = larger(one - q, zero)
                mass: lanes = choose(above(spread(cython.cast(real, end - k)), ramp), load(f.m, k), zero)
                total = total + mass * (near * near) * (near * near) * (one + four * q)
        store(f.sums, sums, total)
        density: real = weight * sum_of_lanes(f.sums, sums)
        pressure: real = f.stiffness * max(density - f.rest, none)
        f.share[i] = pressure / (density * density)
        if f.at[i] < f.owned:  # no image
            f.density[f.at[i]], f.pressure[f.at[i]] = density, pressure


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def force_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Forces on a block."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    one: lanes = spread(1)
    zero: lanes = spread(0)
    ramp: lanes = load(f.ramp, 0)
    per: lanes = spread(1 / f.support)
    drag: lanes = spread(8 * f.viscosity / f.rest)
    blunt: lanes = spread(cython.cast(real, f.support * f.support * 0.0025))
    square: cython.double = f.support * f.support
    slope: real = cython.cast(real, 140 / (PI * square * square))  # -W' / r is this times (1 - q)^3
    sums: cython.Py_ssize_t = 2 * LANES * item
    i: cython.Py_ssize_t
    k: cython.Py_ssize_t
    row: cython.Py_ssize_t
    for i in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), f.count)):
        x: lanes = spread(f.x[i])
        y: lanes = spread(f.y[i])
        vx: lanes = spread(f.vx[i])
        vy: lanes = spread(f.vy[i])
        share: lanes = spread(f.share[i])
        fx: lanes = zero
        fy: lanes = zero
        for row in range(-1, 2):
            cell: cython.Py_ssize_t = f.cell[i] + row * f.columns
            end: cython.Py_ssize_t = f.begin[cell + SIDE + 1]
            for k in range(f.begin[cell - SIDE], end, 8):
                dx: lanes = x - load(f.x, k)
                dy: lanes = y - load(f.y, k)
                far: lanes = dx * dx + dy * dy
                near: lanes = larger(one - square_root(far) * per, zero)
                mass: lanes = choose(above(spread(cython.cast(real, end - k)), ramp), load(f.m, k), zero)
                meet: lanes = ((vx - load(f.vx, k)) * dx + (vy - load(f.vy, k)) * dy) / (far + blunt)
                push: lanes = mass * (near * near * near) * ((share + load(f.share, k)) - drag * meet)
                fx = fx + push * dx
                fy = fy + push * dy
        store(f.sums, sums, fx)
        store(f.sums, sums + LANES, fy)
        x_force: real = f.m[i] * (slope * sum_of_lanes(f.sums, sums))
        y_force: real = f.m[i] * (slope * sum_of_lanes(f.sums, sums + LANES))
        s: cython.Py_ssize_t = f.at[i] - f.owned
        if s < 0:
            s = 2 * f.slot[f.at[i]]
            f.force[s] += x_force
            f.force[s + 1] += y_force
        else:
            f.on_images[2 * s], f.on_images[2 * s + 1] = x_force, y_force


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def flow(what: cython.p_void, item: cython.int) -> cython.void:
    """Densities, then forces, by whoever is there."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    blocks: cython.int = cython.cast(cython.int, (f.count + BLOCK_OF_FLUID - 1) // BLOCK_OF_FLUID)
    k: cython.Py_ssize_t
    team_stage(f.threads, density_stage, what, blocks)
    for k in range(f.owned, f.count):
        f.share[f.place[k]] = f.share[f.place[f.owner[k]]]
    if f.forces:
        team_stage(f.threads, force_stage, what, blocks)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def sort_fluid(
    f: cython.pointer(Fluid), at: cython.pointer[cython.const[real]], grid: cython.pointer(cython.double)
) -> cython.void:
    """Find the place of each particle and image in the order of the cells. grid: lowest x and y, m, and rows a metre."""
    k: cython.Py_ssize_t
    for k in range(f.cells + 1):
        f.begin[k] = 0
    for k in range(f.count):
        column: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (at[2 * k] - grid[0]) * grid[2] * SIDE) + SIDE
        row: cython.Py_ssize_t = cython.cast(cython.Py_ssize_t, (at[2 * k + 1] - grid[1]) * grid[2]) + 1
        f.place[k] = cython.cast(int32_t, row * f.columns + column)
        f.begin[f.place[k] + 1] += 1
    for k in range(f.cells):
        f.begin[k + 1] += f.begin[k]
    for k in range(f.count):
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
    return *(np.empty(room, here) for _ in range(6)), *(np.empty(n, np.int32) for n in (room, room, room, 8 * room))


def flow_of_fluid(
    force,
    position,
    velocity,
    mass,
    slot,
    owner,
    support: real,
    rest: real,
    stiffness: real,
    viscosity: real,
    threads: cython.size_t,
    parts: cython.int,
    density,
    pressure,
    on_images,
    work=None,
) -> float:
    """Add the forces of a fluid; or, if `force` is None, return its energy of compression, J.

    position, velocity (k, 2): of n particles, then of images of some of them beyond a seam or a wall; owner (k,) int32 has them
    by number. slot (n,) int32: where force and mass have them. Written: density (n,) kg/m^2 and pressure (n,) N/m, float64, and
    forces on images (k - n, 2), N. work: what `fluid_work` has made for k or more, or None. threads: address
    of a team of threads, of which so many take part; 0 is none. stiffness: c^2, m^2/s^2; viscosity: nu, m^2/s.
    """  # fmt: skip
    at: cython.pointer[cython.const[real]] = const_reals(position)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    weight: cython.pointer[cython.const[real]] = const_reals(mass)
    who: cython.pointer[cython.const[int32_t]] = const_small_integers(slot)
    fluid: Fluid
    f: cython.pointer(Fluid) = cython.address(fluid)
    f.owned, f.count, f.owner, f.slot = len(slot), len(position), const_small_integers(owner), who
    f.density, f.pressure, f.forces = doubles(density), doubles(pressure), force is not None
    if f.forces:
        f.force, f.on_images = reals(force), reals(on_images)
    low_x: cython.double = INFINITY
    low_y: cython.double = INFINITY
    high_x: cython.double = -INFINITY
    high_y: cython.double = -INFINITY
    k: cython.Py_ssize_t
    i: cython.Py_ssize_t
    for k in range(f.count):
        low_x, high_x = min(low_x, at[2 * k]), max(high_x, at[2 * k])
        low_y, high_y = min(low_y, at[2 * k + 1]), max(high_y, at[2 * k + 1])
    wide: cython.double = high_x - low_x
    high: cython.double = high_y - low_y
    # Wider cells where particles are far between: there are at most about ten cells for each.
    width: cython.double = max(max(support * 1.000001, sqrt(wide * high / (4 * f.count))), max(wide, high) / (2 * f.count))
    f.columns = SIDE * cython.cast(cython.Py_ssize_t, wide / width) + 3 * SIDE + 1  # with empty ones on each side
    f.cells = f.columns * (cython.cast(cython.Py_ssize_t, high / width) + 3)
    if work is None or len(work[0]) < f.count + LANES:
        work = fluid_work(f.count, position.dtype)
    f.x, f.y, f.vx, f.vy, f.m, f.share = (
        reals(work[0]), reals(work[1]), reals(work[2]), reals(work[3]), reals(work[4]), reals(work[5]),
    )  # fmt: skip
    begin = work[9] if f.cells < len(work[9]) else np.empty(f.cells + 1, np.int32)
    f.place, f.cell, f.at, f.begin = (
        small_integers(work[6]), small_integers(work[7]), small_integers(work[8]), small_integers(begin),
    )  # fmt: skip
    here = position.dtype
    ramp, sums = np.arange(LANES).astype(here), np.empty(2 * LANES * (f.count // BLOCK_OF_FLUID + 1), here)
    corner = np.array([low_x, low_y, 1 / width])
    grid: cython.pointer(cython.double) = doubles(corner)
    f.ramp, f.sums = reals(ramp), reals(sums)
    f.support, f.rest, f.stiffness, f.viscosity = support, rest, stiffness, viscosity
    f.threads = cython.cast(cython.pointer(thread_team), threads) if threads else team_new(1)
    if f.threads == cython.NULL:
        raise MemoryError
    energy: cython.double = 0
    with cython.nogil:
        for k in range(f.count, f.count + LANES):  # loaded, with no mass
            f.x[k], f.y[k], f.vx[k], f.vy[k], f.m[k], f.share[k] = 0, 0, 0, 0, 0, 0
        sort_fluid(f, at, grid)
        for k in range(f.count):
            i = who[f.owner[k]]
            p: cython.Py_ssize_t = f.place[k]
            f.x[p], f.y[p], f.vx[p], f.vy[p], f.m[p] = at[2 * k], at[2 * k + 1], v[2 * k], v[2 * k + 1], weight[i]
        team_run(f.threads, flow, f, parts)
        if not f.forces:
            for k in range(f.owned):
                dense: cython.double = f.density[k]
                if dense > rest:
                    energy += weight[who[k]] * stiffness * (log(dense / rest) + rest / dense - 1)
        if not threads:
            team_free(f.threads)
    return energy
