# mypy: ignore-errors
"""The energy of all particles in float64: sums over blocks of a fixed size, added in order."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_reals, doubles
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY

from pyverlet.core.kernels import kernel
from pyverlet.core.sharing import by_team

BLOCK_SUMMED = cython.declare(cython.Py_ssize_t, 2048)  # particles per block


@kernel
def block_energy(
    x: cython.pointer[cython.const[real]],
    v: cython.pointer[cython.const[real]],
    a: cython.pointer[cython.const[real]],
    lag: cython.double,
    spin: cython.pointer[cython.const[real]],
    radius: cython.pointer[cython.const[real]],
    mass: cython.pointer[cython.const[real]],
    gx: cython.double,
    gy: cython.double,
    first: cython.Py_ssize_t,
    stop: cython.Py_ssize_t,
) -> cython.double:
    """Energy, J, of the particles from `first` up to `stop`; eight partial sums hide the latency of additions."""
    sums: cython.double[8]
    lane: cython.Py_ssize_t
    whole: cython.Py_ssize_t = stop - (stop - first) % 8
    half: cython.double = 0.5
    quarter: cython.double = 0.25
    for lane in range(8):
        sums[lane] = 0
    for k in range(first, whole, 8):
        for lane in range(8):
            i: cython.Py_ssize_t = k + lane
            m: cython.double = mass[i]
            vx: cython.double = v[2 * i]
            vy: cython.double = v[2 * i + 1]
            if lag != 0:
                vx = vx + lag * a[2 * i]
                vy = vy + lag * a[2 * i + 1]
            height: cython.double = gx * x[2 * i] + gy * x[2 * i + 1]
            rim: cython.double = cython.cast(cython.double, radius[i]) * spin[i]
            m = m if m < INFINITY else 0  # pinned particles count as 0
            sums[lane] = sums[lane] + m * ((half * (vx * vx + vy * vy) + quarter * rim * rim) - height)
    total: cython.double = 0.0
    for lane in range(8):
        total += sums[lane]
    for k in range(whole, stop):
        m = mass[k]
        if m < INFINITY:
            vx = v[2 * k]
            vy = v[2 * k + 1]
            if lag != 0:
                vx += lag * a[2 * k]
                vy += lag * a[2 * k + 1]
            height = gx * x[2 * k] + gy * x[2 * k + 1]
            rim = cython.cast(cython.double, radius[k]) * spin[k]
            total += m * (half * (vx * vx + vy * vy) + quarter * rim * rim - height)
    return total


Summed = cython.struct(
    count=cython.Py_ssize_t,
    x=cython.pointer[cython.const[real]],
    v=cython.pointer[cython.const[real]],
    a=cython.pointer[cython.const[real]],
    lag=cython.double,
    spin=cython.pointer[cython.const[real]],
    radius=cython.pointer[cython.const[real]],
    mass=cython.pointer[cython.const[real]],
    gx=cython.double,
    gy=cython.double,
    sums=cython.p_double,  # (blocks,) J
)


@kernel
def energy_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Compute the sum of a block."""
    b: cython.pointer(Summed) = cython.cast(cython.pointer(Summed), what)
    first: cython.Py_ssize_t = block * BLOCK_SUMMED
    stop: cython.Py_ssize_t = min(first + BLOCK_SUMMED, b.count)
    b.sums[block] = block_energy(b.x, b.v, b.a, b.lag, b.spin, b.radius, b.mass, b.gx, b.gy, first, stop)


@cython.cfunc
def sum_of_blocks(
    position, velocity, acceleration, lag: cython.double, spin, radius, mass, gx: cython.double, gy: cython.double,
    threads: cython.size_t, parts: cython.int,
) -> cython.double:  # fmt: skip
    """Add the sums of blocks, by a team at this address; 0: on this thread alone."""
    own: Summed
    b: cython.pointer(Summed) = cython.address(own)
    b.x, b.v, b.a = const_reals(position), const_reals(velocity), const_reals(acceleration)
    b.spin, b.radius, b.mass = const_reals(spin), const_reals(radius), const_reals(mass)
    b.count, b.lag, b.gx, b.gy = len(mass), lag, gx, gy
    blocks: cython.int = cython.cast(cython.int, (b.count + BLOCK_SUMMED - 1) // BLOCK_SUMMED)
    total: cython.double = 0.0
    if blocks == 1:
        return block_energy(b.x, b.v, b.a, b.lag, b.spin, b.radius, b.mass, b.gx, b.gy, 0, b.count)
    partial = np.empty(blocks)
    b.sums = doubles(partial)
    with cython.nogil:
        by_team(threads, parts, energy_stage, b, blocks)
        for block in range(blocks):
            total += b.sums[block]
    return total


def total_energy(
    position, velocity, acceleration, lag: cython.double, spin, radius, mass, gx: cython.double, gy: cython.double
) -> float:
    """Energy of motion, spin and gravity (0 at the origin), J, with velocities advanced by `lag` s; without pinned particles."""
    return sum_of_blocks(position, velocity, acceleration, lag, spin, radius, mass, gx, gy, 0, 1)


def energy_gained(
    start, now, gx: cython.double, gy: cython.double, threads: cython.size_t = 0, parts: cython.int = 1
) -> float:  # fmt: skip
    """The increase of `total_energy` from `start` to `now`, J.

    start, now: position, velocity (n, 2), spin, radius, mass (n,) each, of the same particles in any order. threads, parts:
    address of a team, or 0, and the number of its threads to use.
    """
    before: cython.double = sum_of_blocks(start[0], start[1], start[1], 0.0, start[2], start[3], start[4], gx, gy, threads, parts)
    return sum_of_blocks(now[0], now[1], now[1], 0.0, now[2], now[3], now[4], gx, gy, threads, parts) - before
