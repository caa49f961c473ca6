# mypy: ignore-errors
"""Start and end of a frame: accelerations by gravity, and velocities at the time of the positions.

Blocks of pinned or sleeping particles that do not move are `still`: as long as nothing outside writes to them, substeps would
not change a bit, so they are skipped.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import isfinite
from cython.cimports.libc.stdint import int32_t

from pyverlet.core.cells import BLOCK
from pyverlet.core.kernels import kernel
from pyverlet.core.step import Step


@kernel
def find_still(w: cython.pointer(Step), block: cython.int, a: cython.Py_ssize_t, b: cython.Py_ssize_t) -> cython.void:
    """Find out whether a block is still, and write what substeps would write of it once."""
    moves: cython.bint = not w.falls_free or w.linked or w.cells.period_x > 0 or w.cells.period_y > 0
    for i in range(a, a if moves else b):
        moves |= w.inverse_mass[i] > 0 or w.velocity[2 * i] != 0 or w.velocity[2 * i + 1] != 0 or w.spin[i] != 0
        moves |= w.given[2 * i] != 0 or w.given[2 * i + 1] != 0 or w.given_spin[i] != 0
        moves |= isfinite(w.position[2 * i] + w.position[2 * i + 1]) == 0
    w.still[block], w.stale[block] = not moves, 0
    if moves:
        return
    zero: real = 0
    w.fastest[block] = zero
    for i in range(a, b):
        if w.tangents:
            w.motion[4 * i] = w.motion[4 * i + 1] = w.motion[4 * i + 2] = w.free_spin[i] = zero
        w.moved[2 * i] = w.position[2 * i] - w.listed[2 * i]
        w.moved[2 * i + 1] = w.position[2 * i + 1] - w.listed[2 * i + 1]
        w.since[i] = 0
        w.thrown[i] = 0


@kernel
def begin_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Prepare a block for substeps: accelerations by gravity alone, unless forces have set them, and `motion`."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    a: cython.Py_ssize_t = block * BLOCK
    b: cython.Py_ssize_t = min(a + BLOCK, w.count)
    if w.still_known and w.still[block]:
        return
    if not w.still_known:
        find_still(w, block, a, b)
    if w.falls_free:
        for i in range(a, b):
            free: cython.bint = w.inverse_mass[i] > 0
            w.acceleration[2 * i] = w.gravity_x if free else 0
            w.acceleration[2 * i + 1] = w.gravity_y if free else 0
    if w.rough:
        for i in range(a, b):
            w.motion[4 * i], w.motion[4 * i + 1] = w.velocity[2 * i], w.velocity[2 * i + 1]
            w.motion[4 * i + 2] = w.spin[i]


@kernel
def find_awake(w: cython.pointer(Step), blocks: cython.int) -> cython.void:
    """List the blocks that substeps visit: those that are not still, or all if sensors or a ledger need every particle."""
    every: cython.bint = (w.records_events and w.sensors > 0) or w.records_work
    b: int32_t
    w.awake_count = 0
    for b in range(blocks):
        w.awake[w.awake_count] = b
        w.awake_count += every or not w.still[b]


@kernel
def end_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Set velocities and spins of a block after the last substep; at the end of a frame, those at the time of the positions.

    stale: set to whether a number in it is not finite.
    """
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    a: cython.Py_ssize_t = block * BLOCK
    b: cython.Py_ssize_t = min(a + BLOCK, w.count)
    finite: cython.bint = True
    w.stale[block] = 0
    if w.still[block]:
        return
    if w.rough:
        for i in range(a, b):
            w.velocity[2 * i], w.velocity[2 * i + 1] = w.motion[4 * i], w.motion[4 * i + 1]
            w.spin[i] = w.motion[4 * i + 2]
    if w.falls_free and w.by_contacts > 0 and w.substep == w.substeps:  # the frame is complete
        for i in range(2 * a, 2 * b):
            w.acceleration[i] += w.given[i] * w.by_contacts
            w.velocity[i] += w.half * w.acceleration[i]
        if w.rough:
            for i in range(a, b):
                w.spin[i] += w.given_spin[i] * (w.half * w.by_contacts)
    for i in range(2 * a, 2 * b):
        finite &= isfinite(w.position[i] + w.velocity[i]) != 0
    w.stale[block] = cython.cast(int32_t, not finite)


@kernel
def all_finite(w: cython.pointer(Step)) -> cython.bint:
    """Whether `end_stage` found only finite numbers."""
    finite: cython.bint = True
    for b in range((w.count + BLOCK - 1) // BLOCK):
        finite &= w.stale[b] == 0
    return finite
