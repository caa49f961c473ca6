# mypy: ignore-errors
"""Converts contact records of the core to arrays for Python."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_integers, doubles, doubles_in, integers, integers_in, reals_in, small_integers_in
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.common import memory
from pyverlet.core.contact_recording import (
    ABOUT,
    GIVE_X,
    GIVE_Y,
    PAIR,
    PUSHES,
    ROW,
    WALL,
    begin_records,
    clear_records,
    collect_rows,
)
from pyverlet.core.contact_records import RECORD_COLUMNS, locate_records, sort_records, write_records
from pyverlet.core.engine_arrays import make_rare_arrays, reserve_records
from pyverlet.core.engine_events import events_of
from pyverlet.core.engine_surfaces import point_to_surfaces, set_rows
from pyverlet.core.step import Step

_NO_KEYS, _NO_ROWS = np.empty(0, np.int64), np.empty(0)
_NO_RECORDS = np.empty((0, RECORD_COLUMNS), np.int64), np.empty((0, RECORD_COLUMNS))

WALLS_OF = cython.declare(cython.int, -1)  # keys instead of an obstacle's number: all walls, and all pairs
PAIRS_OF = cython.declare(cython.int, -2)


@cython.cfunc
def record_contacts(w: cython.pointer(Step), a, wanted: cython.bint, dtype):
    """See `Engine.record_contacts`."""
    w.records_contacts, w.collected = wanted, True
    if not wanted:
        return
    set_rows(a, ("wall_given",), w.count, (2,), dtype)
    set_rows(a, ("recorded_place",), w.count, (), np.int32)
    set_rows(a, ("recorded_start",), w.count + 1, (), np.int32)
    w.wall_given = reals_in(a, "wall_given")
    point_to_surfaces(w, a)
    make_rare_arrays(w, a, dtype)
    begin_records(w)


@cython.cfunc
def keep_records(w: cython.pointer(Step), past_records: list):
    """Save this frame's records before lists are made anew; notes: (number of the frame, (keys, rows)) saved so far."""
    if past_records and past_records[0][0] != w.recorded_frame:
        past_records.clear()
    found: cython.Py_ssize_t = collect_rows(w, integers(_NO_KEYS), doubles(_NO_ROWS), 0)
    key, row = np.empty(found, np.int64), np.empty((found, ROW))
    collect_rows(w, integers(key), doubles(row), found)
    past_records.append((w.recorded_frame, (key, row)))
    clear_records(w)


@cython.cfunc
def collect_records(w: cython.pointer(Step), a, past_events: list, past_records: list):
    """Save events and records of the current lists before they are made anew, unless that has been done."""
    if not w.collected:
        w.waiting, w.collected = False, True
        if w.records_events:
            past_events.append(events_of(w, a))
        if w.records_contacts:
            keep_records(w, past_records)


@cython.cfunc
def contact_records_of(w: cython.pointer(Step), a, past_records: list, known: int64_t, number, bodies: int64_t, sleepers):
    """See `Engine.contact_records`; notes: records saved by `keep_records`."""
    if not w.records_contacts or w.recorded_frame == known:
        return None
    parts = [kept for frame, kept in past_records if frame == w.recorded_frame] if past_records else []
    more: cython.Py_ssize_t = 0
    if sleepers is not None:
        parts.append(sleepers)
    for part in parts:
        more += len(part[0])
    place: cython.pointer(int32_t) = small_integers_in(a, "recorded_place")
    capacity: cython.Py_ssize_t = -1
    found: cython.Py_ssize_t = 0
    while found + more > capacity:
        reserve_records(a, found + more)
        keys: cython.pointer(int64_t) = integers_in(a, "recorded_key")
        rows: cython.p_double = doubles_in(a, "recorded_row")
        order: cython.pointer(int64_t) = integers_in(a, "recorded_order")
        capacity = len(a["recorded_key"])
        found = collect_rows(w, keys, rows, capacity)
    for part in parts:
        a["recorded_key"][found : found + len(part[0])], a["recorded_row"][found : found + len(part[0])] = part
        found += len(part[0])
    locate_records(w, place, found, keys, rows, bodies)
    count: cython.Py_ssize_t = sort_records(w, small_integers_in(a, "recorded_start"), found, keys, rows, order)
    # The first call uses memory allocated in advance.
    records, values = a.pop("recorded_records", _NO_RECORDS) if count else _NO_RECORDS
    if len(records) < count:
        records = memory.empty((count, RECORD_COLUMNS), np.int64)
        values = records.view(np.float64)
    made: cython.Py_ssize_t = write_records(
        w, place, count, keys, rows, order, const_integers(number), integers(records), doubles(values)
    )
    return w.recorded_frame, records[:made], (a["recorded_key"], a["recorded_row"], a["recorded_order"][:count])


def given_by(given, which: int64_t):
    """(x, y, along): impulse of an obstacle, or of all walls (-1), N s, and along normals; of pairs (-2) the virial.

    given: keys, rows, and their order.
    """
    key: cython.pointer(int64_t) = integers_in(given, 0)
    row: cython.p_double = doubles_in(given, 1)
    order: cython.pointer(int64_t) = integers_in(given, 2)
    x: cython.double = 0
    y: cython.double = 0
    along: cython.double = 0
    for n in range(len(given[2])):
        at: cython.Py_ssize_t = ROW * order[n]
        whose: int64_t = key[order[n]] & (2 * PAIR - 1)
        if (PAIRS_OF if whose & PAIR else WALLS_OF if whose & WALL else whose) == which:
            x += row[at + GIVE_X]
            y += row[at + GIVE_Y]
            along += row[at + (ABOUT if which == PAIRS_OF else PUSHES)]
    return x, y, along
