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

from pyverlet.core.kernels import inlined


@inlined
def nearest_of(difference: real, period: real) -> real:
    """The image of a difference that is nearest to 0; the difference itself where the period is 0."""
    return difference - period * cython.cast(real, rint(difference / period)) if period > 0 else difference


@inlined
def nearest_in_double(difference: cython.double, period: cython.double) -> cython.double:
    """The same in float64."""
    return difference - period * rint(difference / period) if period > 0 else difference


@inlined
def wrapped(value: real, low: cython.double, period: cython.double) -> real:
    """The image of a coordinate inside the room; itself where the period is 0."""
    if period > 0 and not (value >= low and value < low + period):
        value = cython.cast(real, value - period * floor((value - low) / period))
        if value >= low + period:  # rounding
            value = cython.cast(real, value - period)
        if value < low or value >= low + period:  # one that is so far away that no place in the room is near it
            value = cython.cast(real, low)
    return value


@inlined
def wrapped_in_double(value: cython.double, low: cython.double, period: cython.double) -> cython.double:
    """The same in float64, of one that is not far away."""
    return value - period * floor((value - low) / period) if period > 0 else value


def wrap(position, low_x: cython.double, low_y: cython.double, period_x: cython.double, period_y: cython.double, out):
    """out (n, 2): the images of these positions inside the room; `out` may be `position`."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    to: cython.pointer(real) = reals(out)
    count: cython.Py_ssize_t = len(position)
    with cython.nogil:
        for i in range(count):
            to[2 * i] = wrapped(x[2 * i], low_x, period_x)
            to[2 * i + 1] = wrapped(x[2 * i + 1], low_y, period_y)
