# mypy: ignore-errors
"""Calls compiled user-defined functions with columns of blocks of particles, on all threads."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import column_function, const_doubles, const_reals, doubles, reals, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, isfinite
from cython.cimports.libc.stdint import int32_t

from pyverlet.core.kernels import kernel
from pyverlet.core.sharing import by_team

CALLED = cython.declare(cython.Py_ssize_t, 256)
"""Particles per call: their columns, 14 kB, stay in the L1 cache."""

Calls = cython.struct(
    function=column_function,
    t=cython.double,
    count=cython.Py_ssize_t,
    force=cython.pointer(real),  # (count, 2) N, to which the values are added
    position=cython.pointer[cython.const[real]],
    velocity=cython.pointer[cython.const[real]],
    mass=cython.pointer[cython.const[real]],
    wrong=cython.pointer(int32_t),  # (blocks,) number of particles with finite position and velocity whose values are not
)


@kernel
def call_block(what: cython.p_void, b: cython.int) -> cython.void:
    """Add the values of the function for the free particles of block b."""
    c: cython.pointer(Calls) = cython.cast(cython.pointer(Calls), what)
    given: cython.double[1280]
    values: cython.double[512]
    first: cython.Py_ssize_t = b * CALLED
    n: cython.Py_ssize_t = min(CALLED, c.count - first)
    k: cython.Py_ssize_t
    for k in range(n):
        i: cython.Py_ssize_t = first + k
        given[k], given[n + k] = c.position[2 * i], c.position[2 * i + 1]
        given[2 * n + k], given[3 * n + k] = c.velocity[2 * i], c.velocity[2 * i + 1]
        given[4 * n + k] = c.mass[i]
    c.function(given, values, n, c.t)
    wrong: int32_t = 0
    for k in range(n):
        i = first + k
        if given[4 * n + k] < INFINITY:
            c.force[2 * i] = cython.cast(real, c.force[2 * i] + values[k])
            c.force[2 * i + 1] = cython.cast(real, c.force[2 * i + 1] + values[n + k])
            if not (isfinite(values[k]) and isfinite(values[n + k])):
                wrong += (
                    isfinite(given[k]) and isfinite(given[n + k]) and isfinite(given[2 * n + k]) and isfinite(given[3 * n + k])
                )
    c.wrong[b] = wrong


def add_compiled(
    force, position, velocity, mass, address: cython.size_t, t: cython.double, threads: cython.size_t, parts: cython.int
) -> int:
    """As `add_values` with the code at this address, by `parts` threads of the team at the address `threads`."""
    own: Calls
    c: cython.pointer(Calls) = cython.address(own)
    c.function, c.t, c.count = cython.cast(column_function, address), t, len(mass)
    c.force, c.position, c.velocity, c.mass = reals(force), const_reals(position), const_reals(velocity), const_reals(mass)
    blocks: cython.int = cython.cast(cython.int, (c.count + CALLED - 1) // CALLED)
    wrong = np.zeros(blocks, np.int32)
    c.wrong = small_integers(wrong)
    with cython.nogil:
        by_team(threads, parts, call_block, c, blocks)
    return wrong.sum()


def compiled_values(columns, address: cython.size_t, t: cython.double):
    """(2, n) values of the code at this address for columns (5, n) float64 of x, y, vx, vy and mass."""
    values = np.empty((2, columns.shape[1]))
    function: column_function = cython.cast(column_function, address)
    function(const_doubles(columns), doubles(values), columns.shape[1], t)
    return values
