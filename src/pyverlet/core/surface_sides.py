# mypy: ignore-errors
"""Keeps particles on their side of lines, in spite of impacts that were not resolved in the order of their times.

A pair may collide before one of its particles hits a line, and be solved afterwards: the path then differs from the one that
bounced. Particles that are thrown fast may reach lines that are not in their contact list, and so may particles that links pull
out of the room.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, floor, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.cells import BLOCK
from pyverlet.core.impacts import NEVER, strike
from pyverlet.core.kernels import kernel
from pyverlet.core.obstacles import BODY_OF, FACES, LENGTH, PLACE, ROUNDING, SEGMENT, SENSOR, accepts, accepts_segment
from pyverlet.core.one_way import stops
from pyverlet.core.periodic import wrapped
from pyverlet.core.segments import head_at
from pyverlet.core.step import CAGE, OPEN, Step
from pyverlet.core.surface_rows import is_one_way
from pyverlet.core.work import add_place_work

Way = cython.struct(x=cython.double, y=cython.double, dx=cython.double, dy=cython.double)
"""The path of a particle in a substep: start and displacement, m."""


@kernel
def crossing(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, way: cython.pointer(Way)) -> cython.double:
    """The fraction of a path of particle i at which it crosses line k, if they collide, else NEVER."""
    at: cython.Py_ssize_t = SEGMENT * k
    if w.segment[at + FACES] > 0 or w.segment[at + LENGTH] == 0 or w.segment[at + SENSOR] != 0 or not accepts_segment(w, i, k):
        return NEVER
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[at + BODY_OF])
    h: cython.double = w.h
    c: cython.double = w.segment[at + PLACE + 2]
    s: cython.double = w.segment[at + PLACE + 3]
    x: cython.double = way.x - w.segment[at + PLACE]
    y: cython.double = way.y - w.segment[at + PLACE + 1]
    dx: cython.double = way.dx - w.body[b + 3] * h
    dy: cython.double = way.dy - w.body[b + 4] * h
    across: cython.double = c * y - s * x
    gone: cython.double = c * dy - s * dx
    if gone == 0 or across * (across + gone) > 0:
        return NEVER
    part: cython.double = -across / gone
    crossed: cython.double = c * x + s * y + part * (c * dx + s * dy)
    if crossed < 0 or crossed > w.segment[at + LENGTH] or (is_one_way(w, at) and not stops(w, i, k, across)):
        return NEVER
    return part


@kernel
def first_crossing(w: cython.pointer(Step), i: cython.Py_ssize_t, way: cython.pointer(Way)) -> cython.Py_ssize_t:
    """The line that a path of particle i crosses first, -1: none."""
    found: cython.Py_ssize_t = -1
    first: cython.double = NEVER
    k: cython.Py_ssize_t
    part: cython.double
    left: cython.double = floor(min(way.x, way.x + way.dx) / w.cell)
    right: cython.double = floor(max(way.x, way.x + way.dx) / w.cell)
    low: cython.double = floor(min(way.y, way.y + way.dy) / w.cell)
    high: cython.double = floor(max(way.y, way.y + way.dy) / w.cell)
    if not (right - left + 1) * (high - low + 1) <= w.segments:
        for k in range(w.segments):
            part = crossing(w, i, k, way)
            if part < first:
                first, found = part, k
        return found
    for row in range(cython.cast(int64_t, low), cython.cast(int64_t, high) + 1):
        for column in range(cython.cast(int64_t, left), cython.cast(int64_t, right) + 1):
            link: int32_t = w.head[head_at(column, row, w.cell_heads)]
            while link >= 0:
                k = w.link[2 * link]
                link = w.link[2 * link + 1]
                part = crossing(w, i, k, way)
                if part < first or (part == first and part != NEVER and k < found):
                    first, found = part, k
    return found


@kernel
def move_to(w: cython.pointer(Step), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Move particle i so that it ends the substep at (x, y)."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    dx: cython.double = x - v[width * i] * cython.cast(cython.double, w.h) - w.position[2 * i]
    dy: cython.double = y - v[width * i + 1] * cython.cast(cython.double, w.h) - w.position[2 * i + 1]
    w.position[2 * i] += cython.cast(real, dx)
    w.position[2 * i + 1] += cython.cast(real, dy)
    w.moved[2 * i] += cython.cast(real, dx)
    w.moved[2 * i + 1] += cython.cast(real, dy)
    if w.records_work:
        add_place_work(w, i, dx, dy)


@kernel
def inside_boundary(w: cython.pointer(Step), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> Way:
    """The position of particle i inside the room nearest to (x, y), and the vector from there to (x, y)."""
    way: Way
    way.x, way.y, way.dx, way.dy = x, y, 0.0, 0.0
    if w.boundary == OPEN or not accepts(w, i, w.wall_category, w.wall_mask):
        return way
    r: cython.double = w.radius[i]
    if w.boundary == CAGE:
        d: cython.double = sqrt((x - w.x0) * (x - w.x0) + (y - w.y0) * (y - w.y0))
        part: cython.double = min((w.x1 - r) / d, 1.0) if d > 0 else 1.0
        way.x, way.y = w.x0 + part * (x - w.x0), w.y0 + part * (y - w.y0)
    else:
        way.x, way.y = min(max(x, w.x0 + r), w.x1 - r), min(max(y, w.y0 + r), w.y1 - r)
    way.dx, way.dy = x - way.x, y - way.y
    return way


@kernel
def keep_side(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """If the path of particle i in this substep crosses lines, end it at the first of them, on its own side."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    h: cython.double = w.h
    struck: cython.bint = w.since[i] > 0
    from_x: cython.double = w.begun[2 * i] if struck else w.position[2 * i]
    from_y: cython.double = w.begun[2 * i + 1] if struck else w.position[2 * i + 1]
    way: Way
    way.dx = w.position[2 * i] + v[width * i] * h - from_x
    way.dy = w.position[2 * i + 1] + v[width * i + 1] * h - from_y
    if not w.thrown[i] and way.dx * way.dx + way.dy * way.dy <= w.lists.half_skin * w.lists.half_skin:
        return  # all it could reach was listed
    way.x = wrapped(cython.cast(real, from_x), w.cells.low_x, w.cells.period_x)
    way.y = wrapped(cython.cast(real, from_y), w.cells.low_y, w.cells.period_y)
    k: cython.Py_ssize_t = first_crossing(w, i, cython.address(way))
    if k < 0:
        return
    line: cython.Py_ssize_t = SEGMENT * k
    b: cython.Py_ssize_t = 6 * cython.cast(int64_t, w.segment[line + BODY_OF])
    c: cython.double = w.segment[line + PLACE + 2]
    s: cython.double = w.segment[line + PLACE + 3]
    gone: cython.double = c * (way.dy - w.body[b + 4] * h) - s * (way.dx - w.body[b + 3] * h)
    # It stops where it touches the line, or where it is if it already does; and moves along the line.
    part: cython.double = crossing(w, i, k, cython.address(way)) - (w.segment[line + ROUNDING] + w.radius[i]) / fabs(gone)
    part = max(part, 0.0)
    rate: cython.double = c * (v[width * i + 1] - w.body[b + 4]) - s * (v[width * i] - w.body[b + 3])
    if rate * gone > 0:
        v[width * i] += cython.cast(real, rate * s)
        v[width * i + 1] -= cython.cast(real, rate * c)
        w.free[2 * i] += cython.cast(real, rate * s)
        w.free[2 * i + 1] -= cython.cast(real, rate * c)
    rest: cython.double = (1 - part) * h
    # The room takes precedence: a moving line passes over particles between it and the wall.
    to: Way = inside_boundary(w, i, from_x + part * way.dx + rest * w.body[b + 3], from_y + part * way.dy + rest * w.body[b + 4])
    move_to(w, i, to.x, to.y)


@kernel
def keep_sides(w: cython.pointer(Step), block: cython.int) -> cython.void:
    """Keep the free particles of a block on their side of lines; most blocks have neither thrown nor fast ones."""
    any_thrown: int32_t = 0
    for i in range(block * BLOCK, min((block + 1) * BLOCK, w.count)):
        any_thrown |= w.thrown[i]
    if any_thrown == 0 and w.far <= w.lists.half_skin:
        return
    for i in range(block * BLOCK, min((block + 1) * BLOCK, w.count)):
        if w.inverse_mass[i] > 0:
            keep_side(w, i)


@kernel
def keep_in_sight(w: cython.pointer(Step), block: cython.int) -> cython.void:
    """End the path of particles of a block that impacts throw farther than their list allows, by half a radius or more.

    They keep their velocity, for which the next substep lists them. Otherwise they would pass through others.
    """
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    for i in range(block * BLOCK, min((block + 1) * BLOCK, w.count)):
        if w.thrown[i] == 0 or w.cells.cell[i] == w.cells.total:
            continue
        struck: cython.bint = w.since[i] > 0
        from_x: cython.double = w.begun[2 * i] if struck else w.position[2 * i]
        from_y: cython.double = w.begun[2 * i + 1] if struck else w.position[2 * i + 1]
        x: cython.double = w.position[2 * i] + v[width * i] * w.h - from_x
        y: cython.double = w.position[2 * i + 1] + v[width * i + 1] * w.h - from_y
        seen_x: cython.double = w.checked[2 * i] - from_x
        seen_y: cython.double = w.checked[2 * i + 1] - from_y
        way: cython.double = sqrt(x * x + y * y)
        most: cython.double = sqrt(w.allowed) + 0.5 * w.radius[i]
        if (x - seen_x) * (x - seen_x) + (y - seen_y) * (y - seen_y) > most * most and way > 0:
            # The point on the path, which crosses no surface, at the allowed distance from the expected position.
            along: cython.double = (x * seen_x + y * seen_y) / way
            aside: cython.double = seen_x * seen_x + seen_y * seen_y - along * along
            part: cython.double = (min(max(along, 0.0), way) + sqrt(max(most * most - aside, 0.0))) / way
            if part < 1:
                move_to(w, i, from_x + part * x, from_y + part * y)


@kernel
def keep_inside(w: cython.pointer(Step), i: cython.Py_ssize_t, least: cython.double) -> cython.void:
    """If particle i would leave the room by at least so many radii, end its path at the wall, which may not be listed for it."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    h: cython.double = w.h
    x: cython.double = w.position[2 * i] + v[width * i] * h
    y: cython.double = w.position[2 * i + 1] + v[width * i + 1] * h
    way: Way = inside_boundary(w, i, x, y)
    beyond: cython.double = sqrt(way.dx * way.dx + way.dy * way.dy)
    if beyond == 0 or beyond < least * w.radius[i] or w.inverse_mass[i] == 0:
        return
    nx: cython.double = way.dx / beyond
    ny: cython.double = way.dy / beyond
    out: cython.double = max(v[width * i] * nx + v[width * i + 1] * ny, 0.0)
    strike(w, i, -out * nx, -out * ny, 0, 0)
    if w.records_contacts:
        w.wall_given[2 * i] -= cython.cast(real, out * nx)
        w.wall_given[2 * i + 1] -= cython.cast(real, out * ny)
    move_to(w, i, way.x, way.y)
