# mypy: ignore-errors
"""Converts arrays for a page: in the user's order, to float32 or to a 16-bit grid."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, const_singles, const_small_integers, shorts, singles
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, int64_t, uint16_t

from pyverlet.core.kernels import inlined


def copy_moving(position, velocity, acceleration, lag: real, to_position, to_velocity):
    """Copy (n, 2) positions, and velocities advanced by `lag` seconds, to float32."""
    p: cython.pointer[cython.const[real]] = const_reals(position)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    a: cython.pointer[cython.const[real]] = const_reals(acceleration)
    to_p: cython.p_float = singles(to_position)
    to_v: cython.p_float = singles(to_velocity)
    count: int64_t = len(position)
    with cython.nogil:
        for k in range(count):
            to_p[2 * k] = p[2 * k]
            to_p[2 * k + 1] = p[2 * k + 1]
            to_v[2 * k] = v[2 * k] + lag * a[2 * k]
            to_v[2 * k + 1] = v[2 * k + 1] + lag * a[2 * k + 1]


def put_rows(out, rows, index):
    """out[index[k]] = rows[k] for (n, 2) arrays of float32, three times as fast as NumPy."""
    to: cython.p_float = singles(out)
    from_: cython.pointer[cython.const[cython.float]] = const_singles(rows)
    at: cython.pointer[cython.const[int32_t]] = const_small_integers(index)
    count: int64_t = len(index)
    with cython.nogil:
        for k in range(count):
            i: int64_t = at[k]
            to[2 * i] = from_[2 * k]
            to[2 * i + 1] = from_[2 * k + 1]


@inlined
def count_of(place: cython.float, largest: cython.float) -> uint16_t:
    """Truncate to an integer from 0 to largest; 0 for NaN, whose comparisons are false."""
    kept: cython.float = place if place < largest else largest
    return cython.cast(uint16_t, kept) if place > 0 else 0


def quantize(
    position, x0: cython.float, y0: cython.float, scale_x: cython.float, scale_y: cython.float, largest: cython.float, grid
):
    """Fill `grid` (n, 2), uint16, with (position - (x0, y0)) scale, rounded and clamped to 0 .. `largest`.

    One pass over position, (n, 2) float32; NumPy needs seven, and six times as long.
    """
    p: cython.pointer[cython.const[cython.float]] = const_singles(position)
    to: cython.pointer[uint16_t] = shorts(grid)
    half: cython.float = 0.5
    count: int64_t = len(position)
    with cython.nogil:
        for i in range(count):
            to[2 * i] = count_of((p[2 * i] - x0) * scale_x + half, largest)
            to[2 * i + 1] = count_of((p[2 * i + 1] - y0) * scale_y + half, largest)
