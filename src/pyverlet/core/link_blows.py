# mypy: ignore-errors
"""What impacts give linked particles goes on to all that rigid links join to them, before these are solved for their lengths.

A blow changes velocities by a field that no rigid row may feel: what is left of the blow when its rows have been relaxed, along
the ways at the start of the substep. What rows give for that is no load, and is not given again.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, sqrt
from cython.cimports.team import team_stage

from pyverlet.core.cells import BLOCK
from pyverlet.core.link_arrays import DISTANCE, MOTOR, Links
from pyverlet.core.link_blocks import relax_row
from pyverlet.core.link_chains import CHORDS, step_chain
from pyverlet.core.link_shapes import LinkWay, way_between
from pyverlet.core.link_warm_start import lend_between
from pyverlet.core.rebounds import BLOW
from pyverlet.core.step import Step
from pyverlet.core.work import book_impact, book_place

AT_START = cython.declare(cython.int, 0)
HALFWAY = cython.declare(cython.int, 1)
BLOWS = cython.declare(cython.int, 2)
"""What `u` is: velocities before impacts, at the start of the substep and halfway to the blow, or what blows change of them."""


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def point_row(k: cython.pointer(Links), r: cython.Py_ssize_t, t: cython.double) -> cython.void:
    """Row r, a distance, is relaxed along its way at time t of the substep."""
    p: LinkWay = way_between(k, k.node[k.first[r]], k.node[k.first[r] + 1], t)
    length: cython.double = sqrt(p.x * p.x + p.y * p.y)
    k.end_way[2 * r], k.end_way[2 * r + 1] = p.x / length if length > 0 else 0, p.y / length if length > 0 else 0
    k.chord_speed[r] = 0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def begin_blow_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """Rows of a chunk: what they have given, and the ways at the start."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        k.saved[r] = k.impulse[r]
        k.had[2 * r], k.had[2 * r + 1] = k.given[2 * r], k.given[2 * r + 1]
        if k.kind[r] == DISTANCE:
            point_row(k, r, 0)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def restore_row(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """Row r has given what it had before."""
    k.impulse[r] = k.saved[r]
    k.given[2 * r], k.given[2 * r + 1] = k.had[2 * r], k.had[2 * r + 1]


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def end_former_rows(k: cython.pointer(Links), item: cython.int, times: cython.double) -> cython.void:
    """Rows of a chunk have given so many times what they did; while they are warm that counts when they have been solved."""
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        if k.warm:
            k.ahead[3 * r] += times * (k.impulse[r] - k.saved[r])
            k.ahead[3 * r + 1] += times * (k.given[2 * r] - k.had[2 * r])
            k.ahead[3 * r + 2] += times * (k.given[2 * r + 1] - k.had[2 * r + 1])
        restore_row(k, r)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def end_start_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """After velocities of the start of the substep."""
    end_former_rows(cython.cast(cython.pointer(Step), what).link_table, item, 1)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def end_turned_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """After those of the time of the blow, at which rows are from now on."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    end_former_rows(k, item, 2)
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        if k.kind[r] == DISTANCE:
            e: cython.Py_ssize_t = k.first[r]
            point_row(k, r, max(k.begun[3 * k.node[e] + 2], k.begun[3 * k.node[e + 1] + 2]))


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def end_blow_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """What they give of blows is no load, but counts for their strength."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        k.blow[r] += k.impulse[r] - k.saved[r]
        restore_row(k, r)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def end_shift_rows(what: cython.p_void, item: cython.int) -> cython.void:
    """What they give of places is nothing."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    r: cython.Py_ssize_t
    for r in range(k.block[k.chunk[item]], k.block[k.chunk[item + 1]]):
        restore_row(k, r)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def take_former(what: cython.p_void, block: cython.int) -> cython.void:
    """The velocities before the impacts of a block of linked particles, as rows are solved from; which of them were struck."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    axis: cython.int
    i: cython.Py_ssize_t
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = k.slot[i]
        first: cython.Py_ssize_t = BLOW * at
        k.held[i] = -1
        for axis in range(2):
            k.u[2 * i + axis] = v[width * at + axis] - w.blow[first + axis]
            k.begun[3 * i + axis] = k.u[2 * i + axis]
        k.begun[3 * i + 2] = w.since[at] if k.own[i] > 0 and (w.blow[first] != 0 or w.blow[first + 1] != 0) else 0.0


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def turn_former(what: cython.p_void, block: cython.int) -> cython.void:
    """Those that links allow at the start of the substep, of a block."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    i: cython.Py_ssize_t
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = BLOW * cython.cast(cython.Py_ssize_t, k.slot[i]) + 4
        w.blow[at], w.blow[at + 1] = k.u[2 * i], k.u[2 * i + 1]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def put_former(what: cython.p_void, block: cython.int) -> cython.void:
    """What links have changed of them until the blow. While they are warm, that is given at once, and nothing is taken back.

    From the start V of the substep to the time of the blow velocities turn: 2 P V - V, with P for what links allow halfway, is as
    fast as V, and what they allow then.
    """
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    axis: cython.int
    i: cython.Py_ssize_t
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = k.slot[i]
        for axis in range(2):
            k.u[2 * i + axis] = 2 * k.u[2 * i + axis] - w.blow[BLOW * at + 4 + axis]
            change: cython.double = k.u[2 * i + axis] - k.begun[3 * i + axis] if k.begun[3 * i + 2] != 0 else 0.0
            w.blow[BLOW * at + 4 + axis] = change
            if k.warm:
                v[width * at + axis] += cython.cast(real, change)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def take_blows(what: cython.p_void, block: cython.int) -> cython.void:
    """What impacts have changed of the velocities of a block."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    i: cython.Py_ssize_t
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = BLOW * cython.cast(cython.Py_ssize_t, k.slot[i])
        k.u[2 * i], k.u[2 * i + 1] = w.blow[at], w.blow[at + 1]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def put_blows(what: cython.p_void, block: cython.int) -> cython.void:
    """And what links make of it."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    i: cython.Py_ssize_t
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = k.slot[i]
        dx: cython.double = k.u[2 * i] - w.blow[BLOW * at]
        dy: cython.double = k.u[2 * i + 1] - w.blow[BLOW * at + 1]
        if k.own[i] > 0 and (dx != 0 or dy != 0):
            v[width * at] += cython.cast(real, dx)
            v[width * at + 1] += cython.cast(real, dy)
            w.free[2 * at] += cython.cast(real, dx)
            w.free[2 * at + 1] += cython.cast(real, dy)
            if w.booking:
                book_impact(w, at, dx, dy, 0, 0)
            w.blow[BLOW * at], w.blow[BLOW * at + 1] = k.u[2 * i], k.u[2 * i + 1]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def take_shifts(what: cython.p_void, block: cython.int) -> cython.void:
    """By how much impacts have moved where the paths of a block begin: velocities times the times of impacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    i: cython.Py_ssize_t
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = BLOW * cython.cast(cython.Py_ssize_t, k.slot[i]) + 2
        k.u[2 * i], k.u[2 * i + 1] = w.blow[at], w.blow[at + 1]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def put_shifts(what: cython.p_void, block: cython.int) -> cython.void:
    """And what links make of it; paths that have changed are good from the time on that changes of velocity and place say."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.pointer(Links) = w.link_table
    axis: cython.int
    i: cython.Py_ssize_t
    for i in range(block * BLOCK, min((block + 1) * BLOCK, k.count)):
        at: cython.Py_ssize_t = k.slot[i]
        first: cython.Py_ssize_t = BLOW * at
        square: cython.double = w.blow[first] * w.blow[first] + w.blow[first + 1] * w.blow[first + 1]
        if k.own[i] > 0 and square > 0:
            if w.since[at] == 0:
                w.begun[2 * at], w.begun[2 * at + 1] = w.position[2 * at], w.position[2 * at + 1]
                t: cython.double = (w.blow[first] * k.u[2 * i] + w.blow[first + 1] * k.u[2 * i + 1]) / square
                w.since[at] = min(max(t, 1e-300), k.h)
            for axis in range(2):
                moved: cython.double = w.blow[first + 2 + axis] - k.u[2 * i + axis]
                w.position[2 * at + axis] += cython.cast(real, moved)
                w.moved[2 * at + axis] += cython.cast(real, moved)
            if w.booking:
                book_place(w, at, w.blow[first + 2] - k.u[2 * i], w.blow[first + 3] - k.u[2 * i + 1])
        w.blow[first] = w.blow[first + 1] = w.blow[first + 2] = w.blow[first + 3] = 0
        k.react[2 * i] = k.react[2 * i + 1] = 0


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def is_struck(k: cython.pointer(Links), b: cython.Py_ssize_t) -> cython.bint:
    """Whether a field is anything at a particle of block b. The first is, where impacts have struck: rows take the time of these.

    So a net comes to have one time, at which its blow turns nothing: impulses along its ways of another time would. What they
    gave in the last substep is given until then, and is not taken back.
    """
    e: cython.Py_ssize_t
    r: cython.Py_ssize_t
    t: cython.double = 0
    struck: cython.bint = False
    for e in range(k.first[k.block[b]], k.first[k.block[b + 1]]):
        i: cython.Py_ssize_t = k.node[e]
        t = max(t, k.begun[3 * i + 2])
        struck |= k.u[2 * i] != 0 or k.u[2 * i + 1] != 0
    if k.phase == BLOWS or t == 0:
        return struck and k.phase == BLOWS
    for r in range(k.block[b], k.block[b + 1]):
        if k.kind[r] == DISTANCE:
            point_row(k, r, t / 2 if k.phase == HALFWAY else 0.0)
            if k.warm and k.keeps[r] == 0 and k.ahead[3 * r] == 0:
                k.ahead[3 * r], k.ahead[3 * r + 1], k.ahead[3 * r + 2] = k.saved[r], k.had[2 * r], k.had[2 * r + 1]
                lend_between(k, r, -k.had[2 * r], -k.had[2 * r + 1])
    for e in range(k.first[k.block[b]], k.first[k.block[b + 1]]):
        if k.own[k.node[e]] > 0:  # others may be in several blocks of a colour
            k.begun[3 * k.node[e] + 2] = t
    return True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def share_chunk(what: cython.p_void, item: cython.int) -> cython.void:
    """Rigid rows of a chunk change no more. Blocks that nothing has struck are left out."""
    k: cython.pointer(Links) = cython.cast(cython.pointer(Step), what).link_table
    c: cython.Py_ssize_t = k.colour[k.now] + item
    b: cython.Py_ssize_t
    for b in range(k.chunk[c], k.chunk[c + 1]):
        r: cython.Py_ssize_t = k.block[b]
        if r < k.block[b + 1] and k.kind[r] != MOTOR and is_struck(k, b):
            if k.kind[r] == DISTANCE:
                step_chain(k, r, k.block[b + 1], False, CHORDS, 1)
            else:
                relax_row(k, r)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def share_field(w: cython.pointer(Step), phase: cython.int, sweeps: cython.int) -> cython.void:
    """Relax what links hold, there and back."""
    k: cython.pointer(Links) = w.link_table
    p: cython.Py_ssize_t
    c: cython.int
    n: cython.int
    k.phase = phase
    for p in range(k.pins):
        if k.pin_intact[p] != 0 and k.pin_stiffness[p] == INFINITY:
            i: cython.Py_ssize_t = k.pin_node[p]
            k.u[2 * i] = k.u[2 * i + 1] = k.weight[i] = 0
    for n in range(sweeps):
        for c in range(k.colours):
            k.now = k.colours - 1 - c if n % 2 else c
            team_stage(w.team, share_chunk, w, cython.cast(cython.int, k.colour[k.now + 1] - k.colour[k.now]))
