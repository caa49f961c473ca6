# mypy: ignore-errors
"""Contacts of particles with surfaces: hard ones, with impulses that last, and impacts in closed form. One particle at a time."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, sqrt

from pyverlet.core.impacts import NEVER, strike
from pyverlet.core.step import Step
from pyverlet.core.surface_shapes import (
    BEND,
    BOUNCE,
    CONTACT,
    DRAG,
    GAP,
    NORMAL,
    PUSH,
    RUB,
    SIDES,
    SPEED,
    Hit,
    measure_surface,
    meet_segment,
    meet_side,
)

MOST_BOUNCES = cython.declare(cython.int, 256)
"""Of one particle in a substep, one after the other."""

MOST_TURNS_AROUND = cython.declare(cython.int, 64)
"""Over the contacts of a particle that lies between several: in a narrow wedge each gives what the other takes."""

SETTLED = cython.declare(cython.double, 1e-4)
"""Of its impulses: no more turns are needed if none changes by more."""


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def note_surface(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, dx: cython.double, dy: cython.double
) -> cython.void:
    """A surface has changed the velocity of a particle."""
    if w.noting:
        given: cython.pointer(real) = w.wall_given if w.surface[k] < SIDES else w.obstacle_given
        given[2 * i] += cython.cast(real, dx)
        given[2 * i + 1] += cython.cast(real, dy)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def push_off(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, jn: cython.double, jt: cython.double, nx: cython.double,
    ny: cython.double,
) -> cython.void:  # fmt: skip
    """Give particle i impulses over its mass: jn against the normal, jt along (ny, -nx)."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    v[width * i] += cython.cast(real, jt * ny - jn * nx)
    v[width * i + 1] -= cython.cast(real, jt * nx + jn * ny)
    note_surface(w, i, k, w.weigh * (jt * ny - jn * nx), -w.weigh * (jt * nx + jn * ny))
    if w.rough:
        v[4 * i + 2] -= cython.cast(real, jt * 2 / w.radius[i])


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def bounce_at(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, hit: cython.pointer(Hit)) -> cython.void:
    """An impact on the surface of contact k."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = CONTACT * k
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    nx: cython.double = hit.nx
    ny: cython.double = hit.ny
    back: cython.double = hit.time - 0.5 * cython.cast(cython.double, w.h)
    ux: cython.double = v[width * i] - row[first + SPEED] + w.acceleration[2 * i] * back
    uy: cython.double = v[width * i + 1] - row[first + SPEED + 1] + w.acceleration[2 * i + 1] * back
    speed: cython.double = ux * nx + uy * ny
    given: cython.double = (1 + row[first + BOUNCE]) * speed
    strike(w, i, -given * nx, -given * ny, 0, hit.time)
    note_surface(w, i, k, -given * nx, -given * ny)
    mu: cython.double = row[first + RUB]
    if w.rough and mu > 0:
        slip: cython.double = ux * ny - uy * nx - w.motion[4 * i + 2] * w.radius[i]
        most: cython.double = mu * given
        jt: cython.double = min(max(-slip / 3, -most), most)
        strike(w, i, jt * ny, -jt * nx, -jt * 2 / w.radius[i], hit.time)
        note_surface(w, i, k, jt * ny, -jt * nx)
    gap: cython.double = row[first + GAP]
    if hit.time == 0 and gap < 0:  # it was beyond: put back
        w.position[2 * i] += cython.cast(real, gap * nx)
        w.position[2 * i + 1] += cython.cast(real, gap * ny)
        w.moved[2 * i] += cython.cast(real, gap * nx)
        w.moved[2 * i + 1] += cython.cast(real, gap * ny)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def meets(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, since: cython.double) -> Hit:
    """When particle i meets the surface of contact k faster than contacts at rest do; NEVER: not in this substep."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = CONTACT * k
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    sx: cython.double = row[first + SPEED]
    sy: cython.double = row[first + SPEED + 1]
    ux: cython.double = v[width * i]
    uy: cython.double = v[width * i + 1]
    hit: Hit
    if w.surface[k] < SIDES:
        hit = meet_side(w, i, k, ux, uy, since)
    else:
        hit = meet_segment(w, i, k, ux - sx, uy - sy, since)
    if hit.time == NEVER:
        return hit
    back: cython.double = hit.time - 0.5 * cython.cast(cython.double, w.h)
    ux += w.acceleration[2 * i] * back - sx
    uy += w.acceleration[2 * i + 1] * back - sy
    free: cython.double = (w.free[2 * i] - sx) * hit.nx + (w.free[2 * i + 1] - sy) * hit.ny
    if ux * hit.nx + uy * hit.ny <= w.least_bounce or free <= w.least_bounce:  # what only contacts push there carries load
        hit.time = NEVER
    return hit


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def bounce_surfaces(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.bint:
    """Let particle i bounce from surfaces that it meets fast in this substep; not from those that carry its load."""
    n: cython.int
    k: cython.Py_ssize_t
    if w.inverse_mass[i] == 0:
        return False
    for n in range(MOST_BOUNCES):
        first: Hit
        first.time, first.nx, first.ny = NEVER, 0.0, 0.0
        which: cython.Py_ssize_t = -1
        for k in range(w.contact_begin[i], w.contact_end[i]):
            if w.restless or w.contact[CONTACT * k + PUSH] == 0:
                measure_surface(w, i, k, False)
                hit: Hit = meets(w, i, k, w.since[i])
                if hit.time < first.time:
                    first, which = hit, k
        if which < 0:
            return n > 0
        bounce_at(w, i, which, cython.address(first))
    return True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def hold(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, relax: cython.bint) -> cython.double:
    """A contact at rest: an impulse that lets the rim come to the surface within this substep, and no farther.

    Returns by how much that differs from what it gave before.
    """
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = CONTACT * k
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    nx: cython.double = row[first + NORMAL]
    ny: cython.double = row[first + NORMAL + 1]
    before: cython.double = row[first + PUSH]
    ux: cython.double = v[width * i] - row[first + SPEED]
    uy: cython.double = v[width * i + 1] - row[first + SPEED + 1]
    speed: cython.double = ux * nx + uy * ny
    if not relax:
        if before == 0 and w.surface[k] >= SIDES and speed > w.least_bounce:
            free: cython.double = (w.free[2 * i] - row[first + SPEED]) * nx + (w.free[2 * i + 1] - row[first + SPEED + 1]) * ny
            if free > w.least_bounce:  # it has bounced if it meets it at all
                return 0.0
        speed -= row[first + GAP] / w.h
        bend: cython.double = row[first + BEND]
        if bend != 0:  # the surface bends away from the tangent, by 1 - cos of what is gone along it
            slide: cython.double = (ux * ny - uy * nx) * w.h * bend
            away: cython.double = 1 - sqrt(1 - slide * slide) if slide * slide < 1 else 1.0
            speed += away / (bend * w.h)
    after: cython.double = max(before + speed, 0.0)
    if before == 0 and after == 0:
        return 0.0
    row[first + PUSH] = after
    rubbed: cython.double = 0.0
    if w.rough:
        ux -= (after - before) * nx
        uy -= (after - before) * ny
        slip: cython.double = ux * ny - uy * nx - v[4 * i + 2] * w.radius[i]
        most: cython.double = row[first + RUB] * after
        old: cython.double = row[first + DRAG]
        row[first + DRAG] = min(max(old - slip / 3, -most), most)
        rubbed = row[first + DRAG] - old
    push_off(w, i, k, after - before, rubbed, nx, ny)
    return fabs(after - before)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def hold_surfaces(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Hold particle i at the surfaces that it may reach in this substep."""
    _: cython.int
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        measure_surface(w, i, k, False)
    for _ in range(MOST_TURNS_AROUND):
        most: cython.double = 0
        change: cython.double = 0
        loaded: cython.int = 0
        for k in range(w.contact_begin[i], w.contact_end[i]):
            if w.contact[CONTACT * k + GAP] < w.far or w.contact[CONTACT * k + PUSH] > 0:
                change = max(change, hold(w, i, k, False))
                most = max(most, w.contact[CONTACT * k + PUSH])
                loaded += w.contact[CONTACT * k + PUSH] > 0
        if loaded < 2 or change <= SETTLED * most:
            break


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def relax_surfaces(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Surfaces that carry load: no speed into them."""
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        if w.contact[CONTACT * k + PUSH] > 0:
            measure_surface(w, i, k, True)
            hold(w, i, k, True)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def warm_surfaces(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """What surfaces gave particle i in the last substep, along the normals of now."""
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        first: cython.Py_ssize_t = CONTACT * k
        if w.contact[first + PUSH] > 0:
            measure_surface(w, i, k, False)
            if w.substep == w.first:
                w.contact[first + PUSH] *= w.scale
                w.contact[first + DRAG] *= w.scale
            jt: cython.double = w.contact[first + DRAG] if w.rough else 0.0
            push_off(w, i, k, w.contact[first + PUSH], jt, w.contact[first + NORMAL], w.contact[first + NORMAL + 1])
