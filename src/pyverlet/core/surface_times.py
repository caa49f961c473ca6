# mypy: ignore-errors
"""Times at which particles hit surfaces within a substep, and the normals there. Paths and times as in `core.impacts`."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import cos, sin, sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.cells import image_of
from pyverlet.core.impacts import NEVER
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.obstacles import AFTER, BEFORE, BODY_OF, FACES, PLACE, SEGMENT
from pyverlet.core.step import CAGE, Step
from pyverlet.core.surface_rows import GAP, NORMAL, NORMAL_Y, ROUNDED, SIDES, SPEED, SPEED_Y, is_passable, pinned_lane, row_of
from pyverlet.core.surface_shapes import Path, Spot, path_of, set_surface_speed, spot_of

Hit = cython.struct(time=cython.double, nx=cython.double, ny=cython.double)


@inlined
def flat_time(gap: cython.double, u: cython.double, a: cython.double, h: cython.double, since: cython.double) -> cython.double:
    """When a rim approaching a plane with u in the middle of the substep touches it, s; not before `since`."""
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


@kernel
def round_time(
    x: cython.double, y: cython.double, ux: cython.double, uy: cython.double, ax: cython.double, ay: cython.double,
    reach: cython.double, h: cython.double, since: cython.double, out: cython.bint,
) -> cython.double:  # fmt: skip
    """When a path reaches the distance `reach` from the origin, s: from inside if `out`, else outside; not before `since`."""
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
    for _ in range(2):  # Newton steps for the curvature of the path
        t = min(t, h)  # from far beyond the end of the substep they may lead anywhere
        half: cython.double = 0.5 * t * (h - t)
        px: cython.double = x + ux * t - ax * half
        py: cython.double = y + uy * t - ay * half
        slope: cython.double = 2 * (px * (ux + ax * (t - 0.5 * h)) + py * (uy + ay * (t - 0.5 * h)))
        if slope <= 0 if out else slope >= 0:
            return NEVER
        t -= (px * px + py * py - reach * reach) / slope
    t = max(t, since)
    return t if t < h else NEVER


@kernel
def time_to_round(
    x: cython.double, y: cython.double, ux: cython.double, uy: cython.double, ax: cython.double, ay: cython.double,
    reach: cython.double, h: cython.double, since: cython.double, out: cython.bint,
) -> Hit:  # fmt: skip
    """As `round_time`, with the normal there: away from the origin if `out`, else towards it."""
    hit: Hit
    hit.time = round_time(x, y, ux, uy, ax, ay, reach, h, since, out)
    hit.nx, hit.ny = 1.0, 0.0
    if hit.time != NEVER:
        half: cython.double = 0.5 * hit.time * (h - hit.time)
        x += ux * hit.time - ax * half
        y += uy * hit.time - ay * half
        d: cython.double = sqrt(x * x + y * y) if out else -sqrt(x * x + y * y)
        if d != 0:
            hit.nx, hit.ny = x / d, y / d
    return hit


@kernel
def time_to_side(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, since: cython.double) -> Hit:
    """When particle i hits the side of contact k."""
    hit: Hit
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    ux: cython.double = v[width * i]
    uy: cython.double = v[width * i + 1]
    ax: cython.double = w.acceleration[2 * i]
    ay: cython.double = w.acceleration[2 * i + 1]
    if w.boundary == CAGE:
        x: cython.double = w.position[2 * i] - w.x0
        y: cython.double = w.position[2 * i + 1] - w.y0
        return time_to_round(x, y, ux, uy, ax, ay, w.x1 - w.radius[i], w.h, since, True)
    hit.nx, hit.ny = row[first + NORMAL], row[first + NORMAL_Y]
    hit.time = flat_time(row[first + GAP], ux * hit.nx + uy * hit.ny, ax * hit.nx + ay * hit.ny, w.h, since)
    return hit


@kernel
def time_to_pinned(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, since: cython.double) -> Hit:
    """When particle i hits the pinned circle of contact k."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    lane: cython.Py_ssize_t = pinned_lane(w, k)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    j: cython.Py_ssize_t = w.j[lane] if cython.cast(cython.Py_ssize_t, w.i[lane]) == i else w.i[lane]
    reach: cython.double = w.reach[lane * w.sized]
    d: cython.double = row[first + GAP] + reach
    ux: cython.double = v[width * i] - cython.cast(cython.double, v[width * j])
    uy: cython.double = v[width * i + 1] - cython.cast(cython.double, v[width * j + 1])
    x: cython.double = -d * row[first + NORMAL]
    y: cython.double = -d * row[first + NORMAL_Y]
    return time_to_round(x, y, ux, uy, w.acceleration[2 * i], w.acceleration[2 * i + 1], reach, w.h, since, False)


@kernel
def time_to_segment(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, since: cython.double) -> Hit:
    """When particle i hits the segment of contact k: its face, or an end."""
    hit: Hit
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    at: cython.Py_ssize_t = SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)
    h: cython.double = w.h
    hit.time, hit.nx, hit.ny = NEVER, row[first + NORMAL], row[first + NORMAL_Y]
    if since == 0 and row[first + GAP] <= 0:
        hit.time = 0.0
        return hit
    p: Spot = spot_of(w, i, at, PLACE)
    if is_passable(w, k, at):
        return hit
    f: Path = path_of(w, i, at, cython.address(p))
    nx: cython.double = 0.0
    ny: cython.double = -1.0 if p.above else 1.0
    t: cython.double
    soonest: cython.double = since if since > 0 else 1e-300
    if p.length > 0 and not (w.segment[at + FACES] > 0 and p.above):
        t = flat_time(-ny * p.y - p.reach, f.uy * ny, f.ay * ny, h, soonest)
        if t != NEVER:
            x: cython.double = p.x + f.ux * t - 0.5 * f.ax * t * (h - t)
            slack: cython.double = ROUNDED * p.reach
            if -slack <= x <= p.length + slack:
                hit.time = t
    end: cython.int
    for end in range(1 if p.length == 0 else 2):
        if end == 1 and (w.segment[at + AFTER] != 0 or w.segment[at + AFTER + 1] != 0):
            continue  # belongs to the segment that starts there
        about: Hit = time_to_round(p.x - p.length * end, p.y, f.ux, f.uy, f.ax, f.ay, p.reach, h, soonest, False)
        if about.time < hit.time:
            outside: cython.bint = p.length == 0 or (about.nx <= 0 if end == 1 else about.nx >= 0)
            if outside and (end == 1 or not about.nx * w.segment[at + BEFORE] + about.ny * w.segment[at + BEFORE + 1] < 0):
                hit.time, nx, ny = about.time, about.nx, about.ny
    if hit.time == NEVER:
        return hit
    c: cython.double = p.c
    s: cython.double = p.s
    turned: cython.double = w.body[6 * cython.cast(int64_t, w.segment[at + BODY_OF]) + 5] * hit.time
    if turned != 0 and p.length > 0:  # for round obstacles paths are not taken in a rotating frame
        c, s = p.c * cos(turned) - p.s * sin(turned), p.s * cos(turned) + p.c * sin(turned)
    hit.nx, hit.ny = c * nx - s * ny, s * nx + c * ny
    return hit


@kernel
def time_to_surface(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, since: cython.double) -> Hit:
    """When particle i hits the surface of contact k, NEVER if not in this substep; and the normal there. Not before `since`."""
    if w.surface[k] < 0:
        return time_to_pinned(w, i, k, since)
    if w.surface[k] < SIDES:
        return time_to_side(w, i, k, since)
    return time_to_segment(w, i, k, since)


@kernel
def set_speed(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, hit: cython.pointer(Hit)) -> cython.void:
    """Set the velocity of the surface of contact k at the point of impact."""
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    turn: cython.double = row[first + SPEED] * row[first + NORMAL_Y] - row[first + SPEED_Y] * row[first + NORMAL]
    if w.surface[k] >= SIDES:
        at: cython.Py_ssize_t = SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)
        half: cython.double = 0.5 * hit.time * (w.h - hit.time)
        x: cython.double = image_of(w.position[2 * i], w.checked[2 * i], w.cells.low_x, w.cells.period_x)
        y: cython.double = image_of(w.position[2 * i + 1], w.checked[2 * i + 1], w.cells.low_y, w.cells.period_y)
        x += v[width * i] * hit.time - w.acceleration[2 * i] * half
        y += v[width * i + 1] * hit.time - w.acceleration[2 * i + 1] * half
        set_surface_speed(w, first, at, x + w.radius[i] * hit.nx, y + w.radius[i] * hit.ny, hit.nx, hit.ny, hit.time)
    elif w.surface[k] >= 0:  # for a cage; 0 for others
        row[first + SPEED], row[first + SPEED_Y] = turn * hit.ny, -turn * hit.nx
    else:
        lane: cython.Py_ssize_t = pinned_lane(w, k)
        j: cython.Py_ssize_t = w.j[lane] if cython.cast(cython.Py_ssize_t, w.i[lane]) == i else w.i[lane]
        turn = w.motion[4 * j + 2] * cython.cast(cython.double, w.radius[j]) if w.rough else 0.0
        row[first + SPEED], row[first + SPEED_Y] = v[width * j] + turn * hit.ny, v[width * j + 1] - turn * hit.nx
