# mypy: ignore-errors
"""Converts recorded contact events to arrays for Python."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import doubles, integers, integers_in, reals_in, small_integers_in

from pyverlet.core.engine_surfaces import make_sensing_arrays
from pyverlet.core.event_recording import collect_events, count_events
from pyverlet.core.step import Step


@cython.cfunc
def make_event_arrays(w: cython.pointer(Step), a, dtype, fresh: cython.bint = False):
    """Allocate event records, one per lane, if events are recorded. fresh: clear them."""
    lanes = w.lists.lanes_capacity if w.records_events else 0
    if fresh or "met" not in a or len(a["met"]) < lanes:
        a |= {name: np.zeros(lanes, dtype) for name in ("met", "pressed")}
        a |= {name: np.zeros(lanes, np.int32) for name in ("touched", "bounces")}
        w.met, w.pressed = reals_in(a, "met"), reals_in(a, "pressed")
        w.touched, w.bounces = small_integers_in(a, "touched"), small_integers_in(a, "bounces")


@cython.cfunc
def record_events(w: cython.pointer(Step), a, number, dtype):
    """See `Engine.record_events`."""
    broken: cython.bint = w.records_events  # the last frame was not completed
    w.records_events, w.collected, w.waiting = number is not None, True, False
    if w.records_events:
        a["number"] = number
        make_event_arrays(w, a, dtype, broken)
        make_sensing_arrays(w, a)


@cython.cfunc
def events_of(w: cython.pointer(Step), a):
    """(keys, speeds, bounces, impulses) of touching contacts, see `collect_events`; the records are then cleared."""
    capacity: cython.Py_ssize_t = count_events(w)
    (keys, bounces), (speeds, pushes) = np.empty((2, capacity), np.int64), np.empty((2, capacity))
    found = collect_events(w, integers_in(a, "number"), integers(keys), doubles(speeds), integers(bounces), doubles(pushes))
    return keys[:found], speeds[:found], bounces[:found], pushes[:found]
