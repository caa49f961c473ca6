# mypy: ignore-errors
"""Passes surfaces from Python to the engine, and the state of their contacts in both directions."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import doubles, doubles_in, indices_in, integers_in, shorts, small_integers, small_integers_in
from cython.cimports.libc.stdint import int32_t

from pyverlet.core import engine_numpy
from pyverlet.core.cells import BLOCK
from pyverlet.core.engine_rebounds import make_rebound_arrays
from pyverlet.core.obstacles import LATE, PLACE, SEGMENT, SENSOR, keeps_place, list_segment, put_segment
from pyverlet.core.step import Step
from pyverlet.core.surface_lists import is_seen
from pyverlet.core.surface_rows import CONTACT, GIVEN, HELD, PUSH, ROLL

MOST_LOOKED_FOR = cython.declare(cython.int, 8)
"""Most changed segments per frame for which affected particles are searched; beyond it relisting all is faster."""


@cython.cfunc
def make_surface_arrays(w: cython.pointer(Step), a, capacity: cython.Py_ssize_t):
    """Allocate two surface lists with so many places each; the state of the previous one is kept."""
    old = w.side != 0
    eights = (capacity + 15) // 8
    for side in range(2):
        surface, contact = np.zeros(8 * eights, np.int32), np.zeros((eights, CONTACT, 8))
        if (side == 0) == old and w.contact_capacity > 0:
            before = a[f"contact{side}"]
            surface[: 8 * len(before)], contact[: len(before)] = a[f"surface{side}"], before
        a[f"surface{side}"], a[f"contact{side}"] = surface, contact
    a["clear"], a["contact_particle"] = np.zeros((eights, 3, 8)), np.zeros(8 * eights, np.uint32)
    w.clear, w.contact_particle, w.contact_capacity = doubles_in(a, "clear"), indices_in(a, "contact_particle"), capacity
    make_rebound_arrays(w, a)
    point_to_surfaces(w, a)


@cython.cfunc
def set_rows(a, names, count: cython.Py_ssize_t, shape, dtype):
    """Resize arrays to so many rows, keeping the first ones; in place if there is room.

    Arrays that grow get spare room.
    """
    for name in names:
        old = a.get(name)
        if old is None or len(old.base) < count:
            larger = np.zeros((count if old is None else count + count // 16, *shape), dtype)
            if old is not None:
                larger[: len(old)] = old
            a[name] = larger[:]
        a[name] = a[name].base[:count]


@cython.cfunc
def make_surface_rows(w: cython.pointer(Step), a):
    """Allocate the ranges of each particle's places."""
    blocks = (w.count + BLOCK - 1) // BLOCK
    set_rows(a, ("contact_begin", "contact_end", "at_surface"), w.count, (), np.int32)
    set_rows(a, ("thrown",), w.count, (), np.uint16)
    set_rows(a, ("at_surface_count",), blocks, (), np.int32)
    set_rows(a, ("contact_count",), blocks, (), np.int64)
    set_rows(a, ("since",), w.count, (), np.float64)
    w.since, w.thrown = doubles_in(a, "since"), shorts(a["thrown"])
    w.contact_begin, w.contact_end = small_integers_in(a, "contact_begin"), small_integers_in(a, "contact_end")
    w.at_surface, w.at_surface_count = small_integers_in(a, "at_surface"), small_integers_in(a, "at_surface_count")
    w.contact_count = integers_in(a, "contact_count")
    w.surfaces_good, w.surfaces_kept = False, True
    if w.contact_capacity == 0:
        make_surface_arrays(w, a, 64)
    point_to_surfaces(w, a)


@cython.cfunc
def point_to_surfaces(w: cython.pointer(Step), a):
    """Set the pointers to both lists."""
    now, before = ("1", "0") if w.side else ("0", "1")
    w.surface, w.contact = small_integers(a["surface" + now]), doubles(a["contact" + now])
    w.old_surface, w.old_contact = small_integers(a["surface" + before]), doubles(a["contact" + before])
    if w.records_contacts:
        if "by_surface" not in a or len(a["by_surface"]) < len(a["surface" + now]):
            a["by_surface"] = np.zeros((len(a["surface" + now]), GIVEN))
        w.by_surface = doubles_in(a, "by_surface")


@cython.cfunc
def take_surfaces(w: cython.pointer(Step), a):
    """(sorted_index, surface, values) of loaded contacts, and those with one-way lines; the load is -1 where a line lets pass."""
    if w.count <= 0:
        return np.zeros(0, np.int32), np.zeros(0, np.int32), np.zeros((0, 3))
    side = 1 - w.side if w.surfaces_kept else w.side  # the previous list, until it has been matched
    return engine_numpy.remembered_at_surfaces(a, side, PUSH, ROLL, HELD)


@cython.cfunc
def give_surfaces(w: cython.pointer(Step), a, sorted_index, surface, values):
    """Set contacts, sorted by row, for the next list to match."""
    if len(sorted_index) > w.contact_capacity:
        w.contact_capacity = 0
        make_surface_arrays(w, a, len(sorted_index))
    engine_numpy.remember_at_surfaces(a, 1 - w.side, (sorted_index, surface, values), PUSH, ROLL, HELD)
    w.surfaces_good, w.surfaces_kept = False, True


@cython.cfunc
def set_obstacles(w: cython.pointer(Step), a, cell: cython.double, keep: cython.bint, solids, sensors, one_way):
    """See `Engine.set_obstacles`."""
    w.segments, w.moving_count = len(a["segments"]), len(a["moving"])
    w.segment, w.body, w.moving = doubles_in(a, "segments"), doubles_in(a, "bodies"), small_integers_in(a, "moving")
    w.cell, w.cell_heads, w.head, w.link = cell, len(a["heads"]), small_integers_in(a, "heads"), small_integers_in(a, "links")
    w.solids, w.sensors, w.one_way = solids, sensors, one_way
    if not keep:
        w.surfaces_good = False
        a["heads"].fill(-1)
        w.links, w.links_capacity = 0, len(a["links"])


@cython.cfunc
def place_obstacles(w: cython.pointer(Step), which, dt: cython.double, fresh: cython.bint):
    """Place segments and list those that left their cells. If one of a few is near a particle, surfaces are listed anew."""
    n: cython.Py_ssize_t
    looked: cython.int = 0
    segment: cython.pointer(int32_t) = small_integers(which)
    for n in range(len(which)):
        k: cython.Py_ssize_t = segment[n]
        put_segment(w, k, 0.0, PLACE)
        put_segment(w, k, 0.0, LATE)
        if w.segment[SEGMENT * k + SENSOR] != 0:
            continue  # not listed in this grid
        if fresh or not keeps_place(w, k, dt):
            if not list_segment(w, k, dt):
                w.surfaces_good = False
                return False
            looked += 1
            if w.surfaces_good and (looked > MOST_LOOKED_FOR or is_seen(w, k)):
                w.surfaces_good = False
    return True


@cython.cfunc
def make_sensing_arrays(w: cython.pointer(Step), a):
    """Allocate arrays for sensors, none touched."""
    shape = max(w.count, 0), (w.sensors + 31) // 32
    if "sensed" not in a or a["sensed"].shape != shape:
        a["sensed"], a["inside"] = np.zeros(shape, np.uint32), np.zeros(shape, np.uint32)
        w.sensed, w.inside = indices_in(a, "sensed"), indices_in(a, "inside")
    a["sensed"].fill(0)
