# mypy: ignore-errors
"""Links in a substep: warm start, lengths after the drift, rates afterwards; colour by colour of blocks.

Sweeps over rows evaluated at predicted positions are position-based dynamics with small steps (Macklin et al. 2019, "Small
steps in physics simulation"). Impulses of rigid rows of the last substep are present while contacts are solved, so that contacts
see the load of links. Rows themselves begin from zero: impulses accumulated from errors would hold nets out of shape.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t
from cython.cimports.team import team_function, team_stage

from pyverlet.core.cells import BLOCK
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.link_blocks import AVERAGED, begin_block, end_row, finish_row, solve_block, undo_row
from pyverlet.core.link_holds import add_hold_impulses, find_hold, move
from pyverlet.core.link_pins import begin_pin, end_pin, finish_pin, finish_rigid_pin, hold_pin, hold_rigid_pin
from pyverlet.core.link_warm_start import limit_warm, warm_block
from pyverlet.core.rebounds import IMPACT
from pyverlet.core.step import Step

PUT_OUT = cython.declare(cython.double, 4)
"""Largest depth at which surfaces hold linked particles, over the separation of overlaps per substep."""


@kernel
def take_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Copy velocities of a block of particles to the links."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    a: cython.Py_ssize_t = block * BLOCK
    for i in range(a, min(a + BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        k.u[2 * i], k.u[2 * i + 1] = v[width * at], v[width * at + 1]
        if w.rough:
            k.ease[i] = w.ease[w.mixed * at]
            k.rim[i] = v[4 * at + 2] * cython.cast(cython.double, w.radius[at])


@kernel
def put_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Copy velocities of a block back to the particles."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    a: cython.Py_ssize_t = block * BLOCK
    for i in range(a, min(a + BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        if k.own[i] > 0:
            v[width * at], v[width * at + 1] = cython.cast(real, k.u[2 * i]), cython.cast(real, k.u[2 * i + 1])
            if w.rough and (k.powered[i] > 0 or (k.surfaces and w.contact_begin[at] < w.contact_end[at])):
                v[4 * at + 2] = cython.cast(real, k.rim[i] / w.radius[at])


@kernel
def put_held_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Copy velocities of a block back, and record what surfaces have given."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    a: cython.Py_ssize_t = block * BLOCK
    for i in range(a, min(a + BLOCK, k.count)):
        add_hold_impulses(w, i, 1)
    put_stage(what, block)


@kernel
def take_held_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Copy velocities of a block, and find the surfaces that hold it."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    a: cython.Py_ssize_t = block * BLOCK
    take_stage(what, block)
    for i in range(a, min(a + BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        if not k.drifted and w.since[at] > 0:  # an impact has moved the start of its path
            k.x[2 * i], k.x[2 * i + 1] = w.position[2 * at], w.position[2 * at + 1]
        find_hold(w, i)
        if w.records_contacts:
            add_hold_impulses(w, i, -1)


@kernel
def open_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Copy positions, velocities and masses of a block of linked particles."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    a: cython.Py_ssize_t = block * BLOCK
    take_stage(what, block)
    for i in range(a, min(a + BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        k.x[2 * i], k.x[2 * i + 1] = w.position[2 * at], w.position[2 * at + 1]
        k.own[i] = k.weight[i] = w.inverse_mass[at]
        k.react[2 * i] = k.react[2 * i + 1] = 0
        k.warmed[2 * i] = k.warmed[2 * i + 1] = k.spun[i] = 0
        k.begun[3 * i], k.begun[3 * i + 1] = k.u[2 * i], k.u[2 * i + 1]
        k.held[i] = -1
        w.node[at] = cython.cast(int32_t, i)
        w.impact[IMPACT * at] = w.impact[IMPACT * at + 1] = 0


@kernel
def undo_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Remove the warm start from velocities of a block before rows are solved."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    a: cython.Py_ssize_t = block * BLOCK
    axis: cython.int
    take_held_stage(what, block)
    for i in range(a, min(a + BLOCK, k.count)):
        move(k, i, -k.warmed[2 * i], -k.warmed[2 * i + 1])
        for axis in range(2):
            if k.own[i] > 0:
                w.acceleration[2 * cython.cast(cython.Py_ssize_t, k.sorted_index[i]) + axis] = cython.cast(
                    real, k.driven[2 * i + axis]
                )


@kernel
def undo_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Remove the warm start from the rows of a chunk."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        undo_row(k, r)


@kernel
def warmed_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Count the warm start of a block as an acceleration while contacts are solved."""
    axis: cython.int
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    a: cython.Py_ssize_t = block * BLOCK
    for i in range(a, min(a + BLOCK, k.count)):
        at: cython.Py_ssize_t = 2 * cython.cast(cython.Py_ssize_t, k.sorted_index[i])
        for axis in range(2 if k.own[i] > 0 else 0):
            given: cython.double = cython.cast(real, k.u[2 * i + axis]) - w.free[at + axis]
            k.driven[2 * i + axis] = w.acceleration[at + axis]
            w.acceleration[at + axis] += cython.cast(real, given / k.kick)
        k.react[2 * i] = k.react[2 * i + 1] = 0
    put_stage(what, block)


@kernel
def limit_warm_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Limit the warm start of a block, contacts included."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    a: cython.Py_ssize_t = block * BLOCK
    take_stage(what, block)
    for i in range(a, min(a + BLOCK, k.count)):
        limit_warm(w, i)
    put_stage(what, block)


@kernel
def remember_motors_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Count spins by motors as given."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    a: cython.Py_ssize_t = block * BLOCK
    for i in range(a, min(a + BLOCK, k.count)):
        at: cython.Py_ssize_t = k.sorted_index[i]
        if k.own[i] > 0:
            w.given_spin[at] += cython.cast(real, k.spun[i])


@kernel
def begin_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Begin the rows of a chunk."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    b: cython.Py_ssize_t
    for b in range(k.chunk[item], k.chunk[item + 1]):
        begin_block(k, b)


@kernel
def warm_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Warm start of the rows of a chunk."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t = k.colour[k.now] + item
    b: cython.Py_ssize_t
    for b in range(k.chunk[c], k.chunk[c + 1]):
        warm_block(w, b)


@kernel
def solve_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Solve the rows of a chunk for their values after the drift."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t = k.colour[k.now] + item
    b: cython.Py_ssize_t
    for b in range(k.chunk[c], k.chunk[c + 1]):
        solve_block(w, b, True)


@kernel
def relax_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Relax the rates of the rows of a chunk after the drift."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t = k.colour[k.now] + item
    b: cython.Py_ssize_t
    for b in range(k.chunk[c], k.chunk[c + 1]):
        solve_block(w, b, False)


@kernel
def finish_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Finish the rows of a chunk before the drift."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        finish_row(k, r)


@kernel
def end_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Update the tensions of the rows of a chunk."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        end_row(k, r, min(1.0, AVERAGED * k.kick))


@kernel
def blocks_of(k: cython.pointer(Links)) -> cython.int:
    """Number of blocks of linked particles."""
    return cython.cast(cython.int, (k.count + BLOCK - 1) // BLOCK)


@inlined
def each_colour(w: cython.pointer(Step), function: team_function, back: cython.bint) -> cython.void:
    """Call `function(w, item)` for all chunks, colour by colour. back: in reverse order."""
    k: cython.pointer(Links) = w.link_table
    for c in range(k.colours):
        k.now = k.colours - 1 - c if back else c
        team_stage(w.team, function, w, cython.cast(cython.int, k.colour[k.now + 1] - k.colour[k.now]))


@kernel
def begin_links(w: cython.pointer(Step), surfaces: cython.bint) -> cython.void:
    """After the kick: begin links and warm-start them. surfaces: whether there are any."""
    k: cython.pointer(Links) = w.link_table
    opens: cython.bint = w.substep == w.first
    k.h = cython.cast(cython.double, w.h)
    k.left = k.substeps - w.substep
    k.kick = cython.cast(cython.double, w.h / w.rest_scale if opens and w.rest_scale > 0 else w.h)
    k.scale = cython.cast(cython.double, w.scale if opens else 1)
    k.spring_h = max(cython.cast(cython.double, w.spring_h), k.h)
    k.least = cython.cast(cython.double, w.rest_speed)
    k.lively = w.restless and (w.lists.restitution > 0 or w.wall_restitution > 0)
    k.contact, k.surfaces, k.rough = w.contact, surfaces, w.rough
    k.drifted, k.warm = False, True
    k.pushed_out = k.h * w.push
    k.deepest = PUT_OUT * k.pushed_out
    team_stage(w.team, open_stage, w, blocks_of(k))
    team_stage(w.team, begin_chunk, w, cython.cast(cython.int, k.colour[k.colours]))
    for p in range(k.pins):
        begin_pin(k, p)
    each_colour(w, warm_chunk, False)
    team_stage(w.team, warmed_stage, w, blocks_of(k))


@kernel
def limit_warm_links(w: cython.pointer(Step)) -> cython.void:
    """After the warm start of links and contacts: limit it."""
    team_stage(w.team, limit_warm_stage, w, blocks_of(w.link_table))


@kernel
def solve_links(w: cython.pointer(Step), again: cython.bint, last: cython.bint) -> cython.void:
    """Before the drift: solve rows for their values after it, in the order of colours. again: in reverse order, continuing from
    their impulses. last: they are not solved again in this substep.
    """
    k: cython.pointer(Links) = w.link_table
    if again:
        team_stage(w.team, take_held_stage, w, blocks_of(k))
    else:
        team_stage(w.team, undo_stage, w, blocks_of(k))
        team_stage(w.team, undo_chunk, w, cython.cast(cython.int, k.colour[k.colours]))
    k.warm = False
    for p in range(k.pins):
        hold_pin(k, p)
    for _ in range(k.passes):
        each_colour(w, solve_chunk, again)
    if last:
        team_stage(w.team, finish_chunk, w, cython.cast(cython.int, k.colour[k.colours]))
    for p in range(k.pins):
        finish_pin(k, p)
    team_stage(w.team, put_held_stage, w, blocks_of(k))


@kernel
def relax_links(w: cython.pointer(Step), back: cython.bint) -> cython.void:
    """After the drift: relax the rates of rigid rows. back: in reverse order of colours."""
    k: cython.pointer(Links) = w.link_table
    k.drifted = True
    team_stage(w.team, take_held_stage, w, blocks_of(k))
    for p in range(k.pins):
        hold_rigid_pin(k, p)
    each_colour(w, relax_chunk, back)
    for p in range(k.pins):
        finish_rigid_pin(k, p)
    team_stage(w.team, put_held_stage, w, blocks_of(k))


@kernel
def end_links(w: cython.pointer(Step)) -> cython.void:
    """Update the tensions of links; overloaded ones break."""
    k: cython.pointer(Links) = w.link_table
    team_stage(w.team, end_chunk, w, cython.cast(cython.int, k.colour[k.colours]))
    for p in range(k.pins):
        if k.pin_intact[p]:
            end_pin(k, p, min(1.0, AVERAGED * k.kick))
