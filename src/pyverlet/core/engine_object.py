# mypy: ignore-errors
"""The `Engine` class: holds pointers to the arrays of a world and runs substeps over them without the GIL."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import doubles, integers, reals, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int64_t
from cython.cimports.team import team_free, team_function, team_new, team_reserve_from, team_reserved, team_run

from pyverlet.core import engine_numpy
from pyverlet.core.cells import BLOCK, Cells
from pyverlet.core.engine_arrays import (
    make_lanes,
    make_level_arrays,
    make_rare_arrays,
    make_scratch_arrays,
    move_rows,
    renumber_places,
    reserve_pairs,
    set_materials,
    set_particles,
)
from pyverlet.core.engine_events import events_of, record_events
from pyverlet.core.engine_impulses import fill_kept, read_impulses
from pyverlet.core.engine_links import fill_links
from pyverlet.core.engine_records import collect_records, contact_records_of, record_contacts
from pyverlet.core.engine_surfaces import (
    give_surfaces,
    make_surface_arrays,
    place_obstacles,
    set_obstacles,
    take_surfaces,
)
from pyverlet.core.engine_work import energy_of_last, friction_of_last, work_of_frame
from pyverlet.core.frame_ends import all_finite
from pyverlet.core.link_arrays import Links
from pyverlet.core.link_ends import show_links
from pyverlet.core.pair_lists import Lists
from pyverlet.core.relisting import remake_list, renumber_lanes
from pyverlet.core.running import refresh_lists, run_substeps
from pyverlet.core.spans import spans_of
from pyverlet.core.step import Step
from pyverlet.core.waking import take_met, watch
from pyverlet.core.wrapping import follow_images, wrap_positions


@cython.cclass
class Engine:
    """Particles, pairs, surfaces and links of one world, and a team of threads. Arrays are named as in `Step`; the engine keeps
    them.

    Args:
        threads: most threads that run a frame together.
    """

    w: Step
    c: Cells
    ls: Lists
    lk: Links
    arrays = cython.declare(dict, visibility="public")
    past_events = cython.declare(list, visibility="readonly")
    past_records = cython.declare(list)  # see `keep_records`
    threads = cython.declare(cython.int, visibility="readonly")
    thread_team = cython.declare(cython.size_t, visibility="readonly")  # address of the team, for kernels of other units
    dtype = cython.declare(object, visibility="readonly")

    def __init__(self, threads: cython.int):
        w: cython.pointer(Step) = cython.address(self.w)
        self.set_threads(threads)
        self.dtype = np.dtype(np.float64 if cython.sizeof(real) == 8 else np.float32)
        w.cells, w.lists, w.link_table = cython.address(self.c), cython.address(self.ls), cython.address(self.lk)
        w.count, w.groups = -1, 0
        self.arrays, self.past_events, self.past_records = {}, [], []
        make_level_arrays(w.cells, self.arrays, self.dtype)

    def __dealloc__(self):
        team_free(self.w.team)

    def set_threads(self, threads: cython.int):
        """Replace the team by one of so many threads."""
        reserved = team_reserved(self.w.team) if self.ls.lanes_capacity else 0
        team_free(self.w.team)
        self.w.team = team_new(threads)
        if self.w.team == cython.NULL:
            raise MemoryError
        team_reserve_from(self.w.team, reserved)
        if self.ls.scratch_capacity:
            make_scratch_arrays(cython.address(self.w), self.arrays, self.ls.scratch_capacity, threads, self.dtype)
        self.threads, self.thread_team = threads, cython.cast(cython.size_t, self.w.team)

    # ---- what there is -------------------------------------------------------------------------------------------------------

    def set_particles(self, **a):
        """Set arrays by row. category and mask are empty if all collide; material columns have one row unless `mixed`.

        If the number of rows changes, read the contact state before.
        """
        set_particles(cython.address(self.w), self.arrays, a, self.dtype)

    def set_materials(self, **n):
        """collides: whether there are pairs at all. sized, varied, mixed: whether radii, masses, and any of restitution,
        friction and radii differ.

        bulk: largest radius of circles in cells, m; smallest, largest and mean_radius, m. restitution, friction: of circles
        without values of their own. tests_pairs: whether some pairs cannot: pinned, filtered or linked ones. brute: whether all
        other pairs are listed; bulk is then 0. combine: see `combined`. together: (k, k, 3) of k materials.
        """
        set_materials(cython.address(self.w), self.arrays, n, self.dtype)

    def set_linked(self, begin, to):
        """Set pairs that never collide because of links: particle p and those from begin[p] to begin[p + 1], of higher index."""
        self.arrays["linked_begin"], self.arrays["linked_to"] = begin, to
        self.ls.linked, self.ls.patching, self.ls.anew = len(to) > 0, True, True
        self.ls.linked_begin, self.ls.linked_to = integers(begin), small_integers(to)
        self.ls.tests_pairs = self.ls.tests_pairs or self.ls.linked

    def set_links(self, rows, passes, substeps, period_x, period_y):
        """Set links (`CoreLinks.rows`) or None, passes per substep, substeps per frame, periods of the room (0: none)."""
        self.w.linked = rows is not None
        if rows is not None:
            self.arrays["links"] = rows
            fill_links(cython.address(self.w), self.arrays, rows, passes, substeps, period_x, period_y)

    def show_links(self, half: cython.double, kick: cython.double):
        """At the end of a frame: make velocities consistent with links, see `link_ends`."""
        if self.w.linked and half > 0:
            show_links(cython.address(self.w), half, kick)

    def set_boundary(
        self, kind: cython.int, x0: cython.double, y0: cython.double, x1: cython.double, y1: cython.double, restitution, friction,
        rolling, speed, material=0, category=0, mask=0,
    ):  # fmt: skip
        """Set the walls: none (0); a cage (1) by centre and radius; a box (2) by two corners; m. speed: of a cage's rim, m/s."""
        w: cython.pointer(Step) = cython.address(self.w)
        same: cython.bint = w.boundary == kind and w.x0 == x0 and w.y0 == y0 and w.x1 == x1 and w.y1 == y1
        if not (same and w.wall_category == category and w.wall_mask == mask):
            w.boundary, w.x0, w.y0, w.x1, w.y1, w.surfaces_good = kind, x0, y0, x1, y1, False
            w.wall_category, w.wall_mask = category, mask
        w.wall_restitution, w.wall_friction, w.wall_rolling, w.wall_speed = restitution, friction, rolling, speed
        w.wall_material = material

    def set_rolls(self, wanted: cython.bint):
        """Set whether any contact has rolling resistance."""
        if self.w.rolls != wanted:
            self.w.rolls = wanted
            self.w.rollings = self.w.rollings or wanted
            if not self.ls.impulses_stored:  # pairs of the list have no rolling impulse yet
                self.arrays.pop("roll_impulse", None)
            make_rare_arrays(cython.address(self.w), self.arrays, self.dtype)

    def set_periodic(self, low_x: cython.double, low_y: cython.double, period_x: cython.double, period_y: cython.double):
        """Set the corner and the periods of a periodic room, m; 0: none. A change discards the list."""
        c: cython.pointer(Cells) = cython.address(self.c)
        if not (c.low_x == low_x and c.low_y == low_y and c.period_x == period_x and c.period_y == period_y):
            c.low_x, c.low_y, c.period_x, c.period_y = low_x, low_y, period_x, period_y
            self.ls.good = False

    def set_obstacles(self, segments, bodies, moving, cell, heads, links, keep, solids, sensors, one_way):
        """Set segments (n, SEGMENT) and bodies (k, 6) of all obstacles, the moving segments, and arrays for their grid.

        heads: a power of two. keep: the grid is valid; else all is listed anew. solids: segments without sensors; sensors: their
        number; one_way: whether any is passable in one direction. Contact state is kept.
        """
        self.arrays.update(segments=segments, bodies=bodies, moving=moving, heads=heads, links=links)
        set_obstacles(cython.address(self.w), self.arrays, cell, keep, solids, sensors, one_way)

    def place_obstacles(self, which, dt: cython.double, fresh: cython.bint):
        """Place obstacles at the start of a frame of dt seconds: segments of `which` that leave their cells are listed anew.

        fresh: they were changed by the user. Returns whether there was room for all.
        """
        return place_obstacles(cython.address(self.w), which, dt, fresh)

    def take_surfaces(self):
        """Contact state at surfaces: row (k,), surface (k,) and values (k, 3), two in m/s, the last in m^2/s."""
        return take_surfaces(cython.address(self.w), self.arrays)

    def give_surfaces(self, sorted_index, surface, values):
        """Set contact state at surfaces, sorted by row; the next list matches it."""
        give_surfaces(cython.address(self.w), self.arrays, sorted_index, surface, values)

    def record_contacts(self, wanted: cython.bint):
        """Turn contact records on or off, for the coming frame and plain frames after it."""
        record_contacts(cython.address(self.w), self.arrays, wanted, self.dtype)

    def contact_records(self, known: int64_t, number, bodies: int64_t, sleepers):
        """(number, records, given) of the last frame: (k, RECORD_COLUMNS) of 64 bits, for `given_by`; None if it is `known`.

        number: the user's particle numbers; bodies: number of obstacles; sleepers: their (keys, rows) or None.
        """
        return contact_records_of(cython.address(self.w), self.arrays, self.past_records, known, number, bodies, sleepers)

    def record_work(self, wanted: cython.bint):
        """Turn energy accounts on or off; when turned off, return (work, gained), J, of each kind and of all."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.records_work = wanted
        if not wanted:
            return work_of_frame(w), float(self.arrays["gained"].sum())
        self.arrays |= {"gained": np.zeros((w.count + BLOCK - 1) // BLOCK + 1), "work": np.zeros((w.count + 1, 6))}
        w.gained, w.work = doubles(self.arrays["gained"]), doubles(self.arrays["work"])
        return None

    def energy_of_last(self, share: cython.double):
        """Energy, J, that `share` of the last contact impulses gave: all, by friction, by rolling resistance, by motors."""
        return (energy_of_last(cython.address(self.w), share), *friction_of_last(cython.address(self.w), share))

    def record_events(self, number):
        """Start recording events, with the user's particle numbers; None: stop. Earlier records are cleared."""
        self.past_events = []
        record_events(cython.address(self.w), self.arrays, number, self.dtype)

    def touched_sensors(self):
        """(rows, sensors) touched since recording began, and touched at the end of the last call."""
        return engine_numpy.bits_set(self.arrays["sensed"]), engine_numpy.bits_set(self.arrays["inside"])

    def recorded_events(self):
        """A list of the events recorded so far: see `collect_events`."""
        return [*self.past_events, events_of(cython.address(self.w), self.arrays)]

    def set_skin(self, diameters: cython.double, adapts: cython.bint):
        """Set the thickness of the skin in mean diameters, or its initial value; adaptation starts anew."""
        self.ls.diameters, self.ls.adapts = diameters, adapts
        self.ls.age = self.ls.hold = self.ls.excess = 0

    def set_law(
        self, h: real, rate: real, stiff: real, leak: real, push: real, near: real, rest_speed: real, resting: real,
        restless: cython.bint, relaxes: cython.int, rough: cython.bint, spring_h: real,
    ):  # fmt: skip
        """Set parameters of the coming substeps: see `Step`."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.h, w.rate, w.stiff, w.leak, w.push, w.near = h, rate, stiff, leak, push, near
        w.rest_speed, w.resting, w.restless, w.relaxes, w.rough = rest_speed, resting, restless, relaxes, rough
        w.spring_h = spring_h
        if rough and not w.tangents:
            w.tangents = True
            make_rare_arrays(w, self.arrays, self.dtype)

    def set_frame(
        self, opening: real, already_given: real, scale: real, half: real, by_contacts: real, falls_free: cython.bint,
        gravity_x: real, gravity_y: real, rest_scale: real, strength=None,
    ):  # fmt: skip
        """Set how the next call begins, and ends if there is only gravity besides contacts: see `Step`."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.opening, w.already_given, w.scale, w.half, w.by_contacts = opening, already_given, scale, half, by_contacts
        w.falls_free, w.gravity_x, w.gravity_y, w.rest_scale = falls_free, gravity_x, gravity_y, rest_scale
        if not falls_free:
            self.arrays["strength"], w.strength = strength, reals(strength)

    def take_still(self, kept: cython.bint):
        """(made, still): how often still blocks were searched for, and which are; None: unknown. kept: not written to since."""
        self.w.still_known = self.w.still_known and kept
        return (self.w.still_made, self.arrays["still"]) if self.w.still_known else None

    # ---- the list of pairs ---------------------------------------------------------------------------------------------------

    def forget_list(self):
        """Discard the pair list, because rows hold other particles; their order is the same."""
        self.ls.good = False

    def reserve(self):
        """After a call that ended early: save records, or enlarge arrays for the last list; contact state is kept."""
        w: cython.pointer(Step) = cython.address(self.w)
        self.ls.short = False
        if w.waiting:
            self.collect_records()
        elif not self.ls.good:  # otherwise surface lists need more places
            reserve_pairs(w, self.arrays, self.threads, self.dtype)
        if w.count and w.contact_count[0] > w.contact_capacity:
            make_surface_arrays(w, self.arrays, w.contact_count[0] * 5 // 4)

    @cython.cfunc
    def run_team(self, function: team_function, parts: cython.int):
        """Run a function in `parts` threads, repeatedly until arrays are large enough for it."""
        w: cython.pointer(Step) = cython.address(self.w)
        while True:
            with cython.nogil:
                team_run(w.team, function, w, parts)
            if not self.ls.short:
                break
            self.reserve()

    @cython.cfunc
    def collect_records(self):
        """Save records of the current lists before they are made anew, unless that has been done."""
        collect_records(cython.address(self.w), self.arrays, self.past_events, self.past_records)

    def watch(self, island, nearer: cython.double):
        """End calls before an awake particle touches a sleeper, see `core.waking`; None: do not."""
        watch(cython.address(self.w), self.arrays, island, nearer)

    def find_met(self, substep: cython.int, parts: cython.int):
        """(count,) uint8, 1 for sleepers that an awake particle touches in the coming substep; or None."""
        self.w.first = self.w.substep = substep
        self.run_team(refresh_lists, parts)
        return take_met(cython.address(self.w), self.arrays)

    def run(self, substep: cython.int, substeps: cython.int, parts: cython.int):
        """Run substeps from `substep` on by `parts` threads, with valid pair lists in each.

        Returns how many are complete, and whether all positions and velocities are finite.
        """
        w: cython.pointer(Step) = cython.address(self.w)
        w.first, w.substep, w.substeps = substep, substep, substeps
        self.run_team(run_substeps, parts)
        return w.substep, all_finite(w) != 0

    def spans(self):
        """Time by stage since the last call: see `core.spans`."""
        return spans_of(self.w.team)

    def rebuilds(self) -> int:
        """How often the list has been built."""
        return self.ls.rebuilds

    def pairs(self):
        """(first, count, i, j): the ranges of the pairs of each group. A pair may occur twice in a row."""
        return engine_numpy.listed_pairs(self.arrays, self.w.groups if self.ls.listed else 0)

    def order(self):
        """(falls, order): rows in cell order, and how often it descends; (0, None) without a list."""
        return (self.c.falls, self.arrays["order"]) if self.ls.good and self.w.collides else (0, None)

    def renumber(self, order):
        """Renumber rows: the particle of row order[k] moves to row k, with `order` from `order()`; set arrays afterwards."""
        engine_numpy.renumber_list(self.arrays, order, self.w.groups)
        self.c.falls = 0

    def follow_images(self, crossed):
        """In a periodic room: move positions to the images nearest to those of the last list check; see `core.wrapping`."""
        follow_images(cython.address(self.w), doubles(crossed))

    def wrap_positions(self, crossed):
        """Move all positions inside a periodic room."""
        wrap_positions(cython.address(self.w), doubles(crossed))

    # ---- what outlives it ----------------------------------------------------------------------------------------------------

    def take_impulses(self, particle):
        """Contact state (pairs, values) of contacts that overlap or carry load: particles low < high (k, 2), and (k, 4).

        Sorted by the lower. values: impulses along the normal and the tangent, and the load at the start of the substep, negative
        for pairs that were apart then.
        """
        return read_impulses(cython.address(self.w), small_integers(particle), particle, self.dtype)

    def move_particles(self, place, gone, source, count: cython.Py_ssize_t, parts: cython.int):
        """Move row k to place[k] of `count`, or drop it (-1). New arrays are set afterwards.

        gone, source: see `move_rows`.
        """
        self.collect_records()
        renumber_places(cython.address(self.w), place, gone, source is None)
        if self.ls.listed and (source is not None or len(gone) > 0):
            self.run_team(renumber_lanes, parts)
        move_rows(cython.address(self.w), self.arrays, place, gone, source, count, self.dtype)

    def patch_list(self, parts: cython.int):
        """Update the list for particles that have been added or removed since it was made."""
        if self.ls.patching and self.ls.good:
            self.run_team(remake_list, parts)
        self.ls.patching = False

    def give_impulses(self, pairs, values):
        """Set the contact state of these pairs of rows (k, 2), 0 for all others; the next list matches it."""
        self.collect_records()
        self.ls.impulses_stored = False
        self.w.tangents, self.w.rollings = self.w.tangents or values[:, 1].any(), self.w.rollings or values[:, 3].any()
        make_lanes(cython.address(self.w), self.arrays, max(len(pairs), 8), self.dtype)
        make_rare_arrays(cython.address(self.w), self.arrays, self.dtype)
        fill_kept(cython.address(self.w), np.ascontiguousarray(pairs, np.int32), np.ascontiguousarray(values, self.dtype))
        self.ls.listed, self.ls.good, self.ls.impulses_stored = False, False, True

    def save_list(self):
        """(listed, checked, numbers) for `restore_list` to make the same list again; empty arrays without a list."""
        ls: cython.pointer(Lists) = cython.address(self.ls)
        numbers = (ls.diameters, ls.half_skin, self.c.skin, self.w.allowed, float(ls.age), float(ls.hold))
        rows = self.w.count if ls.good else 0
        return self.arrays["listed"][:rows].copy(), self.arrays["checked"][:rows].copy(), tuple(map(float, numbers))

    def restore_list(self, listed, checked, numbers):
        """Make the list that `save_list` described; particles, their order and materials must be the same."""
        w: cython.pointer(Step) = cython.address(self.w)
        ls: cython.pointer(Lists) = cython.address(self.ls)
        ls.diameters, ls.half_skin, self.c.skin, w.allowed = numbers[:4]
        ls.age, ls.hold = int(numbers[4]), int(numbers[5])
        if len(listed) == w.count:
            self.arrays["listed"][:], self.arrays["checked"][:] = listed, checked
            self.run_team(remake_list, 1)
            ls.good = ls.good or not w.collides
