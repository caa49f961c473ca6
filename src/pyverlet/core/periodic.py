# mypy: ignore-errors
"""Periodic rooms: what leaves on one side comes in on the other.

A period is (x, y), m; 0 in a direction that has none. Within a frame positions run on beyond the room; a difference of two of
them stands for its image that is nearest to 0.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import floor, rint


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def nearest_of(difference: real, period: real) -> real:
    """The image of a difference that is nearest to 0; the difference itself where the period is 0."""
    return difference - period * cython.cast(real, rint(difference / period)) if period > 0 else difference


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def nearest_in_double(difference: cython.double, period: cython.double) -> cython.double:
    """The same in float64."""
    return difference - period * rint(difference / period) if period > 0 else difference


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def inside(x: real, low: real, period: real) -> real:
    """The image of x from `low` on, and below low + period."""
    if not period > 0 or (low <= x and x < low + period):
        return x
    x = x - period * cython.cast(real, floor((x - low) / period))
    if x >= low + period:  # rounding
        x = x - period
    return low if x < low else x


def wrap(position, low_x: real, low_y: real, period_x: real, period_y: real, out):
    """out (n, 2): the images of these positions inside the room; `out` may be `position`."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    to: cython.pointer(real) = reals(out)
    count: cython.Py_ssize_t = len(position)
    i: cython.Py_ssize_t
    with cython.nogil:
        for i in range(count):
            to[2 * i] = inside(x[2 * i], low_x, period_x)
            to[2 * i + 1] = inside(x[2 * i + 1], low_y, period_y)
