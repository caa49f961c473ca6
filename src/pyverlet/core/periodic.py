# mypy: ignore-errors
"""Periodic rooms: particles that leave on one side enter on the other.

A period is (x, y), m; 0 along axes without. Within a frame positions continue beyond the room; a difference of two positions
means its image nearest to 0.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import floor, rint

from pyverlet.core.kernels import inlined


@inlined
def nearest_of(difference: real, period: real) -> real:
    """The image of a difference nearest to 0; unchanged if the period is 0."""
    return difference - period * cython.cast(real, rint(difference / period)) if period > 0 else difference


@inlined
def nearest_in_double(difference: cython.double, period: cython.double) -> cython.double:
    """`nearest_of` in float64."""
    return difference - period * rint(difference / period) if period > 0 else difference


@inlined
def wrapped(value: real, low: cython.double, period: cython.double) -> real:
    """The image of a coordinate inside the room; unchanged if the period is 0."""
    if period > 0 and not (value >= low and value < low + period):
        value = cython.cast(real, value - period * floor((value - low) / period))
        if value >= low + period:  # by rounding
            value = cython.cast(real, value - period)
        if value < low or value >= low + period:  # too far away for any image to be near
            value = cython.cast(real, low)
    return value


@inlined
def wrapped_in_double(value: cython.double, low: cython.double, period: cython.double) -> cython.double:
    """`wrapped` in float64, for coordinates that are not far away."""
    return value - period * floor((value - low) / period) if period > 0 else value


def wrap(position, low_x: cython.double, low_y: cython.double, period_x: cython.double, period_y: cython.double, out):
    """Write the images of these positions inside the room to `out` (n, 2), which may be `position`."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    to: cython.pointer(real) = reals(out)
    count: cython.Py_ssize_t = len(position)
    with cython.nogil:
        for i in range(count):
            to[2 * i] = wrapped(x[2 * i], low_x, period_x)
            to[2 * i + 1] = wrapped(x[2 * i + 1], low_y, period_y)
