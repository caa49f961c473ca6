# mypy: ignore-errors
"""Contact geometry of particles and obstacle segments, and particle motion in the frame of a segment."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.cells import image_of
from pyverlet.core.kernels import inlined, kernel
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
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import (
    AWAY,
    BEND,
    FARAWAY,
    GAP,
    NORMAL,
    NORMAL_Y,
    RUNS,
    SEEN,
    SEEN_Y,
    SIDES,
    SPEED,
    SPEED_Y,
    is_passable,
    measure_pinned,
    measure_side,
    mix,
    row_of,
)

Spot = cython.struct(
    x=cython.double,  # of the particle in the frame of a segment: its start is the origin, its end (length, 0)
    y=cython.double,
    c=cython.double,  # direction of the segment
    s=cython.double,
    length=cython.double,
    reach=cython.double,  # radius plus rounding
    left=cython.bint,  # whether points before its start, or beyond its end, belong to the neighbour
    right=cython.bint,
    behind=cython.bint,  # whether it is on the inner side of a face of a polygon, and not beyond its corner
    above=cython.bint,  # whether it was at positive y at its last impact, which changes its extrapolated start
    wx=cython.double,  # position in the room
    wy=cython.double,
)

Path = cython.struct(ux=cython.double, uy=cython.double, ax=cython.double, ay=cython.double)
"""Velocity in the middle of a substep and acceleration, in the frame of a segment that moves with it."""


@inlined
def path_of(w: cython.pointer(Step), i: cython.Py_ssize_t, at: cython.Py_ssize_t, p: cython.pointer(Spot)) -> Path:
    """Motion of particle i in the frame of the segment whose row begins at `at`; for length 0 rotation may be ignored.

    In a frame that turns by w, u = v - V - w x r and a' = a - 2 w x u + w^2 r, from its pivot and at the start of the substep.
    """
    f: Path
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
    turn: cython.double = w.body[b + 5]
    ax: cython.double = w.acceleration[2 * i]
    ay: cython.double = w.acceleration[2 * i + 1]
    ux: cython.double = v[width * i] - w.body[b + 3]
    uy: cython.double = v[width * i + 1] - w.body[b + 4]
    if turn != 0:
        now: cython.double = w.substep * cython.cast(cython.double, w.h)
        half: cython.double = 0.5 * w.h
        rx: cython.double = (w.segment[at + PLACE] if p.length == 0 else p.wx) - (w.body[b] + w.body[b + 3] * now)
        ry: cython.double = (w.segment[at + PLACE + 1] if p.length == 0 else p.wy) - (w.body[b + 1] + w.body[b + 4] * now)
        ux += turn * ry - ax * half
        uy -= turn * rx + ay * half
        ax += turn * turn * rx
        ay += turn * turn * ry
        if p.length > 0:
            ax += 2 * turn * uy
            ay -= 2 * turn * ux
        ux += ax * half
        uy += ay * half
    f.ux, f.uy = p.c * ux + p.s * uy, p.c * uy - p.s * ux
    f.ax, f.ay = p.c * ax + p.s * ay, p.c * ay - p.s * ax
    return f


@inlined
def spot_of(w: cython.pointer(Step), i: cython.Py_ssize_t, at: cython.Py_ssize_t, to: cython.int) -> Spot:
    """Position of particle i in the frame of the segment whose row begins at `at`, at `to`: PLACE or LATE."""
    p: Spot
    p.wx = image_of(w.position[2 * i], w.checked[2 * i], w.cells.low_x, w.cells.period_x)
    p.wy = image_of(w.position[2 * i + 1], w.checked[2 * i + 1], w.cells.low_y, w.cells.period_y)
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
    if since > 0 and to == PLACE:
        f: Path = path_of(w, i, at, cython.address(p))
        late += (f.uy - 0.5 * f.ay * (w.h - since)) * since
    p.above = late >= 0
    p.left = p.x < 0 and p.x * before_x + p.y * before_y > 0
    # At a sharp corner, points before the start of a face may be on the inner side of its line.
    p.behind = w.segment[at + FACES] > 0 and p.above and (p.x >= 0 or p.left)
    # A joint belongs to the segment that starts there.
    p.right = beyond > 0 and (after_x != 0 or after_y != 0)
    return p


@kernel
def depth_inside(w: cython.pointer(Step), at: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.double:
    """Distance of (x, y) from the nearest face of this segment's polygon, m; negative if outside."""
    first: cython.Py_ssize_t = cython.cast(int64_t, w.segment[at + FIRST_FACE])
    count: cython.Py_ssize_t = cython.cast(int64_t, w.segment[at + FACES])
    least: cython.double = FARAWAY
    for k in range(SEGMENT * first, SEGMENT * (first + count), 40):
        ox: cython.double = x - w.segment[k + PLACE]
        oy: cython.double = y - w.segment[k + PLACE + 1]
        least = min(least, w.segment[k + PLACE + 2] * oy - w.segment[k + PLACE + 3] * ox)
    return least


@inlined
def moves(w: cython.pointer(Step), at: cython.Py_ssize_t) -> cython.bint:
    """Whether the obstacle of the segment whose row begins at `at` moves or turns."""
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
    return w.body[b + 3] != 0 or w.body[b + 4] != 0 or w.body[b + 5] != 0


@inlined
def distance_from_region(w: cython.pointer(Step), at: cython.Py_ssize_t, p: cython.pointer(Spot)) -> cython.double:
    """Least distance between a particle in a neighbour's region and the nearest point of the segment's own region, m."""
    if p.right:
        return p.x - p.length
    x: cython.double = w.segment[at + BEFORE]
    y: cython.double = w.segment[at + BEFORE + 1]
    return min(-p.x, (p.x * x + p.y * y) / (fabs(x) + fabs(y)))


@kernel
def measure_segment(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, late: cython.bint) -> cython.void:
    """Measure the contact k of particle i with a segment; late: at the end of the substep."""
    at: cython.Py_ssize_t = SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    p: Spot = spot_of(w, i, at, LATE if late else PLACE)
    near: cython.double = min(max(p.x, 0.0), p.length)
    nx: cython.double = 0.0
    ny: cython.double = -1.0 if p.above else 1.0
    row[first + BEND] = 0.0
    away: cython.double = max(fabs(p.x - near), fabs(p.y)) - p.reach
    if is_passable(w, k, at):
        row[first + GAP] = FARAWAY
    elif p.behind:
        inside: cython.double = depth_inside(w, at, p.wx, p.wy)
        ny = 1.0
        row[first + GAP] = -(p.reach + p.y) if inside == p.y and inside > 0 else FARAWAY
        away = 0.0 if inside > 0 else away
    elif p.left or p.right:
        row[first + GAP] = FARAWAY
        away = max(away, distance_from_region(w, at, cython.address(p)))
        before_x: cython.double = w.segment[at + BEFORE]
        before_y: cython.double = w.segment[at + BEFORE + 1]
        if p.left and ny * before_y > 0:  # around the joint: the neighbour holds it
            side: cython.double = ny / sqrt(before_x * before_x + before_y * before_y)
            nx, ny = side * before_y, -side * before_x
    elif near == p.x and p.length > 0:
        row[first + GAP] = away = -ny * p.y - p.reach
    else:
        distance: cython.double = sqrt((p.x - near) * (p.x - near) + p.y * p.y)
        row[first + GAP] = away = distance - p.reach
        row[first + BEND] = -1.0 / p.reach
        if distance > 0:
            nx, ny = (near - p.x) / distance, -p.y / distance
    row[first + AWAY] = 0.0 if moves(w, at) else away
    set_surface(w, i, first, at, cython.address(p), nx, ny, w.h if late else 0.0)


@inlined
def set_surface(
    w: cython.pointer(Step), i: cython.Py_ssize_t, first: cython.Py_ssize_t, at: cython.Py_ssize_t, p: cython.pointer(Spot),
    nx: cython.double, ny: cython.double, since: cython.double,
) -> cython.void:  # fmt: skip
    """Set the normal (nx, ny), given in the frame of the segment, and the velocity of its surface there."""
    row: cython.pointer(cython.double) = w.contact
    x: cython.double = p.c * nx - p.s * ny
    y: cython.double = p.s * nx + p.c * ny
    row[first + NORMAL], row[first + NORMAL_Y] = x, y
    set_surface_speed(w, first, at, p.wx + w.radius[i] * x, p.wy + w.radius[i] * y, x, y, since)
    if since == 0:  # else they were combined at the start of the substep
        e: cython.double = w.segment[at + RESTITUTION]
        material: cython.Py_ssize_t = cython.cast(int64_t, w.segment[at + MATERIAL])
        mix(w, i, first, e, w.segment[at + FRICTION], w.segment[at + ROLLS], material)
    row[first + SPIN] = w.body[6 * cython.cast(int64_t, w.segment[at + BODY_OF]) + 5]


@inlined
def belt_share(
    w: cython.pointer(Step), at: cython.Py_ssize_t, nx: cython.double, ny: cython.double
) -> cython.double:  # fmt: skip
    """Fraction of a belt's speed along (ny, -nx), where its normal is (nx, ny)."""
    along_x: cython.double = w.segment[at + PLACE + 2]
    along_y: cython.double = w.segment[at + PLACE + 3]
    x: cython.double = along_x * nx + along_y * ny
    y: cython.double = along_x * ny - along_y * nx
    before_x: cython.double = w.segment[at + BEFORE]
    before_y: cython.double = w.segment[at + BEFORE + 1]
    if w.segment[at + AROUND] != 0:
        return 1.0
    if x <= 0 or (before_x == 0 and before_y == 0):
        return y  # at a free end two sides meet that run the same way
    # Around a joint it has full speed, in the direction of the segment that is more parallel to the surface there.
    other: cython.double = (before_y * x - before_x * y) / sqrt(before_x * before_x + before_y * before_y)
    return 1.0 if (y if fabs(y) > fabs(other) else other) > 0 else -1.0


@inlined
def set_surface_speed(
    w: cython.pointer(Step), first: cython.Py_ssize_t, at: cython.Py_ssize_t, x: cython.double, y: cython.double,
    nx: cython.double, ny: cython.double, since: cython.double,
) -> cython.void:  # fmt: skip
    """Set the surface velocity of a segment at (x, y) with normal (nx, ny), `since` seconds into the substep."""
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
    turn: cython.double = w.body[b + 5]
    now: cython.double = w.substep * cython.cast(cython.double, w.h) + since
    rx: cython.double = x - (w.body[b] + w.body[b + 3] * now)
    ry: cython.double = y - (w.body[b + 1] + w.body[b + 4] * now)
    belt: cython.double = w.segment[at + BELT] * belt_share(w, at, nx, ny)
    w.contact[first + SPEED] = w.body[b + 3] - turn * ry + belt * ny
    w.contact[first + SPEED_Y] = w.body[b + 4] + turn * rx - belt * nx
    w.contact[first + RUNS] = belt + turn * w.segment[at + ROUNDING]


@kernel
def measure_surface(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, late: cython.bint) -> cython.void:
    """Measure contact k of particle i; late: at the end of the substep, after it was measured at its start."""
    if w.surface[k] < 0:
        measure_pinned(w, i, k, late)
    elif w.surface[k] < SIDES:
        measure_side(w, i, k, late)
    else:
        measure_segment(w, i, k, late)
    w.contact[row_of(k) + SEEN], w.contact[row_of(k) + SEEN_Y] = w.position[2 * i], w.position[2 * i + 1]
