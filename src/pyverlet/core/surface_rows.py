# mypy: ignore-errors
"""Rows of surface contacts, and the contacts with sides of the room and with pinned circles.

A row holds the unit normal into the surface, the gap of the rim, the curvature of a path along it, the velocity of the surface,
its restitution and friction, and the warm-start impulses.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.obstacles import WAY
from pyverlet.core.pair_materials import bounce_of, combined, together
from pyverlet.core.step import CAGE, Step

SIDES = cython.declare(cython.int, 4)
"""Surfaces below are sides of the room: left, right, bottom, top of a box; a cage has side 0 only.

Larger numbers are segments; negative ones, -1 - k, the pinned circle in lane k of the pair list."""

CONTACT = cython.declare(cython.int, 24)
"""Columns of a row. Rows are stored by eights, so that a column of eight contacts is one vector: see `row_of`."""
NORMAL = cython.declare(cython.int, 8 * 0)  # x and y
NORMAL_Y = cython.declare(cython.int, 8 * 1)
GAP = cython.declare(cython.int, 8 * 2)  # m
BEND = cython.declare(cython.int, 8 * 3)  # curvature, 1/m; positive: towards the particle, as for a cage
SPEED = cython.declare(cython.int, 8 * 4)  # m/s, x and y
SPEED_Y = cython.declare(cython.int, 8 * 5)
BOUNCE = cython.declare(cython.int, 8 * 6)
COULOMB = cython.declare(cython.int, 8 * 7)
PUSH = cython.declare(cython.int, 8 * 8)  # normal and tangential impulse over the mass, m/s
DRAG = cython.declare(cython.int, 8 * 9)
ROLL = cython.declare(cython.int, 8 * 10)  # angular impulse of rolling resistance over the mass, m^2/s
EVENT_SPEED = cython.declare(cython.int, 8 * 11)  # as in `Step`, for this frame, while `records_events`
EVENT_BOUNCES = cython.declare(cython.int, 8 * 12)
EVENT = cython.declare(cython.int, 8 * 13)
BEFORE_CHAIN = cython.declare(cython.int, 8 * 14)  # PUSH and DRAG before a chain was solved
BEFORE_CHAIN_DRAG = cython.declare(cython.int, 8 * 15)
ROLL_MOST = cython.declare(cython.int, 8 * 16)  # its limit over PUSH: coefficient times radius, m
SPIN = cython.declare(cython.int, 8 * 17)  # of the surface, rad/s
HELD = cython.declare(cython.int, 8 * 18)  # by a one-way line: 1; -1: lets it pass; 0: unknown
AWAY = cython.declare(cython.int, 8 * 19)  # least distance from the rim, m; 0: the surface moves, or may
SEEN = cython.declare(cython.int, 8 * 20)  # position of the particle then, x and y
SEEN_Y = cython.declare(cython.int, 8 * 21)
RUNS = cython.declare(cython.int, 8 * 22)  # part of SPEED along (n_y, -n_x) by a belt or rotating rim
EVENT_IMPULSE = cython.declare(cython.int, 8 * 23)  # impulse in this frame, m/s, while `records_events`

GIVEN = cython.declare(cython.int, 4)
"""Columns of `Step.by_surface`: a velocity (2), and its parts out of the surface and along (n_y, -n_x), m/s."""

ROUNDED = cython.declare(cython.double, 1e-6)
"""Faces extend beyond their ends by this fraction of the reach, so that rounding leaves no gap at joints."""

FARAWAY = cython.declare(cython.double, 1e300)


@inlined
def row_of(k: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Where the row of contact k begins in `Step.contact`."""
    return CONTACT * (k & -8) + (k & 7)


@inlined
def clear_of(k: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Where that of contact k begins in `Step.clear`, also by eights: 8 and 16 places on are its other two columns."""
    return 3 * (k & -8) + (k & 7)


@inlined
def is_one_way(w: cython.pointer(Step), at: cython.Py_ssize_t) -> cython.bint:
    """Whether the segment whose row begins at `at` is one-way."""
    return w.segment[at + WAY] != 0 or w.segment[at + WAY + 1] != 0


@inlined
def is_passable(w: cython.pointer(Step), k: cython.Py_ssize_t, at: cython.Py_ssize_t) -> cython.bint:
    """Whether the segment of contact k, whose row begins at `at`, lets the particle pass in this substep."""
    return is_one_way(w, at) and w.contact[row_of(k) + HELD] <= 0


@inlined
def mix(
    w: cython.pointer(Step), i: cython.Py_ssize_t, first: cython.Py_ssize_t, e: cython.double, mu: cython.double,
    c: cython.double, material: cython.Py_ssize_t,
) -> cython.void:  # fmt: skip
    """Combine restitution, friction and rolling resistance of surface and particle, as `compose` does for pairs."""
    own: cython.double = w.own_restitution[w.mixed * i]
    e = bounce_of(w.combine, e, own) if own >= 0 else e
    own = w.own_friction[w.mixed * i]
    mu = combined(w.combine, mu, own) if own >= 0 else mu
    own = w.own_rolling[w.mixed * i]
    c = combined(w.combine, c, own) if own >= 0 else c
    if w.materials > 0:
        a: cython.Py_ssize_t = w.own_material[w.mixed * i]
        e, mu, c = together(w, a, material, 0, e), together(w, a, material, 1, mu), together(w, a, material, 2, c)
    w.contact[first + BOUNCE], w.contact[first + COULOMB], w.contact[first + ROLL_MOST] = e, mu, c * w.radius[i]


@kernel
def measure_side(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, late: cython.bint) -> cython.void:
    """Measure the contact k of particle i with a side of the room; late: only what may have changed in this substep."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    side: cython.int = w.surface[k]
    x: cython.double = w.position[2 * i]
    y: cython.double = w.position[2 * i + 1]
    r: cython.double = w.radius[i]
    gap: cython.double
    if w.boundary == CAGE:
        x -= w.x0
        y -= w.y0
        d: cython.double = sqrt(x * x + y * y)
        nx: cython.double = x / d if d > 0 else 1.0
        ny: cython.double = y / d if d > 0 else 0.0
        row[first + NORMAL], row[first + NORMAL_Y] = nx, ny
        row[first + SPEED], row[first + SPEED_Y] = -w.wall_speed * ny, w.wall_speed * nx
        gap = w.x1 - r - d
    elif side < 2:
        gap = x - r - w.x0 if side == 0 else w.x1 - r - x
    else:
        gap = y - r - w.y0 if side == 2 else w.y1 - r - y
    row[first + GAP] = row[first + AWAY] = gap
    if late:
        return
    row[first + BEND] = row[first + SPIN] = row[first + RUNS] = 0.0
    if w.boundary == CAGE:
        row[first + BEND] = 1 / (w.x1 - r) if w.x1 > r else 0.0
        row[first + SPIN] = w.wall_speed / w.x1
        row[first + RUNS] = -w.wall_speed
    else:
        row[first + SPEED] = row[first + SPEED_Y] = 0.0
        row[first + NORMAL] = -1.0 if side == 0 else 1.0 if side == 1 else 0.0
        row[first + NORMAL_Y] = -1.0 if side == 2 else 1.0 if side == 3 else 0.0
    mix(w, i, first, w.wall_restitution, w.wall_friction, w.wall_rolling, w.wall_material)


@inlined
def pinned_lane(w: cython.pointer(Step), k: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """The lane of the pair with the pinned circle of contact k."""
    return -1 - cython.cast(cython.Py_ssize_t, w.surface[k])


@inlined
def pinned_sign(w: cython.pointer(Step), lane: cython.Py_ssize_t) -> cython.double:
    """1 if the free circle is the second of the pair, to which its angular impulses apply, else -1."""
    return 1.0 if w.inverse_mass[w.i[lane]] == 0 else -1.0


@inlined
def keep_with_pair(w: cython.pointer(Step), k: cython.Py_ssize_t) -> cython.void:
    """Copy the state of a contact with a pinned circle to its pair, equally rounded, for saved worlds."""
    lane: cython.Py_ssize_t = pinned_lane(w, k)
    w.impulse[lane] = cython.cast(real, w.contact[row_of(k) + PUSH])
    w.contact[row_of(k) + PUSH] = w.impulse[lane]
    if w.rough:
        w.tangent_impulse[lane] = cython.cast(real, -w.contact[row_of(k) + DRAG])
        w.contact[row_of(k) + DRAG] = -w.tangent_impulse[lane]
    if w.rolls:
        sign: cython.double = pinned_sign(w, lane)
        w.roll_impulse[lane] = cython.cast(real, sign * w.contact[row_of(k) + ROLL])
        w.contact[row_of(k) + ROLL] = sign * w.roll_impulse[lane]


@kernel
def measure_pinned(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, late: cython.bint) -> cython.void:
    """Measure the contact k of particle i with a pinned circle; late: at the end of the substep."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    lane: cython.Py_ssize_t = pinned_lane(w, k)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    sign: cython.double = 1.0 if cython.cast(cython.Py_ssize_t, w.i[lane]) == i else -1.0
    j: cython.Py_ssize_t = w.j[lane] if sign > 0 else w.i[lane]
    x: cython.double = sign * w.gap_x[lane] + w.moved[2 * j]
    y: cython.double = sign * w.gap_y[lane] + w.moved[2 * j + 1]
    if late:  # the other may have drifted already or not
        way: cython.double = 0.0 if w.turned else w.h
        x += v[width * j] * way - (w.position[2 * i] - cython.cast(cython.double, w.listed[2 * i]))
        y += v[width * j + 1] * way
        y -= w.position[2 * i + 1] - cython.cast(cython.double, w.listed[2 * i + 1])
    else:
        x -= w.moved[2 * i]
        y -= w.moved[2 * i + 1]
    reach: cython.double = w.reach[lane * w.sized]
    distance: cython.double = sqrt(x * x + y * y)
    nx: cython.double = x / distance if distance > 0 else 1.0
    ny: cython.double = y / distance if distance > 0 else 0.0
    row[first + NORMAL], row[first + NORMAL_Y] = nx, ny
    row[first + GAP], row[first + BEND], row[first + AWAY] = distance - reach, -1 / reach, 0.0
    turn: cython.double = w.motion[4 * j + 2] * cython.cast(cython.double, w.radius[j]) if w.rough else 0.0
    row[first + SPEED], row[first + SPEED_Y] = v[width * j] + turn * ny, v[width * j + 1] - turn * nx
    row[first + RUNS] = turn
    row[first + BOUNCE], row[first + COULOMB] = w.restitution[lane * w.mixed], w.friction[lane * w.mixed]
    row[first + ROLL_MOST], row[first + SPIN] = w.rolling[lane * w.mixed], w.motion[4 * j + 2] if w.rough else 0.0
    w.normal_x[lane], w.normal_y[lane] = cython.cast(real, sign * nx), cython.cast(real, sign * ny)
    w.depth[lane] = cython.cast(real, reach - distance)
