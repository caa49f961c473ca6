# mypy: ignore-errors
"""What a frame begins and ends with: accelerations by gravity, and the velocities that belong to the positions."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import isfinite
from cython.cimports.libc.stdint import int32_t

from pyverlet.core.cells import BLOCK
from pyverlet.core.step import Step


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def begin_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """A block of particles as substeps take it: accelerations by gravity alone, unless forces have set them; `motion`."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    i: cython.Py_ssize_t
    a: cython.Py_ssize_t = block * BLOCK
    b: cython.Py_ssize_t = min(a + BLOCK, w.count)
    if w.falls_free:
        for i in range(a, b):
            free: cython.bint = w.inverse_mass[i] > 0
            w.acceleration[2 * i] = w.gravity_x if free else 0
            w.acceleration[2 * i + 1] = w.gravity_y if free else 0
    if w.rough:
        for i in range(a, b):
            w.motion[4 * i], w.motion[4 * i + 1] = w.velocity[2 * i], w.velocity[2 * i + 1]
            w.motion[4 * i + 2] = w.spin[i]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def end_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Velocities and spins of a block after its last substep; those of now, if the frame is over and no force is asked again.

    stale: whether a number in it is not finite.
    """
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    i: cython.Py_ssize_t
    a: cython.Py_ssize_t = block * BLOCK
    b: cython.Py_ssize_t = min(a + BLOCK, w.count)
    finite: cython.bint = True
    if w.rough:
        for i in range(a, b):
            w.velocity[2 * i], w.velocity[2 * i + 1] = w.motion[4 * i], w.motion[4 * i + 1]
            w.spin[i] = w.motion[4 * i + 2]
    if w.falls_free and w.by_contacts > 0:  # the frame is over
        for i in range(2 * a, 2 * b):
            w.acceleration[i] += w.given[i] * w.by_contacts
            w.velocity[i] += w.half * w.acceleration[i]
        if w.rough:
            for i in range(a, b):
                w.spin[i] += w.given_spin[i] * (w.half * w.by_contacts)
    for i in range(2 * a, 2 * b):
        finite &= isfinite(w.position[i] + w.velocity[i]) != 0
    w.stale[block] = cython.cast(int32_t, not finite)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def all_finite(w: cython.pointer(Step)) -> cython.bint:
    """Whether `end_stage` has found only finite numbers."""
    b: cython.Py_ssize_t
    finite: cython.bint = True
    for b in range((w.count + BLOCK - 1) // BLOCK):
        finite &= w.stale[b] == 0
    return finite
