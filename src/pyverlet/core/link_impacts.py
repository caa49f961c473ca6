# mypy: ignore-errors
"""Passes impacts on linked particles on to everything that rigid links join to them, before links are solved for their lengths.

An impact changes velocities by a field that no rigid row may feel: the field that is left after relaxing the rows, along the
directions at the time of impact. These impulses of rows are no load, and are not repeated.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, sqrt

from pyverlet.core.cells import BLOCK
from pyverlet.core.impacts import move_path
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import DISTANCE, MOTOR, Links
from pyverlet.core.link_blocks import relax_row
from pyverlet.core.link_chains import CHORDS, step_chain
from pyverlet.core.link_shapes import LinkWay, way_between
from pyverlet.core.link_warm_start import add_warm_between
from pyverlet.core.links import each_colour
from pyverlet.core.rebounds import IMPACT
from pyverlet.core.step import Step
from pyverlet.core.work import add_impact_work


@kernel
def begin_impact_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """Save the impulses of the rows of a chunk."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        k.saved[r] = k.impulse[r]
        k.had[2 * r], k.had[2 * r + 1] = k.given[2 * r], k.given[2 * r + 1]


@kernel
def take_times(what: cython.p_void, block: cython.int) -> cython.void:
    """Set the time of the last impact, and the paths since, of linked particles of a block."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        struck: cython.bint = k.own[i] > 0 and (w.impact[IMPACT * at] != 0 or w.impact[IMPACT * at + 1] != 0)
        k.held[i] = -1
        k.struck[i] = w.since[at] if struck else 0.0
        k.x[2 * i], k.x[2 * i + 1] = w.position[2 * at], w.position[2 * at + 1]
        k.u[2 * i], k.u[2 * i + 1] = v[width * at], v[width * at + 1]


@kernel
def spread_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Spread the time of the last impact over the particles of each block of a chunk.

    So all of a net gets one time, at which its impact turns nothing. Impulses of the last substep stay then.
    """
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    c: cython.Py_ssize_t = k.colour[k.now] + item
    b: cython.Py_ssize_t
    e: cython.Py_ssize_t
    r: cython.Py_ssize_t
    for b in range(k.chunk[c], k.chunk[c + 1]):
        t: cython.double = 0
        for e in range(k.first[k.block[b]], k.first[k.block[b + 1]]):
            t = max(t, k.struck[k.node[e]])
        if t == 0:
            continue
        for e in range(k.first[k.block[b]], k.first[k.block[b + 1]]):
            if k.own[k.node[e]] > 0:  # pinned ones may be in several blocks of a colour
                k.struck[k.node[e]] = t
        for r in range(k.block[b], k.block[b + 1]):
            if k.warm and k.kind[r] == DISTANCE and k.keeps[r] == 0 and k.ahead[3 * r] == 0:
                k.ahead[3 * r], k.ahead[3 * r + 1], k.ahead[3 * r + 2] = k.saved[r], k.had[2 * r], k.had[2 * r + 1]
                add_warm_between(k, r, -k.had[2 * r], -k.had[2 * r + 1])


@kernel
def point_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """Set the directions of the rows of a chunk to those at that time."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        if k.kind[r] == DISTANCE:
            i: cython.Py_ssize_t = k.node[k.first[r]]
            j: cython.Py_ssize_t = k.node[k.first[r] + 1]
            p: LinkWay = way_between(k, i, j, max(k.struck[i], k.struck[j]))
            length: cython.double = sqrt(p.x * p.x + p.y * p.y)
            k.end_way[2 * r], k.end_way[2 * r + 1] = p.x / length if length > 0 else 0, p.y / length if length > 0 else 0
            k.chord_speed[r] = 0


@inlined
def restore_row(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """Restore the impulses of row r."""
    k.impulse[r] = k.saved[r]
    k.given[2 * r], k.given[2 * r + 1] = k.had[2 * r], k.had[2 * r + 1]


@kernel
def end_former_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """Book what rows of a chunk give against velocities before impacts, during warm start, for when they are solved."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        if k.warm:
            k.ahead[3 * r] += k.impulse[r] - k.saved[r]
            k.ahead[3 * r + 1] += k.given[2 * r] - k.had[2 * r]
            k.ahead[3 * r + 2] += k.given[2 * r + 1] - k.had[2 * r + 1]
        restore_row(k, r)


@kernel
def end_impact_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """Book the impulses by impacts: they are no load, but count for breaking."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        k.impact[r] += k.impulse[r] - k.saved[r]
        restore_row(k, r)


@kernel
def take_former(what: cython.p_void, block: cython.int) -> cython.void:
    """Set velocities of a block of linked particles to those before impacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        k.u[2 * i] -= w.impact[IMPACT * at]
        k.u[2 * i + 1] -= w.impact[IMPACT * at + 1]
        k.begun[3 * i], k.begun[3 * i + 1] = k.u[2 * i], k.u[2 * i + 1]


@kernel
def put_former(what: cython.p_void, block: cython.int) -> cython.void:
    """Store what links remove from them at the time of impact; during warm start it is applied at once."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        struck: cython.bint = k.struck[i] > 0
        x: cython.double = k.u[2 * i] - k.begun[3 * i] if struck else 0.0
        y: cython.double = k.u[2 * i + 1] - k.begun[3 * i + 1] if struck else 0.0
        w.impact[IMPACT * at + 2], w.impact[IMPACT * at + 3] = x, y
        if k.warm and struck:
            v[width * at] += cython.cast(real, x)
            v[width * at + 1] += cython.cast(real, y)
            move_path(w, at, x, y, k.struck[i])


@kernel
def take_impacts(what: cython.p_void, block: cython.int) -> cython.void:
    """Set velocities of a block to their changes by impacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = IMPACT * cython.cast(cython.Py_ssize_t, k.sorted_index[i])
        k.u[2 * i], k.u[2 * i + 1] = w.impact[at], w.impact[at + 1]


@kernel
def keep_impacts(what: cython.p_void, block: cython.int) -> cython.void:
    """Save the changes by impacts, for `take_kept_impacts`."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = IMPACT * cython.cast(cython.Py_ssize_t, k.sorted_index[i])
        k.begun[3 * i], k.begun[3 * i + 1] = w.impact[at], w.impact[at + 1]


@kernel
def take_kept_impacts(what: cython.p_void, block: cython.int) -> cython.void:
    """Restore the changes by impacts that `keep_impacts` saved."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        k.u[2 * i], k.u[2 * i + 1] = k.begun[3 * i], k.begun[3 * i + 1]


@kernel
def put_impacts(what: cython.p_void, block: cython.int) -> cython.void:
    """Apply the changes by impacts after links have acted on them."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        dx: cython.double = k.u[2 * i] - w.impact[IMPACT * at]
        dy: cython.double = k.u[2 * i + 1] - w.impact[IMPACT * at + 1]
        if k.own[i] > 0 and (dx != 0 or dy != 0):
            v[width * at] += cython.cast(real, dx)
            v[width * at + 1] += cython.cast(real, dy)
            w.free[2 * at] += cython.cast(real, dx)
            w.free[2 * at + 1] += cython.cast(real, dy)
            move_path(w, at, dx, dy, k.struck[i])
            if w.records_work:
                add_impact_work(w, at, dx, dy, 0, k.struck[i])
            w.impact[IMPACT * at], w.impact[IMPACT * at + 1] = k.u[2 * i], k.u[2 * i + 1]


@kernel
def forget_impacts(what: cython.p_void, block: cython.int) -> cython.void:
    """Clear the changes by impacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = IMPACT * cython.cast(cython.Py_ssize_t, k.sorted_index[i])
        w.impact[at] = w.impact[at + 1] = 0
        k.react[2 * i] = k.react[2 * i + 1] = 0


@kernel
def share_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Relax the rigid rows of a chunk; blocks without impacts are skipped."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    c: cython.Py_ssize_t = k.colour[k.now] + item
    b: cython.Py_ssize_t
    e: cython.Py_ssize_t
    for b in range(k.chunk[c], k.chunk[c + 1]):
        r: cython.Py_ssize_t = k.block[b]
        struck: cython.bint = False
        for e in range(k.first[r], k.first[k.block[b + 1]]):
            struck |= k.struck[k.node[e]] > 0
        if not struck or k.kind[r] == MOTOR:
            continue
        if k.kind[r] == DISTANCE:
            step_chain(k, r, k.block[b + 1], False, CHORDS, 1)
        else:
            relax_row(k, r)


@kernel
def share_field(w: cython.pointer(Step), sweeps: cython.int) -> cython.void:
    """Relax all rigid rows, forward and backward."""
    k: cython.pointer(Links) = w.link_table
    for p in range(k.pins):
        if k.pin_intact[p] != 0 and k.pin_stiffness[p] == INFINITY:
            i: cython.Py_ssize_t = k.pin_node[p]
            k.u[2 * i] = k.u[2 * i + 1] = k.weight[i] = 0
    for n in range(sweeps):
        each_colour(w, share_chunk, n % 2 == 1)
