# mypy: ignore-errors
"""Where particles touch surfaces, the sides of a room and the segments of obstacles, and when they meet them.

A contact is a row of numbers: the unit normal into the surface, the gap of the rim, how the path of a particle that slides along
it bends, the velocity of the surface, its restitution and friction, and the impulses that the contact remembers.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.cells import wrapped
from pyverlet.core.impacts import NEVER
from pyverlet.core.obstacles import (
    AFTER,
    AROUND,
    BEFORE,
    BELT,
    BODY_OF,
    FACES,
    FIRST_FACE,
    FRICTION,
    LATE,
    LENGTH,
    PLACE,
    RESTITUTION,
    ROUNDING,
    SEGMENT,
)
from pyverlet.core.step import CAGE, Step

SIDES = cython.declare(cython.int, 4)
"""Surfaces below are sides of the room: left, right, bottom, top of a box; a cage has side 0 only."""

CONTACT = cython.declare(cython.int, 10)
NORMAL = cython.declare(cython.int, 0)  # (2)
GAP = cython.declare(cython.int, 2)  # m
BEND = cython.declare(cython.int, 3)  # 1/m; positive: the surface bends towards the particle, as a cage does
SPEED = cython.declare(cython.int, 4)  # (2) m/s
BOUNCE = cython.declare(cython.int, 6)
RUB = cython.declare(cython.int, 7)
PUSH = cython.declare(cython.int, 8)  # impulses along the normal and the tangent over the mass, m/s
DRAG = cython.declare(cython.int, 9)

ROUNDED = cython.declare(cython.double, 1e-6)
"""Of the reach: a face goes on so far beyond its ends, for what touches it at a joint to meet it in spite of rounding."""

FARAWAY = cython.declare(cython.double, 1e300)

Spot = cython.struct(
    x=cython.double,  # of a particle, in the frame of a segment: its start is the origin, its end (length, 0)
    y=cython.double,
    c=cython.double,  # direction of the segment
    s=cython.double,
    length=cython.double,
    reach=cython.double,  # radius and rounding
    left=cython.bint,  # whether what is before its start, or beyond its end, belongs to the neighbour
    right=cython.bint,
    above=cython.bint,  # whether it is on the side of greater y, as of its last impact: that moves where its path begins
    wx=cython.double,  # of the particle in the room
    wy=cython.double,
)

Hit = cython.struct(time=cython.double, nx=cython.double, ny=cython.double)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def spot_of(w: cython.pointer(Step), i: cython.Py_ssize_t, at: cython.Py_ssize_t, to: cython.int) -> Spot:
    """Particle i as the segment whose row begins at `at` sees it, as it stands at `to`: PLACE or LATE."""
    p: Spot
    p.wx = wrapped(w.position[2 * i], w.cells.low_x, w.cells.period_x)
    p.wy = wrapped(w.position[2 * i + 1], w.cells.low_y, w.cells.period_y)
    p.c = w.segment[at + to + 2]
    p.s = w.segment[at + to + 3]
    ox: cython.double = p.wx - w.segment[at + to]
    oy: cython.double = p.wy - w.segment[at + to + 1]
    p.x = p.c * ox + p.s * oy
    p.y = p.c * oy - p.s * ox
    p.length = w.segment[at + LENGTH]
    p.reach = w.segment[at + ROUNDING] + w.radius[i]
    beyond: cython.double = p.x - p.length
    before_x: cython.double = w.segment[at + BEFORE]
    before_y: cython.double = w.segment[at + BEFORE + 1]
    after_x: cython.double = w.segment[at + AFTER]
    after_y: cython.double = w.segment[at + AFTER + 1]
    since: cython.double = w.since[i]
    late: cython.double = p.y
    if since > 0:
        width: cython.Py_ssize_t = 4 if w.rough else 2
        v: cython.pointer(real) = w.motion if w.rough else w.velocity
        b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
        half: cython.double = 0.5 * (w.h - since)
        ox = v[width * i] - w.acceleration[2 * i] * half - w.body[b + 3]
        oy = v[width * i + 1] - w.acceleration[2 * i + 1] * half - w.body[b + 4]
        late += (p.c * oy - p.s * ox) * since
    p.above = late >= 0
    p.left = p.x < 0 and p.x * before_x + p.y * before_y > 0
    # A joint belongs to the segment that begins there.
    p.right = beyond > 0 and (after_x != 0 or after_y != 0)
    return p


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def depth_inside(w: cython.pointer(Step), at: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.double:
    """How far (x, y) is from the nearest face of the polygon of this segment, m; negative: it is not inside."""
    k: cython.Py_ssize_t
    first: cython.Py_ssize_t = cython.cast(int64_t, w.segment[at + FIRST_FACE])
    count: cython.Py_ssize_t = cython.cast(int64_t, w.segment[at + FACES])
    least: cython.double = FARAWAY
    for k in range(SEGMENT * first, SEGMENT * (first + count), 32):
        ox: cython.double = x - w.segment[k + PLACE]
        oy: cython.double = y - w.segment[k + PLACE + 1]
        least = min(least, w.segment[k + PLACE + 2] * oy - w.segment[k + PLACE + 3] * ox)
    return least


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def measure_segment(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, late: cython.bint) -> cython.void:
    """Where particle i is nearest to the segment of contact k; late: at the end of the substep."""
    at: cython.Py_ssize_t = SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = CONTACT * k
    p: Spot = spot_of(w, i, at, LATE if late else PLACE)
    near: cython.double = min(max(p.x, 0.0), p.length)
    nx: cython.double = 0.0
    ny: cython.double = -1.0 if p.above else 1.0
    row[first + BEND] = 0.0
    if w.segment[at + FACES] > 0 and p.above:  # behind the face
        inside: cython.double = depth_inside(w, at, p.wx, p.wy)
        ny = 1.0
        row[first + GAP] = -(p.reach + p.y) if inside == p.y and inside > 0 else FARAWAY
    elif p.left or p.right:
        row[first + GAP] = FARAWAY
    elif near == p.x and p.length > 0:
        row[first + GAP] = -ny * p.y - p.reach
    else:
        distance: cython.double = sqrt((p.x - near) * (p.x - near) + p.y * p.y)
        row[first + GAP] = distance - p.reach
        row[first + BEND] = -1.0 / p.reach
        if distance > 0:
            nx, ny = (near - p.x) / distance, -p.y / distance
    set_surface(w, i, first, at, cython.address(p), nx, ny)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def set_surface(
    w: cython.pointer(Step), i: cython.Py_ssize_t, first: cython.Py_ssize_t, at: cython.Py_ssize_t, p: cython.pointer(Spot),
    nx: cython.double, ny: cython.double,
) -> cython.void:  # fmt: skip
    """The normal (nx, ny), given in the frame of the segment, and the velocity of its surface there."""
    row: cython.pointer(cython.double) = w.contact
    x: cython.double = p.c * nx - p.s * ny
    y: cython.double = p.s * nx + p.c * ny
    row[first + NORMAL], row[first + NORMAL + 1] = x, y
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
    spin: cython.double = w.body[b + 5]
    now: cython.double = w.substep * cython.cast(cython.double, w.h)
    ax: cython.double = p.wx + w.radius[i] * x - (w.body[b] + w.body[b + 3] * now)
    ay: cython.double = p.wy + w.radius[i] * y - (w.body[b + 1] + w.body[b + 4] * now)
    belt: cython.double = w.segment[at + BELT]
    tx: cython.double = y if w.segment[at + AROUND] != 0 else p.c
    ty: cython.double = -x if w.segment[at + AROUND] != 0 else p.s
    row[first + SPEED] = w.body[b + 3] - spin * ay + belt * tx
    row[first + SPEED + 1] = w.body[b + 4] + spin * ax + belt * ty
    mix(w, i, first, w.segment[at + RESTITUTION], w.segment[at + FRICTION])


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def mix(
    w: cython.pointer(Step), i: cython.Py_ssize_t, first: cython.Py_ssize_t, e: cython.double, mu: cython.double
) -> cython.void:
    """Restitution and friction of a surface and of what touches it: the larger one, and the geometric mean, as in Box2D."""
    own: cython.double = w.own_friction[i]
    w.contact[first + BOUNCE] = max(e, cython.cast(cython.double, w.own_restitution[i]))
    w.contact[first + RUB] = sqrt(mu * own) if own >= 0 else mu


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def measure_side(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t) -> cython.void:
    """Where particle i is nearest to the side of the room of contact k."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = CONTACT * k
    side: cython.int = w.surface[k]
    x: cython.double = w.position[2 * i]
    y: cython.double = w.position[2 * i + 1]
    r: cython.double = w.radius[i]
    row[first + SPEED] = row[first + SPEED + 1] = row[first + BEND] = 0.0
    if w.room == CAGE:
        x -= w.x0
        y -= w.y0
        d: cython.double = sqrt(x * x + y * y)
        nx: cython.double = x / d if d > 0 else 1.0
        ny: cython.double = y / d if d > 0 else 0.0
        row[first + NORMAL], row[first + NORMAL + 1] = nx, ny
        row[first + GAP] = w.x1 - r - d
        row[first + BEND] = 1 / (w.x1 - r) if w.x1 > r else 0.0
        row[first + SPEED], row[first + SPEED + 1] = -w.wall_speed * ny, w.wall_speed * nx
    else:
        row[first + NORMAL] = -1.0 if side == 0 else 1.0 if side == 1 else 0.0
        row[first + NORMAL + 1] = -1.0 if side == 2 else 1.0 if side == 3 else 0.0
        if side == 0:
            row[first + GAP] = x - r - w.x0
        elif side == 1:
            row[first + GAP] = w.x1 - r - x
        elif side == 2:
            row[first + GAP] = y - r - w.y0
        else:
            row[first + GAP] = w.y1 - r - y
    mix(w, i, first, w.wall_restitution, w.wall_friction)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def measure_surface(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, late: cython.bint) -> cython.void:
    """Contact k of particle i as it is now."""
    if w.surface[k] < SIDES:
        measure_side(w, i, k)
    else:
        measure_segment(w, i, k, late)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def flat_time(gap: cython.double, u: cython.double, a: cython.double, h: cython.double, since: cython.double) -> cython.double:
    """When a rim meets a plane that it comes to with u in the middle of the substep, s; not before `since`."""
    if gap <= 0 and since == 0:
        return 0.0
    if u <= 0:
        return NEVER
    t: cython.double = gap / u
    _: cython.int
    for _ in range(2):
        rate: cython.double = u + a * (t - 0.5 * h)
        if rate <= 0:
            return NEVER
        t -= (u * t - 0.5 * a * t * (h - t) - gap) / rate
    t = max(t, since)
    return t if t < h else NEVER


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def round_time(
    x: cython.double, y: cython.double, ux: cython.double, uy: cython.double, ax: cython.double, ay: cython.double,
    reach: cython.double, h: cython.double, since: cython.double, out: cython.bint,
) -> cython.double:  # fmt: skip
    """When a path comes to be `reach` away from the origin, s: from within if `out`, else from without; not before `since`."""
    near: cython.double = x * x + y * y - reach * reach
    if since == 0 and (near >= 0 if out else near <= 0):
        return 0.0
    along: cython.double = x * ux + y * uy
    square: cython.double = ux * ux + uy * uy
    root: cython.double = along * along - square * near
    if square == 0 or root < 0 or (not out and along >= 0):
        return NEVER
    root = sqrt(root)
    t: cython.double
    if out:
        t = -near / (along + root) if along > 0 else (root - along) / square
    else:
        t = near / (root - along)
    _: cython.int
    for _ in range(2):  # Newton's steps for the bend of the path
        half: cython.double = 0.5 * t * (h - t)
        px: cython.double = x + ux * t - ax * half
        py: cython.double = y + uy * t - ay * half
        slope: cython.double = 2 * (px * (ux + ax * (t - 0.5 * h)) + py * (uy + ay * (t - 0.5 * h)))
        if slope <= 0 if out else slope >= 0:
            return NEVER
        t -= (px * px + py * py - reach * reach) / slope
    t = max(t, since)
    return t if t < h else NEVER


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def meet_side(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, ux: cython.double, uy: cython.double,
    since: cython.double,
) -> Hit:  # fmt: skip
    """When particle i meets the side of contact k, and the normal there."""
    hit: Hit
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = CONTACT * k
    h: cython.double = w.h
    ax: cython.double = w.acceleration[2 * i]
    ay: cython.double = w.acceleration[2 * i + 1]
    hit.nx, hit.ny = row[first + NORMAL], row[first + NORMAL + 1]
    if w.room == CAGE:
        px: cython.double = w.position[2 * i] - w.x0
        py: cython.double = w.position[2 * i + 1] - w.y0
        hit.time = round_time(px, py, ux, uy, ax, ay, w.x1 - w.radius[i], h, since, True)
        if hit.time != NEVER:
            half: cython.double = 0.5 * hit.time * (h - hit.time)
            px += ux * hit.time - ax * half
            py += uy * hit.time - ay * half
            d: cython.double = sqrt(px * px + py * py)
            if d > 0:
                hit.nx, hit.ny = px / d, py / d
    else:
        hit.time = flat_time(row[first + GAP], ux * hit.nx + uy * hit.ny, ax * hit.nx + ay * hit.ny, h, since)
    return hit


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def meet_segment(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, ux: cython.double, uy: cython.double,
    since: cython.double,
) -> Hit:  # fmt: skip
    """When particle i, at (ux, uy) against its surface, meets the segment of contact k: over its face, or about an end."""
    hit: Hit
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = CONTACT * k
    at: cython.Py_ssize_t = SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)
    h: cython.double = w.h
    hit.time, hit.nx, hit.ny = NEVER, row[first + NORMAL], row[first + NORMAL + 1]
    if since == 0 and row[first + GAP] <= 0:
        hit.time = 0.0
        return hit
    p: Spot = spot_of(w, i, at, PLACE)
    if w.segment[at + FACES] > 0 and p.above:
        return hit
    vx: cython.double = p.c * ux + p.s * uy
    vy: cython.double = p.c * uy - p.s * ux
    ax: cython.double = p.c * w.acceleration[2 * i] + p.s * w.acceleration[2 * i + 1]
    ay: cython.double = p.c * w.acceleration[2 * i + 1] - p.s * w.acceleration[2 * i]
    nx: cython.double = 0.0
    ny: cython.double = -1.0 if p.above else 1.0
    x: cython.double
    y: cython.double
    half: cython.double
    t: cython.double
    if p.length > 0:
        t = flat_time(-ny * p.y - p.reach, vy * ny, ay * ny, h, since if since > 0 else 1e-300)
        if t != NEVER:
            x = p.x + vx * t - 0.5 * ax * t * (h - t)
            slack: cython.double = ROUNDED * p.reach
            if -slack <= x <= p.length + slack:
                hit.time = t
    end: cython.int
    for end in range(1 if p.length == 0 else 2):
        if end == 1 and (w.segment[at + AFTER] != 0 or w.segment[at + AFTER + 1] != 0):
            continue  # of the segment that begins there
        from_x: cython.double = p.x - p.length * end
        t = round_time(from_x, p.y, vx, vy, ax, ay, p.reach, h, since if since > 0 else 1e-300, False)
        if t < hit.time:
            half = 0.5 * t * (h - t)
            x = from_x + vx * t - ax * half
            y = p.y + vy * t - ay * half
            outside: cython.bint = p.length == 0 or (x >= 0 if end == 1 else x <= 0)
            if outside and (end == 1 or not x * w.segment[at + BEFORE] + y * w.segment[at + BEFORE + 1] > 0):
                hit.time, nx, ny = t, -x / p.reach, -y / p.reach
    hit.nx, hit.ny = p.c * nx - p.s * ny, p.s * nx + p.c * ny
    return hit
