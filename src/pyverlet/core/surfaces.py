# mypy: ignore-errors
"""Impacts of particles on surfaces, in closed form, particle by particle."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, sqrt

from pyverlet.core.event_recording import least_bounce, record_pair, record_surface
from pyverlet.core.impacts import NEVER, strike
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.rebounds import REBOUND, STAMP, node_of, store_rebound
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import AWAY, BOUNCE, COULOMB, FARAWAY, GAP, GIVEN, PUSH, SEEN, SPEED, SPEED_Y, pinned_lane, row_of
from pyverlet.core.surface_shapes import measure_surface
from pyverlet.core.surface_times import Hit, set_speed, time_to_surface
from pyverlet.core.work import add_belt_work, add_place_work

MOST_BOUNCES = cython.declare(cython.int, 256)
"""Most consecutive bounces of one particle per substep."""

MOST_FASTER = cython.declare(cython.double, 8)
"""Speed limit of a particle: its own speed plus so many times that of surfaces. Surfaces closing in on it in a narrow wedge would
have to exceed it to let it out."""

MOST_OUT = cython.declare(cython.double, 2)
"""Times the speed at which one surface pushes a particle out; several are no faster."""


@inlined
def length(x: cython.double, y: cython.double) -> cython.double:
    """Length of a vector; unlike `hypot` it is rounded equally by all libraries."""
    return sqrt(x * x + y * y)


@kernel
def speed_limit(w: cython.pointer(Step), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.double:
    """Speed limit of particle i, which came with velocity (x, y), at its surfaces, m/s."""
    fast: cython.double = 0
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        x_speed: cython.double = w.contact[row_of(k) + SPEED]
        y_speed: cython.double = w.contact[row_of(k) + SPEED_Y]
        fast = max(fast, x_speed * x_speed + y_speed * y_speed)
    fast = max(max(sqrt(fast), w.rest_speed), w.h * length(w.acceleration[2 * i], w.acceleration[2 * i + 1]))
    return 1.01 * length(x, y) + MOST_FASTER * fast  # 1.01 for rounding


@inlined
def is_slow(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.bint:
    """Whether particle i is slower than the least speed limit there is, as most are: then its own need not be known."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    x: cython.double = v[width * i]
    y: cython.double = v[width * i + 1]
    most: cython.double = MOST_FASTER * w.rest_speed
    return x * x + y * y <= most * most


@kernel
def most_speed(w: cython.pointer(Step), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.double:
    """The same where surfaces also push the particle out, m/s."""
    k: cython.Py_ssize_t
    out: cython.double = 0
    for k in range(w.contact_begin[i], w.contact_end[i]):
        deep: cython.double = -w.contact[row_of(k) + GAP] / w.h
        out = max(out, min(deep, cython.cast(cython.double, w.push)) if w.surface[k] < 0 else deep)
    return speed_limit(w, i, x, y) + MOST_OUT * out


@inlined
def add_surface_impulse(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, jn: cython.double, jt: cython.double, nx: cython.double,
    ny: cython.double, struck: cython.bint,
) -> cython.void:  # fmt: skip
    """Record that a surface gave a particle jn m/s against the normal and jt along (ny, -nx), in an impact if `struck`.

    Impulses of pinned circles are recorded by their pairs.
    """
    if not w.records_contacts:
        return
    dx: cython.double = jt * ny - jn * nx
    dy: cython.double = -jt * nx - jn * ny
    if w.surface[k] < 0:
        if struck:
            lane: cython.Py_ssize_t = pinned_lane(w, k)
            sign: cython.double = -1.0 if cython.cast(cython.Py_ssize_t, w.i[lane]) == i else 1.0
            w.summed_x[lane] += cython.cast(real, sign * dx)
            w.summed_y[lane] += cython.cast(real, sign * dy)
            w.summed_virial[lane] += cython.cast(real, jn * w.reach[lane * w.sized])
    else:
        given: cython.pointer(cython.double) = w.by_surface
        given[GIVEN * k] += dx
        given[GIVEN * k + 1] += dy
        given[GIVEN * k + 2] += jn
        given[GIVEN * k + 3] += jt


@inlined
def push_off(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, jn: cython.double, jt: cython.double, nx: cython.double,
    ny: cython.double,
) -> cython.void:  # fmt: skip
    """Apply impulses over its mass to particle i: jn against the normal, jt along (ny, -nx)."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    v[width * i] += cython.cast(real, jt * ny - jn * nx)
    v[width * i + 1] -= cython.cast(real, jt * nx + jn * ny)
    add_surface_impulse(w, i, k, w.rest_scale * jn, w.rest_scale * jt, nx, ny, False)
    if w.rough:
        ease: cython.double = w.ease[w.mixed * i]
        v[4 * i + 2] -= cython.cast(real, jt * (ease / w.radius[i]))


@kernel
def bounce_at(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, hit: cython.pointer(Hit)) -> cython.void:
    """Resolve an impact on the surface of contact k."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    nx: cython.double = hit.nx
    ny: cython.double = hit.ny
    back: cython.double = hit.time - 0.5 * cython.cast(cython.double, w.h)
    ux: cython.double = v[width * i] - row[first + SPEED] + w.acceleration[2 * i] * back
    uy: cython.double = v[width * i + 1] - row[first + SPEED_Y] + w.acceleration[2 * i + 1] * back
    speed: cython.double = ux * nx + uy * ny
    given: cython.double = (1 + row[first + BOUNCE]) * speed
    strike(w, i, -given * nx, -given * ny, 0, hit.time)
    add_surface_impulse(w, i, k, given, 0, nx, ny, True)
    if w.surface[k] < 0:
        record_pair(w, pinned_lane(w, k), speed, row[first + BOUNCE] * speed)
    else:
        record_surface(w, i, k, speed, row[first + BOUNCE] * speed)
    mu: cython.double = row[first + COULOMB]
    if w.rough and mu > 0:
        slip: cython.double = ux * ny - uy * nx - w.motion[4 * i + 2] * w.radius[i]
        most: cython.double = mu * given
        jt: cython.double = min(max(-slip / (1 + w.ease[w.mixed * i]), -most), most)
        strike(w, i, jt * ny, -jt * nx, -jt * w.ease[w.mixed * i] / w.radius[i], hit.time)
        add_surface_impulse(w, i, k, 0, jt, nx, ny, True)
        if w.records_work:
            add_belt_work(w, i, k, jt, nx, ny)
    if w.linked and row[first + BOUNCE] > 0 and node_of(w, i) >= 0:
        left: cython.double = -v[width * i] * nx - v[width * i + 1] * ny
        store_rebound(w, w.surface_rebound, REBOUND * k, -nx, -ny, left, given, row[first + BOUNCE], hit.time)
    gap: cython.double = row[first + GAP]
    if hit.time == 0 and gap < 0:  # it was beyond the surface
        w.position[2 * i] += cython.cast(real, gap * nx)
        w.position[2 * i + 1] += cython.cast(real, gap * ny)
        w.moved[2 * i] += cython.cast(real, gap * nx)
        w.moved[2 * i + 1] += cython.cast(real, gap * ny)
        if w.records_work:
            add_place_work(w, i, gap * nx, gap * ny)


@kernel
def impact_with(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, since: cython.double) -> Hit:
    """When particle i hits the surface of contact k faster than resting contacts do; NEVER: not in this substep."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    hit: Hit = time_to_surface(w, i, k, since)
    if hit.time == NEVER:
        return hit
    set_speed(w, i, k, cython.address(hit))
    sx: cython.double = row[first + SPEED]
    sy: cython.double = row[first + SPEED_Y]
    back: cython.double = hit.time - 0.5 * cython.cast(cython.double, w.h)
    ux: cython.double = v[width * i] + w.acceleration[2 * i] * back - sx
    uy: cython.double = v[width * i + 1] + w.acceleration[2 * i + 1] * back - sy
    free: cython.double = (w.free[2 * i] - sx) * hit.nx + (w.free[2 * i + 1] - sy) * hit.ny
    least: cython.double = least_bounce(w, i)
    if ux * hit.nx + uy * hit.ny <= least or free <= least:  # particles pushed by contacts alone carry load
        hit.time = NEVER
    return hit


@kernel
def has_rebounds(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.bint:
    """Whether particle i is a linked one with impacts on surfaces that links must take part in."""
    k: cython.Py_ssize_t
    found: cython.bint = False
    if node_of(w, i) >= 0:
        for k in range(w.contact_begin[i], w.contact_end[i]):
            found |= w.surface_rebound[REBOUND * k + STAMP] == w.stamp
    return found


@inlined
def supports(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t) -> cython.bint:
    """Whether the surface of contact k carries particle i, which then does not bounce unless a pair has thrown it there."""
    if w.restless or w.contact[row_of(k) + PUSH] == 0:
        return False
    return w.thrown[i] == 0 or w.contact[row_of(k) + BOUNCE] == 0


@inlined
def way_from(w: cython.pointer(Step), i: cython.Py_ssize_t, place: cython.p_double, at: cython.Py_ssize_t) -> cython.double:
    """Upper bound of the distance of particle i from a place whose coordinates are at `at` and `at` + 8, m."""
    return fabs(w.position[2 * i] - place[at]) + fabs(w.position[2 * i + 1] - place[at + 8])


@inlined
def way_ahead(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.double:
    """Upper bound of the displacement of particle i in a substep, m."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    h: cython.double = w.h
    bend: cython.double = h * h * (fabs(w.acceleration[2 * i]) + fabs(w.acceleration[2 * i + 1]))
    return h * (fabs(v[width * i]) + fabs(v[width * i + 1])) + bend


@inlined
def stays_off(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, far: cython.double) -> cython.bint:
    """Whether particle i is more than `far` m from the surface of contact k, which does not carry it, when last measured."""
    first: cython.Py_ssize_t = row_of(k)
    away: cython.double = 0 if w.linked or w.contact[first + PUSH] != 0 else w.contact[first + AWAY]
    return 2 * (way_from(w, i, w.contact, first + SEEN) + far) < away


@inlined
def update_clear(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Store the distance of particle i from surfaces that do not carry it, as measured now."""
    k: cython.Py_ssize_t
    least: cython.double = FARAWAY
    for k in range(w.contact_begin[i], w.contact_end[i]):
        if w.restless or w.contact[row_of(k) + PUSH] == 0:
            least = min(least, w.contact[row_of(k) + AWAY] - way_from(w, i, w.contact, row_of(k) + SEEN))
    for k in range(w.contact_begin[i], w.contact_end[i]):
        at: cython.Py_ssize_t = clear_of(k)
        w.clear[at], w.clear[at + 8], w.clear[at + 16] = w.position[2 * i], w.position[2 * i + 1], least


@inlined
def forget_clear(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Have the surfaces of particle i measured again: one of them no longer carries it."""
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        w.clear[clear_of(k) + 16] = 0


@inlined
def keeps_clear(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.bint:
    """Whether particle i moves less than half as far as the nearest surface that does not carry it.

    Most listed surfaces need not be measured then. Chains of links may throw it farther than its velocity says.
    """
    at: cython.Py_ssize_t = clear_of(w.contact_begin[i])
    if w.linked or w.clear[at + 16] <= 0:
        return False
    return 2 * (way_from(w, i, w.clear, at) + way_ahead(w, i)) < w.clear[at + 16]


@inlined
def meets_none(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.bint:
    """Whether particle i meets no surface in this substep, except loaded ones."""
    return w.contact_begin[i] == w.contact_end[i] or (w.thrown[i] == 0 and keeps_clear(w, i))


@kernel
def bounce_surfaces(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.bint:
    """Resolve fast impacts of particle i on surfaces that do not carry it; returns whether there were any."""
    k: cython.Py_ssize_t
    which: cython.Py_ssize_t = -1
    if w.inverse_mass[i] == 0:
        return False
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    limit: cython.double = 0
    for n in range(MOST_BOUNCES):
        first: Hit
        first.time, first.nx, first.ny = NEVER, 0.0, 0.0
        which = -1
        ahead: cython.double = way_ahead(w, i)
        for k in range(w.contact_begin[i], w.contact_end[i]):
            if not (supports(w, i, k) or stays_off(w, i, k, ahead)):
                measure_surface(w, i, k, False)
                hit: Hit = impact_with(w, i, k, w.since[i])
                if hit.time < first.time:
                    first, which = hit, k
        if which < 0:
            return n > 0
        if n == 0:
            limit = speed_limit(w, i, v[width * i], v[width * i + 1])
        bounce_at(w, i, which, cython.address(first))
        if length(v[width * i], v[width * i + 1]) > limit:
            break
    # Between closing surfaces it would accelerate without end: it stops at the last one. In a fixed corner all but elastic
    # surfaces slow it down.
    if n + 1 < MOST_BOUNCES or w.contact[row_of(which) + BOUNCE] >= 1:
        strike(w, i, -v[width * i], -v[width * i + 1], 0, w.since[i])
    return True
