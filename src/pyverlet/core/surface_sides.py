# mypy: ignore-errors
"""Lines have two sides: nobody gets to the other one by impacts that were not resolved in the order of their times.

A pair may meet before one of the two has met a line, and be solved after: its path is then another than that which bounced.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.cells import wrapped
from pyverlet.core.obstacles import FACES, LENGTH, PLACE, ROUNDING, SEGMENT
from pyverlet.core.step import Step
from pyverlet.core.surface_shapes import SIDES


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def keep_side(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """If the way of particle i from the beginning of the substep to its end crosses a line, it ends on it, on its own side."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    k: cython.Py_ssize_t
    if not w.thrown[i]:
        return
    for k in range(w.contact_begin[i], w.contact_end[i]):
        at: cython.Py_ssize_t = SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)
        if at < 0 or w.segment[at + FACES] > 0:
            continue
        c: cython.double = w.segment[at + PLACE + 2]
        s: cython.double = w.segment[at + PLACE + 3]
        # Places are taken as one: in a periodic room both are shifted alike.
        x: cython.double = w.begun[2 * i]
        y: cython.double = w.begun[2 * i + 1]
        dx: cython.double = w.position[2 * i] + cython.cast(cython.double, v[width * i]) * w.h - x
        dy: cython.double = w.position[2 * i + 1] + cython.cast(cython.double, v[width * i + 1]) * w.h - y
        ox: cython.double = wrapped(cython.cast(real, x), w.cells.low_x, w.cells.period_x) - w.segment[at + PLACE]
        oy: cython.double = wrapped(cython.cast(real, y), w.cells.low_y, w.cells.period_y) - w.segment[at + PLACE + 1]
        along: cython.double = c * ox + s * oy
        across: cython.double = c * oy - s * ox
        gone: cython.double = c * dy - s * dx
        if across * (across + gone) >= 0:
            continue
        crossed: cython.double = along - across / gone * (c * dx + s * dy)
        if crossed < 0 or crossed > w.segment[at + LENGTH]:
            continue
        side: cython.double = 1.0 if across > 0 else -1.0
        wanted: cython.double = side * (w.segment[at + ROUNDING] + w.radius[i])
        # To there across the line, and at rest against it.
        rate: cython.double = c * v[width * i + 1] - s * v[width * i]
        back: cython.double = wanted - (across + gone) + (rate * w.h if rate * side < 0 else 0.0)
        if rate * side < 0:
            v[width * i] += cython.cast(real, rate * s)
            v[width * i + 1] -= cython.cast(real, rate * c)
            w.free[2 * i] += cython.cast(real, rate * s)
            w.free[2 * i + 1] -= cython.cast(real, rate * c)
        w.position[2 * i] -= cython.cast(real, back * s)
        w.position[2 * i + 1] += cython.cast(real, back * c)
        w.moved[2 * i] -= cython.cast(real, back * s)
        w.moved[2 * i + 1] += cython.cast(real, back * c)
