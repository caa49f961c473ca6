# mypy: ignore-errors
"""Linked particles that bounce from surfaces: the blow is that of all that hangs on them.

A particle alone bounces by (1 + e) v_n. Links then level out what that leaves, and of an elastic dumb-bell half of the energy was
lost. After the drift it is struck again, by what is missing, over the part of the blows so far that it has kept:
that part is its mass over the effective one, which all blows on it share as long as the links pull along the same lines.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real

from pyverlet.core.cells import BLOCK
from pyverlet.core.step import Step
from pyverlet.core.work import book_impact

REBOUND = cython.declare(cython.int, 5)
"""Numbers of a particle: the normal of its last bounce (2), the speed along it that it is to have, the speed that it had before,
and what blows have given it since, m/s."""

LEAST_KEPT = cython.declare(cython.double, 1.0 / 16)
"""Of a blow: as heavy as what makes less of it is no net taken to be."""

GOOD = cython.declare(cython.double, 1e-6)
"""Of the blow: what may be missing."""


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def note_rebound(
    w: cython.pointer(Step), i: cython.Py_ssize_t, nx: cython.double, ny: cython.double, given: cython.double
) -> cython.void:
    """Particle i has just bounced, by `given` against the normal."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    aim: cython.double = v[width * i] * nx + v[width * i + 1] * ny
    at: cython.Py_ssize_t = REBOUND * i
    w.rebound[at], w.rebound[at + 1], w.rebound[at + 2] = nx, ny, aim
    w.rebound[at + 3], w.rebound[at + 4] = aim + given, given


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def strike_late(w: cython.pointer(Step), i: cython.Py_ssize_t, dx: cython.double, dy: cython.double) -> cython.void:
    """After the drift: an impulse over the mass of particle i, which contacts do not remember."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    v[width * i] += cython.cast(real, dx)
    v[width * i + 1] += cython.cast(real, dy)
    w.free[2 * i] += cython.cast(real, dx)
    w.free[2 * i + 1] += cython.cast(real, dy)
    if w.booking:
        book_impact(w, i, dx, dy, 0, 0)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def strike_again(what: cython.p_void, block: cython.int) -> cython.void:
    """Particles of a block that links keep from leaving as fast as they should get what is missing."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    n: cython.Py_ssize_t
    w.rebounds[block] = 0
    for n in range(block * BLOCK, block * BLOCK + w.at_surface_count[block]):
        i: cython.Py_ssize_t = w.at_surface[n]
        row: cython.pointer(cython.double) = w.rebound + REBOUND * i
        now: cython.double = v[width * i] * row[0] + v[width * i + 1] * row[1]
        missing: cython.double = now - row[2]
        if row[4] > 0 and missing > GOOD * row[4]:
            more: cython.double = missing / max((row[3] - now) / row[4], LEAST_KEPT)
            strike_late(w, i, -more * row[0], -more * row[1])
            row[4] += more
            w.rebounds[block] = 1
