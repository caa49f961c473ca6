# mypy: ignore-errors
"""Records impulses of contacts in a frame, while `records_contacts`: for `World.contacts`, `force_on` and `pressure`.

Lanes and surface contacts sum their impulses over substeps. The sums are converted to rows before lists are made anew, and when
they are asked for: see `core.contact_records`.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pair_groups import busy_group
from pyverlet.core.pair_memory import repeats
from pyverlet.core.step import CAGE, OPEN, Step
from pyverlet.core.surface_rows import GIVEN

ROW = cython.declare(cython.int, 7)
"""Columns of a row. Jointly computed columns are not adjacent: there GCC 12 contracts a b - c d, in spite of its flag."""

GIVE_X = cython.declare(cython.int, 0)  # impulse on the second circle or surface, N s; NaN: see the next two
PUSHES = cython.declare(cython.int, 1)  # normal part, which separates them
GIVE_Y = cython.declare(cython.int, 2)
TANGENT = cython.declare(cython.int, 3)  # tangential part, along (n_y, -n_x)
ABOUT = cython.declare(cython.int, 4)  # surface number, later its distance, m; of a pair the normal impulse times distance, N s m
OUT_X = cython.declare(cython.int, 5)  # out of the first circle
OUT_Y = cython.declare(cython.int, 6)

PAIR = cython.declare(int64_t, 0x100000000)
"""Key of a pair: the lower circle times twice this, plus this, plus the other one. Other keys have a surface number in the low
bits, which becomes an obstacle number, or `WALL` and a wall number."""

WALL = cython.declare(int64_t, 0x80000000)


@kernel
def clear_records(w: cython.pointer(Step)) -> cython.void:
    """Clear the records: of pairs and surfaces, and of walls that stop what links pull out of the room."""
    none: real = 0
    k: cython.Py_ssize_t
    for k in range(w.lists.lanes_capacity):
        w.summed_x[k] = w.summed_y[k] = w.summed_virial[k] = none
    for k in range(GIVEN * w.contact_capacity):
        w.by_surface[k] = 0
    for k in range(2 * w.count):
        w.wall_given[k] = none
    w.collected = True


@kernel
def begin_records(w: cython.pointer(Step)) -> cython.void:
    """Begin the records of a frame."""
    clear_records(w)
    w.recorded_frame += 1


@kernel
def pair_records_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Add the impulses of a group's pairs in a substep; those of resting contacts are scaled to h."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = busy_group(w, item)
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
        if w.impulse[k] > 0:
            push: real = w.rest_scale * w.impulse[k]
            tangent: real = w.rest_scale * w.tangent_impulse[k] if w.rough else 0
            w.summed_x[k] += push * w.normal_x[k] + tangent * w.normal_y[k]
            w.summed_y[k] += push * w.normal_y[k] - tangent * w.normal_x[k]
            w.summed_virial[k] += push * (w.reach[k * w.sized] - w.depth[k])


@kernel
def nearest_side(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.int:
    """The side of the room nearest to particle i."""
    left: cython.double = w.position[2 * i] - w.x0
    right: cython.double = w.x1 - w.position[2 * i]
    below: cython.double = w.position[2 * i + 1] - w.y0
    above_it: cython.double = w.y1 - w.position[2 * i + 1]
    if w.boundary == CAGE:
        return 0
    if min(left, right) <= min(below, above_it):
        return 0 if left <= right else 1
    return 2 if below <= above_it else 3


@inlined
def put_record(
    row: cython.p_double, at: cython.Py_ssize_t, x: cython.double, y: cython.double, push: cython.double, tangent: cython.double,
    about: cython.double,
) -> cython.void:  # fmt: skip
    """Write a row at `at`, if there is room."""
    row[at + GIVE_X], row[at + GIVE_Y], row[at + PUSHES], row[at + TANGENT], row[at + ABOUT] = x, y, push, tangent, about


@kernel
def collect_rows(
    w: cython.pointer(Step), key: cython.pointer(int64_t), row: cython.p_double, capacity: cython.Py_ssize_t
) -> cython.Py_ssize_t:  # fmt: skip
    """Write rows of the records since lists were made, and their keys, as far as there is room; returns their number."""
    n: cython.Py_ssize_t = 0
    k: cython.Py_ssize_t
    mass: cython.double
    for s in range(w.groups):
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            if (w.summed_x[k] != 0 or w.summed_y[k] != 0) and not repeats(w, s, k):
                if n < capacity:
                    a: int64_t = w.lists.particle[w.i[k]]
                    b: int64_t = w.lists.particle[w.j[k]]
                    inverse: cython.double = w.inverse_mass[w.i[k]]
                    mass = 1 / (inverse + w.inverse_mass[w.j[k]])
                    way: cython.double = mass if a < b else -mass
                    key[n] = (min(a, b) << 33) + PAIR + max(a, b)
                    put_record(row, ROW * n, way * w.summed_x[k], way * w.summed_y[k], 0, 0, mass * w.summed_virial[k])
                n += 1
    for i in range(w.count):
        if w.inverse_mass[i] == 0:
            continue
        whose: int64_t = w.lists.particle[i]
        mass = 1 / cython.cast(cython.double, w.inverse_mass[i])
        for k in range(w.contact_begin[i], w.contact_begin[i] if w.surfaces_kept else w.contact_end[i]):
            g: cython.Py_ssize_t = GIVEN * k
            push: cython.double = mass * w.by_surface[g + 2]
            tangent: cython.double = mass * w.by_surface[g + 3]
            if w.surface[k] >= 0 and (push != 0 or tangent != 0 or w.by_surface[g] != 0 or w.by_surface[g + 1] != 0):
                if n < capacity:
                    key[n] = (whose << 33) + w.surface[k]
                    put_record(row, ROW * n, mass * w.by_surface[g], mass * w.by_surface[g + 1], push, tangent, w.surface[k])
                n += 1
        x: cython.double = mass * w.wall_given[2 * i]
        y: cython.double = mass * w.wall_given[2 * i + 1]
        if (x != 0 or y != 0) and w.boundary != OPEN:
            if n < capacity:
                key[n] = (whose << 33) + nearest_side(w, i)
                put_record(row, ROW * n, x, y, sqrt(x * x + y * y), 0, nearest_side(w, i))
            n += 1
    return n
