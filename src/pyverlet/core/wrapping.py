# mypy: ignore-errors
"""Places in a periodic room: inside it between frames, and where the list of pairs was made within one."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import rint

from pyverlet.core.cells import Cells
from pyverlet.core.periodic import wrapped
from pyverlet.core.step import Step


@cython.cfunc
def follow_images(w: cython.pointer(Step), crossed: cython.pointer(cython.double)):
    """Places become the images nearest to where the list was last looked at; the way back, m, is added to `crossed` (n, 2).

    Those that have come far are put inside the room, and the list is to be made anew: far away digits are lost.
    """
    c: cython.pointer(Cells) = w.cells
    axis: cython.int
    too_far: cython.bint = False
    for axis in range(2):
        period: cython.double = c.period_y if axis else c.period_x
        low: cython.double = c.low_y if axis else c.low_x
        if period > 0 and w.lists.good:
            for i in range(w.count):
                away: cython.double = cython.cast(cython.double, w.position[2 * i + axis]) - w.checked[2 * i + axis]
                periods: cython.double = rint(away / period)
                if periods != 0:
                    w.position[2 * i + axis] = cython.cast(real, w.position[2 * i + axis] - period * periods)
                    crossed[2 * i + axis] += period * periods
                far: cython.double = w.position[2 * i + axis] - low
                too_far |= far > 1.5 * period or far < -0.5 * period
    if too_far:
        w.lists.good = False
        wrap_positions(w, crossed)


@cython.cfunc
def wrap_positions(w: cython.pointer(Step), crossed: cython.pointer(cython.double)):
    """Put all places inside a periodic room; the way back, whole periods in m, is added to `crossed` (n, 2)."""
    c: cython.pointer(Cells) = w.cells
    axis: cython.int
    for axis in range(2):
        period: cython.double = c.period_y if axis else c.period_x
        low: cython.double = c.low_y if axis else c.low_x
        for i in range(w.count if period > 0 else 0):
            x: real = w.position[2 * i + axis]
            inside: real = wrapped(x, low, period)
            if inside != x:  # NaN, too
                w.position[2 * i + axis] = inside
                crossed[2 * i + axis] += period * rint((cython.cast(cython.double, x) - inside) / period)
