# mypy: ignore-errors
"""Converts recorded contacts to contact records: sorts rows, sums those of the same contact, and adds positions."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.contact_recording import ABOUT, GIVE_X, GIVE_Y, OUT_X, OUT_Y, PAIR, PUSHES, ROW, TANGENT, WALL
from pyverlet.core.kernels import kernel
from pyverlet.core.obstacles import BODY_OF, LATE, LENGTH, ROUNDING, SEGMENT
from pyverlet.core.periodic import nearest_in_double, wrapped_in_double
from pyverlet.core.step import CAGE, Step
from pyverlet.core.surface_rows import SIDES

RECORD_COLUMNS = cython.declare(cython.int, 12)
"""Numbers of 64 bits of a record: see `laws.contact_records.CONTACT_RECORD`."""


@kernel
def see_side(
    w: cython.pointer(Step), i: cython.Py_ssize_t, side: int64_t, row: cython.p_double, at: cython.Py_ssize_t
) -> cython.void:
    """Write the distance of particle i from a side of the room, m, and the normal out of the particle (2), from place `at` on."""
    x: cython.double = w.position[2 * i]
    y: cython.double = w.position[2 * i + 1]
    if w.boundary == CAGE:
        x -= w.x0
        y -= w.y0
        far: cython.double = sqrt(x * x + y * y)
        row[at], row[at + 1], row[at + 2] = w.x1 - far, x / max(far, 1e-300), y / max(far, 1e-300)
        return
    row[at] = x - w.x0 if side == 0 else w.x1 - x if side == 1 else y - w.y0 if side == 2 else w.y1 - y
    row[at + 1] = -1.0 if side == 0 else 1.0 if side == 1 else 0.0
    row[at + 2] = -1.0 if side == 2 else 1.0 if side == 3 else 0.0


@kernel
def see_segment(
    w: cython.pointer(Step), i: cython.Py_ssize_t, segment: int64_t, row: cython.p_double, at: cython.Py_ssize_t
) -> cython.void:
    """As `see_side`, for a segment at the end of the frame, or the nearest of its images."""
    wide: cython.int = 1 if w.cells.period_x > 0 else 0
    high: cython.int = 1 if w.cells.period_y > 0 else 0
    column: cython.int
    line: cython.int
    s: cython.Py_ssize_t = SEGMENT * segment
    row[at] = INFINITY
    for column in range(-wide, wide + 1):
        for line in range(-high, high + 1):
            x: cython.double = w.position[2 * i] + column * w.cells.period_x - w.segment[s + LATE]
            y: cython.double = w.position[2 * i + 1] + line * w.cells.period_y - w.segment[s + LATE + 1]
            along: cython.double = w.segment[s + LATE + 2] * x + w.segment[s + LATE + 3] * y
            along = min(max(along, 0.0), w.segment[s + LENGTH])
            x -= along * w.segment[s + LATE + 2]
            y -= along * w.segment[s + LATE + 3]
            far: cython.double = sqrt(x * x + y * y)
            if far - w.segment[s + ROUNDING] < row[at]:
                row[at] = far - w.segment[s + ROUNDING]
                row[at + 1], row[at + 2] = -x / max(far, 1e-300), -y / max(far, 1e-300)


@kernel
def locate_records(
    w: cython.pointer(Step), place: cython.pointer(int32_t), count: cython.Py_ssize_t, key: cython.pointer(int64_t),
    row: cython.p_double, bodies: int64_t,
) -> cython.void:  # fmt: skip
    """Locate the surfaces of these rows. place: set to the row of each user's index; bodies: number of obstacles."""
    i: cython.Py_ssize_t
    n: cython.Py_ssize_t
    for i in range(w.count):
        place[w.lists.particle[i]] = cython.cast(int32_t, i)
    for n in range(count):
        if key[n] & PAIR:
            continue
        at: cython.Py_ssize_t = ROW * n
        whose: int64_t = key[n] >> 33
        surface: int64_t = cython.cast(int64_t, row[at + ABOUT])
        if surface < SIDES:
            see_side(w, place[whose], surface, row, at + ABOUT)
            key[n] = (whose << 33) + WALL + surface
        else:
            see_segment(w, place[whose], surface - SIDES, row, at + ABOUT)
            key[n] = (whose << 33) + cython.cast(int64_t, w.segment[SEGMENT * (surface - SIDES) + BODY_OF]) % bodies
        if row[at + GIVE_X] != row[at + GIVE_X]:
            row[at + GIVE_X] = row[at + TANGENT] * row[at + OUT_Y] - row[at + PUSHES] * row[at + OUT_X]
            row[at + GIVE_Y] = -row[at + TANGENT] * row[at + OUT_X] - row[at + PUSHES] * row[at + OUT_Y]


@kernel
def add_row(row: cython.p_double, to: cython.Py_ssize_t, more: cython.Py_ssize_t, pair: cython.bint) -> cython.void:
    """Add a row of the same contact, which is located where it is nearest; normal and tangential parts are recomputed there."""
    k: cython.Py_ssize_t
    for k in range(5 if pair else 4):
        row[to + k] += row[more + k]
    if pair or (row[more + OUT_X] == row[to + OUT_X] and row[more + OUT_Y] == row[to + OUT_Y]):
        return
    if row[more + ABOUT] < row[to + ABOUT]:
        row[to + ABOUT], row[to + OUT_X], row[to + OUT_Y] = row[more + ABOUT], row[more + OUT_X], row[more + OUT_Y]
    row[to + PUSHES] = -row[to + GIVE_X] * row[to + OUT_X] - row[to + GIVE_Y] * row[to + OUT_Y]
    row[to + TANGENT] = row[to + GIVE_X] * row[to + OUT_Y] - row[to + GIVE_Y] * row[to + OUT_X]


@kernel
def sort_records(
    w: cython.pointer(Step), start: cython.pointer(int32_t), count: cython.Py_ssize_t, key: cython.pointer(int64_t),
    row: cython.p_double, order: cython.pointer(int64_t),
) -> cython.Py_ssize_t:  # fmt: skip
    """Sort row numbers by key, and add rows of equal keys to the first of each; returns how many remain.

    start: scratch, one more than particles.
    """
    n: cython.Py_ssize_t
    k: cython.Py_ssize_t
    kept: cython.Py_ssize_t = 0
    for n in range(w.count + 1):
        start[n] = 0
    for n in range(count):
        start[(key[n] >> 33) + 1] += 1
    for n in range(w.count):
        start[n + 1] += start[n]
    for n in range(count):
        order[start[key[n] >> 33]] = n
        start[key[n] >> 33] += 1
    for n in range(count):
        which: int64_t = order[n]
        at: cython.Py_ssize_t = kept
        while at > 0 and key[order[at - 1]] > key[which]:  # a particle has few contacts
            at -= 1
        if at > 0 and key[order[at - 1]] == key[which]:
            add_row(row, ROW * order[at - 1], ROW * which, (key[which] & PAIR) != 0)
            continue
        for k in range(kept, at, -1):
            order[k] = order[k - 1]
        order[at] = which
        kept += 1
    return kept


@kernel
def see_pair(
    w: cython.pointer(Step), i: cython.Py_ssize_t, j: cython.Py_ssize_t, row: cython.p_double, at: cython.Py_ssize_t
) -> cython.double:
    """Compute the normal and tangential impulse of a pair, or its vector for sleepers; returns the contact's distance from i."""
    x: cython.double = w.position[2 * j]
    y: cython.double = w.position[2 * j + 1]
    x = nearest_in_double(x - w.position[2 * i], w.cells.period_x)
    y = nearest_in_double(y - w.position[2 * i + 1], w.cells.period_y)
    far: cython.double = sqrt(x * x + y * y)
    x /= max(far, 1e-300)
    y /= max(far, 1e-300)
    if row[at + GIVE_X] != row[at + GIVE_X]:
        row[at + GIVE_X] = row[at + PUSHES] * x + row[at + TANGENT] * y
        row[at + GIVE_Y] = row[at + PUSHES] * y - row[at + TANGENT] * x
        row[at + ABOUT] = row[at + PUSHES] * far
    else:
        row[at + PUSHES] = row[at + GIVE_X] * x + row[at + GIVE_Y] * y
        row[at + TANGENT] = row[at + GIVE_X] * y - row[at + GIVE_Y] * x
    row[at + OUT_X], row[at + OUT_Y] = x, y
    radius: cython.double = w.radius[i]
    return radius + 0.5 * (far - radius - w.radius[j])


@kernel
def write_records(
    w: cython.pointer(Step), place: cython.pointer(int32_t), count: cython.Py_ssize_t, key: cython.pointer(int64_t),
    row: cython.p_double, order: cython.pointer(int64_t), number: cython.pointer[cython.const[int64_t]],
    whole: cython.pointer(int64_t), value: cython.p_double,
) -> cython.Py_ssize_t:  # fmt: skip
    """Write a record of each contact with a non-zero impulse; returns their number.

    whole, value: the same memory.
    """
    m: cython.Py_ssize_t = 0
    n: cython.Py_ssize_t
    for n in range(count):
        which: int64_t = key[order[n]]
        at: cython.Py_ssize_t = ROW * order[n]
        pair: cython.bint = (which & PAIR) != 0
        wall: cython.bint = not pair and (which & WALL) != 0
        a: int64_t = which >> 33
        b: int64_t = which & (PAIR - 1)
        i: cython.Py_ssize_t = place[a]
        far: cython.double = see_pair(w, i, place[b], row, at) if pair else row[at + ABOUT]
        if row[at + PUSHES] == 0 and row[at + TANGENT] == 0:
            continue
        to: cython.Py_ssize_t = RECORD_COLUMNS * m
        whole[to], whole[to + 1] = a, b if pair else -1
        whole[to + 2], whole[to + 3] = b - WALL if wall else -1, -1 if pair or wall else b
        value[to + 4] = wrapped_in_double(w.position[2 * i] + far * row[at + OUT_X], w.cells.low_x, w.cells.period_x)
        value[to + 5] = wrapped_in_double(w.position[2 * i + 1] + far * row[at + OUT_Y], w.cells.low_y, w.cells.period_y)
        value[to + 6], value[to + 7] = row[at + OUT_X], row[at + OUT_Y]
        value[to + 8], value[to + 9] = row[at + PUSHES], row[at + TANGENT] if pair else 0 - row[at + TANGENT]
        whole[to + 10], whole[to + 11] = number[a], number[b] if pair else -1
        m += 1
    return m
