# mypy: ignore-errors
"""Linked particles that surfaces hold: links move them along these, and a surface takes what goes into it while it presses."""

from __future__ import annotations

import cython
from cython.cimports.libc.stdint import int32_t

from pyverlet.core.link_arrays import Links
from pyverlet.core.step import Step
from pyverlet.core.surface_contacts import excess_speed, keep_with_pair, passes_by
from pyverlet.core.surface_rows import BEFORE_CHAIN, CONTACT, GAP, NORMAL, PUSH
from pyverlet.core.surfaces import note_surface

WEDGED = cython.declare(cython.double, 1e-3)
"""Of its mobility: where surfaces leave less of it to a row, it is solved as if there were none, and they follow."""

Mobility = cython.struct(xx=cython.double, xy=cython.double, yy=cython.double)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def moved_by(k: cython.pointer(Links), i: cython.Py_ssize_t) -> Mobility:
    """What an impulse of 1 N s makes of the velocity of linked particle i, m/s."""
    found: Mobility
    own: cython.double = k.weight[i]
    found.xx, found.xy, found.yy = own, 0, own
    c: cython.Py_ssize_t = k.held[i]
    if c >= 0:
        x: cython.double = k.contact[CONTACT * c + NORMAL]
        y: cython.double = k.contact[CONTACT * c + NORMAL + 1]
        found.xx, found.xy, found.yy = own * y * y, -own * x * y, own * x * x
    return found


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def mobility_along(
    k: cython.pointer(Links), i: cython.Py_ssize_t, x: cython.double, y: cython.double, a: cython.double, b: cython.double
) -> cython.double:
    """How much an impulse (x, y) on linked particle i changes its velocity along (a, b)."""
    along: cython.double = x * a + y * b
    c: cython.Py_ssize_t = k.held[i]
    if c >= 0:
        nx: cython.double = k.contact[CONTACT * c + NORMAL]
        ny: cython.double = k.contact[CONTACT * c + NORMAL + 1]
        along -= (x * nx + y * ny) * (a * nx + b * ny)
    return k.weight[i] * along


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def move(k: cython.pointer(Links), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Change the velocity of linked particle i, but for what its surface takes."""
    c: cython.Py_ssize_t = k.held[i]
    if c >= 0:
        nx: cython.double = k.contact[CONTACT * c + NORMAL]
        ny: cython.double = k.contact[CONTACT * c + NORMAL + 1]
        into: cython.double = max(x * nx + y * ny, -k.contact[CONTACT * c + PUSH])
        k.contact[CONTACT * c + PUSH] += into
        x -= into * nx
        y -= into * ny
    k.u[2 * i] += x
    k.u[2 * i + 1] += y


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def let_go_of_wedged(
    k: cython.pointer(Links), i: cython.Py_ssize_t, j: cython.Py_ssize_t, x: cython.double, y: cython.double
) -> cython.void:
    """Two particles that surfaces leave no motion along the unit vector (x, y) between them."""
    left: cython.double = mobility_along(k, i, x, y, x, y) + mobility_along(k, j, x, y, x, y)
    if left < WEDGED * (k.weight[i] + k.weight[j]):
        k.held[i] = k.held[j] = -1


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def find_hold(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Linked particle i is held by the surface that presses it most."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    most: cython.double = 0
    k.held[i] = -1
    if k.own[i] > 0 and k.surfaces:
        for c in range(w.contact_begin[k.slot[i]], w.contact_end[k.slot[i]]):
            if w.contact[CONTACT * c + PUSH] > most:
                most = w.contact[CONTACT * c + PUSH]
                k.held[i] = cython.cast(int32_t, c)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def save_node(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Before linked particle i is moved by its chain."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    k.begun[2 * i], k.begun[2 * i + 1] = k.u[2 * i], k.u[2 * i + 1]
    if k.surfaces:
        for c in range(w.contact_begin[k.slot[i]], w.contact_end[k.slot[i]]):
            w.contact[CONTACT * c + BEFORE_CHAIN] = w.contact[CONTACT * c + PUSH]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def restore_node(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Back to that."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    k.u[2 * i], k.u[2 * i + 1] = k.begun[2 * i], k.begun[2 * i + 1]
    if k.surfaces:
        for c in range(w.contact_begin[k.slot[i]], w.contact_end[k.slot[i]]):
            w.contact[CONTACT * c + PUSH] = w.contact[CONTACT * c + BEFORE_CHAIN]
    find_hold(w, i)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def hold_node(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Linked particle i comes to its surfaces in this substep, and no farther; as `hold`, without friction."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    if k.own[i] == 0 or k.weight[i] == 0 or not k.surfaces:
        return
    for c in range(w.contact_begin[k.slot[i]], w.contact_end[k.slot[i]]):
        first: cython.Py_ssize_t = CONTACT * c
        before: cython.double = w.contact[first + PUSH]
        if before > 0 or (w.contact[first + GAP] < w.far and not passes_by(w, k.slot[i], c, k.u[2 * i], k.u[2 * i + 1])):
            after: cython.double = max(before + excess_speed(w, first, k.u[2 * i], k.u[2 * i + 1]), 0.0)
            w.contact[first + PUSH] = after
            k.u[2 * i] -= (after - before) * w.contact[first + NORMAL]
            k.u[2 * i + 1] -= (after - before) * w.contact[first + NORMAL + 1]
    find_hold(w, i)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def note_holds(w: cython.pointer(Step), i: cython.Py_ssize_t, share: cython.double) -> cython.void:
    """Note so much of what surfaces give linked particle i: before links change it, and afterwards."""
    k: cython.pointer(Links) = w.link_table
    c: cython.Py_ssize_t
    if k.own[i] == 0 or not k.surfaces:
        return
    for c in range(w.contact_begin[k.slot[i]], w.contact_end[k.slot[i]]):
        first: cython.Py_ssize_t = CONTACT * c
        gives: cython.double = share * w.weigh * w.contact[first + PUSH]
        if gives != 0:
            note_surface(w, k.slot[i], c, -gives * w.contact[first + NORMAL], -gives * w.contact[first + NORMAL + 1], False)
        if w.surface[c] < 0:
            keep_with_pair(w, c)
