# mypy: ignore-errors
"""Positions in a periodic room: inside it between frames, near those of the pair list within one."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import rint

from pyverlet.core.cells import Cells
from pyverlet.core.periodic import wrapped
from pyverlet.core.step import Step


@cython.cfunc
def follow_images(w: cython.pointer(Step), crossed: cython.pointer(cython.double)):
    """Move positions to the images nearest to those of the last list check; the shift back, m, is added to `crossed` (n, 2).

    Positions far away are wrapped into the room, since digits are lost there, and the list is made anew.
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
    """Wrap all positions into a periodic room; the shift back, whole periods in m, is added to `crossed` (n, 2)."""
    c: cython.pointer(Cells) = w.cells
    axis: cython.int
    for axis in range(2):
        period: cython.double = c.period_y if axis else c.period_x
        low: cython.double = c.low_y if axis else c.low_x
        for i in range(w.count if period > 0 else 0):
            x: real = w.position[2 * i + axis]
            inside: real = wrapped(x, low, period)
            if inside != x:  # also for NaN
                w.position[2 * i + axis] = inside
                crossed[2 * i + axis] += period * rint((cython.cast(cython.double, x) - inside) / period)
