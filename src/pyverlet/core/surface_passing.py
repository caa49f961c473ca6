# mypy: ignore-errors
"""Which particles pass a surface: those that have bounced, or are so fast that they would have bounced, are not held."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.event_recording import least_bounce
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.obstacles import LATE, SEGMENT
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import BEND, GAP, NORMAL, NORMAL_Y, RUNS, SIDES, SPEED, SPEED_Y, row_of
from pyverlet.core.surface_shapes import Spot, spot_of


@inlined
def ends_inside(w: cython.pointer(Step), first: cython.Py_ssize_t, ux: cython.double, uy: cython.double) -> cython.bint:
    """Whether a straight path with (ux, uy) relative to a round obstacle ends inside it: bounces around it would not converge."""
    row: cython.pointer(cython.double) = w.contact
    if row[first + BEND] >= 0:
        return False
    reach: cython.double = -1 / row[first + BEND]
    nx: cython.double = row[first + NORMAL]
    ny: cython.double = row[first + NORMAL_Y]
    x: cython.double = (row[first + GAP] + reach) * nx - (ux + row[first + RUNS] * ny) * w.h
    y: cython.double = (row[first + GAP] + reach) * ny - (uy - row[first + RUNS] * nx) * w.h
    return x * x + y * y < reach * reach


@kernel
def leaves(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t) -> cython.bint:
    """Whether particle i, which has bounced, ends the substep clear of the obstacle of contact k.

    The end of its path decides: its extrapolated start may be inside the obstacle or on the other side.
    """
    at: cython.Py_ssize_t = SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    p: Spot = spot_of(w, i, at, LATE)
    c: cython.double = p.c
    s: cython.double = p.s
    x: cython.double = p.x + w.h * (c * v[width * i] + s * v[width * i + 1])
    y: cython.double = p.y + w.h * (c * v[width * i + 1] - s * v[width * i])
    x -= min(max(x, 0.0), p.length)
    return x * x + y * y > p.reach * p.reach


@inlined
def passes_by(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, vx: cython.double, vy: cython.double
) -> cython.bint:
    """Whether particle i is so fast that, if it meets the obstacle of contact k at all, it has already bounced."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    if 0 <= w.surface[k] < SIDES:
        return False
    if w.since[i] > 0 and w.surface[k] >= SIDES and leaves(w, i, k):
        return True
    nx: cython.double = row[first + NORMAL]
    ny: cython.double = row[first + NORMAL_Y]
    ux: cython.double = vx - row[first + SPEED]
    uy: cython.double = vy - row[first + SPEED_Y]
    least: cython.double = least_bounce(w, i)
    if ux * nx + uy * ny <= least:
        return False
    free: cython.double = (w.free[2 * i] - row[first + SPEED]) * nx + (w.free[2 * i + 1] - row[first + SPEED_Y]) * ny
    return free > least and not ends_inside(w, first, ux, uy)
