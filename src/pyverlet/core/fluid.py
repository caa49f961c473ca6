# mypy: ignore-errors
"""A weakly compressible fluid by smoothed particle hydrodynamics (Monaghan 1994): density, pressure and viscosity.

Density is summed with the C2 kernel of Wendland (1995), which keeps particles from clumping, for neighbours within the support R:

    rho_i = sum m_j W(r_ij),    W = 7 / (pi R^2) (1 - q)^4 (1 + 4 q),    q = r / R
    p_i = c^2 max(rho_i - rho_0, 0)
    F_ij = m_i m_j ((p_i / rho_i^2 + p_j / rho_j^2) - (8 nu / rho_0) (v_ij . x_ij) / (r^2 + R^2 / 400)) (-W' / r) x_ij

The pressure derives from an energy, e(rho) = c^2 (ln(rho / rho_0) + rho_0 / rho - 1) per kilogram where rho > rho_0; the
viscosity is that of Monaghan (2005), section 4. Both act along the line of centres, which conserves momentum and angular
momentum. Particles are sorted by cells as high as the support and a quarter as wide: neighbours of eight consecutive particles
in a row are three contiguous ranges of memory, which all eight read together.
"""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_doubles, const_reals, const_small_integers, doubles, reals, small_integers
from cython.cimports.lanes import LANES, lanes, larger, load, real, spread, square_root, store
from cython.cimports.libc.math import log
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import team_run, team_stage, thread_team

from pyverlet.core.fluid_images import BLOCK_OF_FLUID, SIDE, Fluid, cell_above, sort_fluid
from pyverlet.core.kernels import inlined, kernel

PI = cython.declare(cython.double, 3.141592653589793)

SPAN = cython.declare(cython.int, 12)
"""Most columns between the first and the last of eight particles that share a neighbour list."""


@inlined
def group_end(f: cython.pointer(Fluid), first: cython.Py_ssize_t, stop: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """End of the group that begins at this place: at most eight particles, in one row of cells, and close together."""
    row: cython.Py_ssize_t = f.cell[first] // f.columns
    end: cython.Py_ssize_t = min(min(first + LANES, stop), f.begin[(row + 1) * f.columns])
    while f.cell[end - 1] - f.cell[first] > SPAN:
        end -= 1
    return end


@kernel
def place_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Copy a block to its places in cell order."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    per: real = 1 / f.support
    drag: real = 8 * f.viscosity / f.rest * per
    k: cython.Py_ssize_t
    for k in range(BLOCK_OF_FLUID * item, min(BLOCK_OF_FLUID * (item + 1), f.count)):
        i: cython.Py_ssize_t = f.at[k]
        f.sx[k], f.sy[k], f.su[k], f.sv[k], f.sm[k] = per * f.x[i], per * f.y[i], drag * f.vx[i], drag * f.vy[i], f.m[i]


@kernel
def density_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Density and p / rho^2 of a block."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    one: lanes = spread(1)
    zero: lanes = spread(0)
    weight: cython.double = 7 / (PI * f.support * f.support)
    five: lanes = spread(cython.cast(real, 5 * weight))
    four: lanes = spread(cython.cast(real, 4 * weight))
    sums: real[8]
    none: real = 0
    i: cython.Py_ssize_t = BLOCK_OF_FLUID * item
    k: cython.Py_ssize_t
    row: cython.Py_ssize_t
    stop: cython.Py_ssize_t = min(i + BLOCK_OF_FLUID, f.count)
    while i < stop:
        end: cython.Py_ssize_t = group_end(f, i, stop)
        x: lanes = load(f.sx, i)
        y: lanes = load(f.sy, i)
        fourth: lanes = zero  # 1 + 4 q = 5 - 4 (1 - q)
        fifth: lanes = zero
        for row in range(-1, 2):
            first: cython.Py_ssize_t = f.begin[cell_above(f, f.cell[i], row) - SIDE]
            for k in range(first, f.begin[cell_above(f, f.cell[end - 1], row) + SIDE + 1]):
                dx: lanes = spread(f.sx[k]) - x
                dy: lanes = spread(f.sy[k]) - y
                near: lanes = larger(one - square_root(dx * dx + dy * dy), zero)
                square: lanes = near * near
                power: lanes = spread(f.sm[k]) * (square * square)
                fourth = fourth + power
                fifth = fifth + power * near
        store(sums, 0, five * fourth - four * fifth)
        for k in range(i, end):
            density: real = sums[k - i]
            pressure: real = f.stiffness * max(density - f.rest, none)
            f.share[k] = pressure / (density * density)
            if f.at[k] < f.owned:  # not an image
                f.density[f.at[k]], f.pressure[f.at[k]] = density, pressure
        i = end


@kernel
def force_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Compute the forces on a block."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    one: lanes = spread(1)
    zero: lanes = spread(0)
    blunt: lanes = spread(0.0025)
    slope: lanes = spread(cython.cast(real, 140 / (PI * f.support * f.support * f.support)))  # -W' / q is this times (1 - q)^3
    x_sums: real[8]
    y_sums: real[8]
    i: cython.Py_ssize_t = BLOCK_OF_FLUID * item
    k: cython.Py_ssize_t
    row: cython.Py_ssize_t
    stop: cython.Py_ssize_t = min(i + BLOCK_OF_FLUID, f.count)
    while i < stop:
        end: cython.Py_ssize_t = group_end(f, i, stop)
        x: lanes = load(f.sx, i)
        y: lanes = load(f.sy, i)
        vx: lanes = load(f.su, i)
        vy: lanes = load(f.sv, i)
        share: lanes = load(f.share, i)
        fx: lanes = zero
        fy: lanes = zero
        for row in range(-1, 2):
            first: cython.Py_ssize_t = f.begin[cell_above(f, f.cell[i], row) - SIDE]
            for k in range(first, f.begin[cell_above(f, f.cell[end - 1], row) + SIDE + 1]):
                dx: lanes = x - spread(f.sx[k])
                dy: lanes = y - spread(f.sy[k])
                far: lanes = dx * dx + dy * dy
                near: lanes = larger(one - square_root(far), zero)
                drag: lanes = ((vx - spread(f.su[k])) * dx + (vy - spread(f.sv[k])) * dy) / (far + blunt)
                push: lanes = (spread(f.sm[k]) * near) * (near * near) * ((share + spread(f.share[k])) - drag)
                fx = fx + push * dx
                fy = fy + push * dy
        mass: lanes = slope * load(f.sm, i)
        store(x_sums, 0, mass * fx)
        store(y_sums, 0, mass * fy)
        for k in range(i, end):
            at: int32_t = f.at[k]
            if at < f.owned:
                f.force[2 * f.sorted_index[at]] += x_sums[k - i]
                f.force[2 * f.sorted_index[at] + 1] += y_sums[k - i]
            else:
                f.x[at], f.y[at] = x_sums[k - i], y_sums[k - i]  # their memory can be reused
        i = end


@kernel
def flow(what: cython.p_void, item: cython.int) -> cython.void:
    """Compute densities, then forces, with all threads of the team."""
    f: cython.pointer(Fluid) = cython.cast(cython.pointer(Fluid), what)
    k: cython.Py_ssize_t
    f.sorted = sort_fluid(f)
    if not f.sorted:
        return
    blocks: cython.int = cython.cast(cython.int, (f.count + BLOCK_OF_FLUID - 1) // BLOCK_OF_FLUID)
    team_stage(f.threads, place_stage, what, blocks)
    team_stage(f.threads, density_stage, what, blocks)
    if not f.forces:
        return
    for k in range(f.owned, f.count):
        f.share[f.place[k]] = f.share[f.place[f.owner[k]]]
    team_stage(f.threads, force_stage, what, blocks)
    for k in range(f.owned, f.count):
        if f.struck[k] >= 0:
            f.force[2 * f.struck[k]] += f.x[k]
            f.force[2 * f.struck[k] + 1] += f.y[k]


def flow_of_fluid(
    force, position, velocity, mass, sorted_index, mirrors, periodic, support: real, rest: real, stiffness: real, viscosity: real,
    threads: cython.size_t, parts: cython.int, density, pressure, work,
):  # fmt: skip
    """Add the forces of a fluid to `force`, if that is not None, and write its densities and pressures.

    mass (n,) of its particles; row (n,) int32: their rows in position, velocity and force (n, 2). mirrors (k, MIRROR)
    float64, see `core.fluid_images`; a mirror that is a particle receives the pressure on it. periodic: lowest x and y and
    periods, m. Written: density (n,) kg/m^2 and pressure (n,) N/m, float64. threads, parts: address of a thread team and the
    number of threads to use; 0 for none. stiffness: c^2, m^2/s^2; viscosity: nu, m^2/s. work: a list that keeps arrays between
    calls, as allocating them takes longer.
    """
    fluid: Fluid
    f: cython.pointer(Fluid) = cython.address(fluid)
    f.mass, f.sorted_index = const_reals(mass), const_small_integers(sorted_index)
    f.owned, f.mirrors, f.mirror = len(sorted_index), len(mirrors), const_doubles(mirrors)
    f.position, f.velocity = const_reals(position), const_reals(velocity)
    corner = np.array(periodic, float)
    f.periodic = const_doubles(corner)
    f.density, f.pressure, f.forces = doubles(density), doubles(pressure), force is not None
    if f.forces:
        f.force = reals(force)
    f.support, f.rest, f.stiffness, f.viscosity = support, rest, stiffness, viscosity
    f.threads = cython.cast(cython.pointer(thread_team), threads)
    f.count, f.cells, f.sorted = f.owned, 20 * f.owned, False
    while not f.sorted:
        if not work or work[0].dtype != position.dtype or len(work[0]) < f.count + LANES or len(work[17]) < f.cells + 2:
            capacity = f.count * 5 // 4 + LANES
            floats = *11 * (capacity,), 4 * (capacity // BLOCK_OF_FLUID + 1)
            work[:] = [np.empty(n, position.dtype) for n in floats] + [np.empty(capacity, np.int32) for _ in range(5)]
            work.append(np.empty(max(f.cells * 5 // 4, 20 * f.count) + 2, np.int32))
        f.capacity, f.most_cells = len(work[0]) - LANES, len(work[17]) - 2
        f.sx, f.sy, f.su, f.sv, f.sm, f.share, f.x, f.y, f.vx, f.vy, f.m, f.box = (
            reals(work[0]), reals(work[1]), reals(work[2]), reals(work[3]), reals(work[4]), reals(work[5]), reals(work[6]),
            reals(work[7]), reals(work[8]), reals(work[9]), reals(work[10]), reals(work[11]),
        )  # fmt: skip
        f.owner, f.struck, f.place, f.cell, f.at, f.begin = (
            small_integers(work[12]), small_integers(work[13]), small_integers(work[14]), small_integers(work[15]),
            small_integers(work[16]), small_integers(work[17]),
        )  # fmt: skip
        with cython.nogil:
            team_run(f.threads, flow, f, parts)


def energy_of_fluid(density, mass, rest: cython.double, stiffness: cython.double) -> float:
    """Energy of compression, J. density (n,) float64, NaN for particles that are not fluid; mass (n,)."""
    dense: cython.pointer[cython.const[cython.double]] = const_doubles(density)
    m: cython.pointer[cython.const[real]] = const_reals(mass)
    energy: cython.double = 0
    k: cython.Py_ssize_t
    for k in range(len(mass)):
        if dense[k] > rest:
            energy += m[k] * stiffness * (log(dense[k] / rest) + rest / dense[k] - 1)
    return energy
