# mypy: ignore-errors
"""The object that Python holds: it takes the addresses of arrays once, and runs substeps over them without the GIL."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import doubles, indices, integers, octets, reals, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.math import rint
from cython.cimports.libc.stdint import int32_t, int64_t
from cython.cimports.team import team_free, team_new, team_run

from pyverlet.core.cells import BLOCK, LEVELS, Cells, wrapped
from pyverlet.core.engine_impulses import fill_kept, read_impulses
from pyverlet.core.pair_lists import Lists
from pyverlet.core.relisting import GROUP
from pyverlet.core.running import remake_list, run_substeps
from pyverlet.core.step import Step


@cython.cclass
class Engine:
    """Particles, their pairs and their room, and a team of threads. Arrays are named as in `Step`; the engine keeps them.

    Args:
        threads: most threads that go through a frame together.
    """

    w: Step
    c: Cells
    l: Lists
    arrays = cython.declare(dict, visibility="public")
    threads = cython.declare(cython.int, visibility="readonly")
    dtype = cython.declare(object, visibility="readonly")

    def __init__(self, threads: cython.int):
        w: cython.pointer(Step) = cython.address(self.w)
        c: cython.pointer(Cells) = cython.address(self.c)
        l: cython.pointer(Lists) = cython.address(self.l)
        w.team = team_new(threads)
        if w.team == cython.NULL:
            raise MemoryError
        self.threads = threads
        self.dtype = np.dtype(np.float64 if cython.sizeof(real) == 8 else np.float32)
        w.cells, w.lists = c, l
        l.per_particle, l.per_pair, l.alone_room = 4.0, 1.25, 64.0
        l.pairs_room = l.lanes_room = 0
        w.count, w.groups = -1, 0
        self.arrays = {name: np.zeros(LEVELS, np.int64) for name in ("shift", "base", "width", "height", "held")}
        self.arrays |= {name: np.zeros(LEVELS, self.dtype) for name in ("across", "along", "level_largest")}
        a = self.arrays
        c.shift, c.base, c.width, c.height = map_integers(a, "shift"), map_integers(a, "base"), map_integers(a, "width"), map_integers(a, "height")
        c.held, c.across, c.along, c.largest = map_integers(a, "held"), reals(a["across"]), reals(a["along"]), reals(a["level_largest"])

    def __dealloc__(self):
        team_free(self.w.team)

    def set_threads(self, threads: cython.int):
        """Have a team of so many."""
        team_free(self.w.team)
        self.w.team = team_new(threads)
        if self.w.team == cython.NULL:
            raise MemoryError
        self.threads = threads

    # ---- what there is -------------------------------------------------------------------------------------------------------

    def set_particles(self, **a):
        """Arrays by slot, those of walls (4, count). category and mask are empty if all circles collide with all.

        With another number of particles there is no list any more: take what contacts remember before.
        """
        self.arrays.update(a)
        w: cython.pointer(Step) = cython.address(self.w)
        if w.count != len(a["position"]):
            self.count_particles(len(a["position"]))
        w.position, w.velocity, w.acceleration = reals(a["position"]), reals(a["velocity"]), reals(a["acceleration"])
        w.inverse_mass, w.radius = reals(a["inverse_mass"]), reals(a["radius"])
        w.spin = reals(a["spin"])
        w.motion, w.free, w.free_spin = reals(a["motion"]), reals(a["free"]), reals(a["free_spin"])
        w.given, w.given_spin = reals(a["given"]), reals(a["given_spin"])
        w.wall_impulse, w.wall_tangent = reals(a["wall_impulse"]), reals(a["wall_tangent"])
        w.at_wall = small_integers(a["at_wall"])
        w.own_restitution, w.own_friction = reals(a["own_restitution"]), reals(a["own_friction"])
        self.c.position, self.c.radius = w.position, w.radius
        self.l.particle, self.l.filtered = small_integers(a["particle"]), len(a["category"]) > 0
        self.l.category, self.l.mask = indices(a["category"]), indices(a["mask"])

    def count_particles(self, count: cython.Py_ssize_t):
        """Arrays for so many."""
        w: cython.pointer(Step) = cython.address(self.w)
        c: cython.pointer(Cells) = cython.address(self.c)
        l: cython.pointer(Lists) = cython.address(self.l)
        w.count = c.count = count
        blocks, groups, real_type = (count + BLOCK - 1) // BLOCK, count // GROUP + 3, self.dtype
        a = self.arrays
        a |= {name: np.zeros((count, 2), real_type) for name in ("listed", "checked", "moved")}
        a |= {name: np.zeros(count + 8, real_type) for name in ("spot_u", "spot_v", "spot_r")}
        a |= {name: np.zeros(count, np.uint32) for name in ("cell", "order", "patch", "used", "batch")}
        a |= {name: np.zeros(blocks, real_type) for name in ("fastest", "speeds")}
        a |= {name: np.zeros(blocks, np.int32) for name in ("stale", "walled")}
        a |= {name: np.zeros(groups, np.int64) for name in ("begin", "lanes", "row", "found", "raw_begin", "looked", "beyond")}
        a |= {"head": np.zeros(count, np.int32), "start": np.zeros(4 * count + 72, np.uint32)}
        a |= {"extent": np.zeros((blocks, 4), real_type), "box": np.zeros((2 * count + 64, 4), real_type)}
        w.listed, w.checked, w.moved = reals(a["listed"]), reals(a["checked"]), reals(a["moved"])
        w.fastest, w.stale, w.walled = reals(a["fastest"]), small_integers(a["stale"]), small_integers(a["walled"])
        w.begin, w.lanes = integers(a["begin"]), integers(a["lanes"])
        c.spot_u, c.spot_v, c.spot_r = reals(a["spot_u"]), reals(a["spot_v"]), reals(a["spot_r"])
        c.cell, c.order, c.start, c.patch = indices(a["cell"]), indices(a["order"]), indices(a["start"]), indices(a["patch"])
        c.extent, c.box = reals(a["extent"]), reals(a["box"])
        l.used, l.batch, l.speeds, l.head = indices(a["used"]), indices(a["batch"]), reals(a["speeds"]), small_integers(a["head"])
        l.row, l.found, l.raw_begin = integers(a["row"]), integers(a["found"]), integers(a["raw_begin"])
        l.looked, l.beyond = integers(a["looked"]), integers(a["beyond"])
        l.listed = l.good = l.harvested = False
        w.groups = l.rows = 0

    def set_materials(self, **n):
        """sized, varied, mixed: whether radii, masses, and any of restitution, friction and radii differ.

        bulk: largest radius of circles that stand in cells, m; smallest, largest and mean_radius, m. restitution, friction: of
        circles without values of their own. picky: whether some pairs are no pairs: of pinned or filtered ones, or linked ones.
        """
        w: cython.pointer(Step) = cython.address(self.w)
        l: cython.pointer(Lists) = cython.address(self.l)
        w.sized, w.varied, w.mixed = n["sized"], n["varied"], n["mixed"]
        self.c.bulk, self.c.smallest, l.largest, l.mean_radius = n["bulk"], n["smallest"], n["largest"], n["mean_radius"]
        l.restitution, l.friction, l.picky = n["restitution"], n["friction"], n["picky"] or l.linked
        l.refill = True
        self.make_pair_room()

    def set_linked(self, begin, to):
        """Pairs that links keep from touching: of the user's particle p those from begin[p] to begin[p + 1], higher ones."""
        self.arrays["linked_begin"], self.arrays["linked_to"] = begin, to
        self.l.linked = len(to) > 0
        self.l.linked_begin, self.l.linked_to = integers(begin), small_integers(to)
        self.l.picky = self.l.picky or self.l.linked
        self.l.good = False

    def set_room(self, room, x0, y0, x1, y1, restitution, friction, speed):
        """Walls: none (0); a cage (1) by centre and radius; a box (2) by two corners; m. speed: of a cage's surface, m/s."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.room, w.x0, w.y0, w.x1, w.y1 = room, x0, y0, x1, y1
        w.wall_restitution, w.wall_friction, w.wall_speed = restitution, friction, speed

    def set_seam(self, low_x: cython.double, low_y: cython.double, period_x: cython.double, period_y: cython.double):
        """The corner of a periodic room, and its periods, m; 0: none. Another room needs another list."""
        c: cython.pointer(Cells) = cython.address(self.c)
        if (c.low_x, c.low_y, c.period_x, c.period_y) != (low_x, low_y, period_x, period_y):
            c.low_x, c.low_y, c.period_x, c.period_y = low_x, low_y, period_x, period_y
            self.l.good = False

    def set_skin(self, diameters: cython.double, adapts: cython.bint):
        """How thick the skin is, in mean diameters, or begins with."""
        self.l.diameters, self.l.adapts = diameters, adapts

    def set_law(
        self, h: real, rate: real, stiff: real, leak: real, push: real, near: real, rest_speed: real, restless: cython.bint,
        relaxes: cython.int, rough: cython.bint,
    ):  # fmt: skip
        """Numbers of the substeps that come: see `Step`."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.h, w.rate, w.stiff, w.leak, w.push, w.near = h, rate, stiff, leak, push, near
        w.rest_speed, w.restless, w.relaxes, w.rough = rest_speed, restless, relaxes, rough

    def set_frame(
        self, opening: real, taken_back: real, scale: real, half: real, by_contacts: real, falls_free: cython.bint,
        gravity_x: real, gravity_y: real,
    ):  # fmt: skip
        """How the next call begins, and ends if gravity is all there is beside contacts: see `Step`."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.opening, w.taken_back, w.scale, w.half, w.by_contacts = opening, taken_back, scale, half, by_contacts
        w.falls_free, w.gravity_x, w.gravity_y = falls_free, gravity_x, gravity_y

    # ---- the list of pairs ---------------------------------------------------------------------------------------------------

    def forget_list(self):
        """It is no longer about the particles of now, whose order is the same."""
        self.l.good = False

    def make_room(self):
        """Arrays for as many pairs as the last list would have needed; what contacts remember is kept."""
        w: cython.pointer(Step) = cython.address(self.w)
        l: cython.pointer(Lists) = cython.address(self.l)
        pairs, lanes = l.raw_begin[w.groups] * 11 // 10 + 64, w.begin[w.groups] * 11 // 10 + 64
        real_type, a = self.dtype, self.arrays
        if pairs > l.pairs_room:
            l.pairs_room = pairs
            a |= {name: np.empty(pairs, np.uint32) for name in ("raw_i", "raw_j", "sorted", "rest")}
            a["key"] = np.empty(pairs, np.uint8)
            l.raw_i, l.raw_j, l.sorted, l.rest = indices(a["raw_i"]), indices(a["raw_j"]), indices(a["sorted"]), indices(a["rest"])
            l.key = octets(a["key"])
        if lanes > l.lanes_room:
            l.lanes_room = lanes
            a |= {name: np.zeros(lanes, np.uint32) for name in ("i", "j")}
            a |= {name: np.zeros((2, lanes), real_type) for name in ("gap", "normal")}
            a |= {name: np.zeros(lanes, real_type) for name in ("depth", "load", "impulse", "tangent_impulse")}
            a |= {"hit": np.zeros(lanes, np.int64), "hit_time": np.zeros(lanes)}
            w.hit, w.hit_time, w.i, w.j = integers(a["hit"]), doubles(a["hit_time"]), indices(a["i"]), indices(a["j"])
            w.gap_x, w.gap_y = map_row(a["gap"], 0), map_row(a["gap"], 1)
            w.normal_x, w.normal_y = map_row(a["normal"], 0), map_row(a["normal"], 1)
            w.depth, w.load, w.impulse, w.tangent_impulse = (
                reals(a["depth"]),
                reals(a["load"]),
                reals(a["impulse"]),
                reals(a["tangent_impulse"]),
            )
            self.make_kept_room(lanes)
            self.make_pair_room()

    def make_kept_room(self, lanes: cython.Py_ssize_t):
        """Room for what so many contacts remember, beside what is there."""
        a, old = self.arrays, self.arrays.get("kept")
        have = 0 if old is None else len(old)
        if have < lanes:
            shapes = (("kept_next", lanes, np.int32), ("kept_other", lanes, np.uint32), ("kept", (lanes, 3), self.dtype))
            for name, shape, kind in shapes:
                larger = np.zeros(shape, kind)
                if have:
                    larger[:have] = a[name]
                a[name] = larger
        l: cython.pointer(Lists) = cython.address(self.l)
        l.kept_next, l.kept_other, l.kept = small_integers(a["kept_next"]), indices(a["kept_other"]), reals(a["kept"])

    def make_pair_room(self):
        """Arrays for what pairs are made of: one a lane, or eight."""
        w: cython.pointer(Step) = cython.address(self.w)
        a, lanes = self.arrays, max(self.l.lanes_room, 8)
        shapes = {"reach": (lanes if w.sized else 8,), "share": (lanes if w.varied else 8,), "made_of": (6, lanes if w.mixed else 8)}
        for name, shape in shapes.items():
            if name not in a or a[name].shape != shape:
                a[name] = np.zeros(shape, self.dtype)
                self.l.refill = True
        w.reach, w.share = reals(a["reach"]), reals(a["share"])
        made_of = a["made_of"]
        w.restitution, w.friction, w.radius_i = map_row(made_of, 0), map_row(made_of, 1), map_row(made_of, 2)
        w.radius_j, w.turn_i, w.turn_j = map_row(made_of, 3), map_row(made_of, 4), map_row(made_of, 5)

    def run(self, substep: cython.int, substeps: cython.int, parts: cython.int):
        """Substeps from `substep` on by `parts` threads, with lists of pairs that are good in each.

        Returns whether all positions and velocities are finite.
        """
        w: cython.pointer(Step) = cython.address(self.w)
        w.first, w.substep, w.substeps = substep, substep, substeps
        while True:
            with cython.nogil:
                team_run(w.team, run_substeps, w, parts)
            if not self.l.short:
                break
            self.l.short = False
            self.make_room()
        finite: cython.bint = True
        b: cython.Py_ssize_t
        for b in range((w.count + BLOCK - 1) // BLOCK):
            finite &= w.stale[b] == 0
        return finite != 0

    def rebuilds(self) -> int:
        """How often the list has been made."""
        return self.l.rebuilds

    def pairs(self):
        """(first, count, i, j): where the pairs of each group are. A pair may come twice, one after the other."""
        w: cython.pointer(Step) = cython.address(self.w)
        groups, a = w.groups, self.arrays
        if groups == 0 or not self.l.listed:
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.uint32), np.zeros(0, np.uint32)
        return a["begin"][:groups], a["lanes"][:groups], a["i"], a["j"]

    def order(self):
        """(falls, order): slots in the order of the cells, and how often they fall; (0, None) without a list."""
        return (self.c.falls, self.arrays["order"].astype(np.int32)) if self.l.good else (0, None)

    def renumber(self, order):
        """The particle of slot order[k] will be in slot k, where `order` is that of `order()`; arrays are set afterwards."""
        w: cython.pointer(Step) = cython.address(self.w)
        a = self.arrays
        place = np.empty(len(order), np.uint32)
        place[order] = np.arange(len(order), dtype=np.uint32)
        for name in ("i", "j"):
            for s in range(w.groups):
                part = slice(w.begin[s], w.begin[s] + w.lanes[s])
                a[name][part] = place[a[name][part]]
        for name in ("listed", "checked"):
            a[name][:] = a[name][order]
        a["order"][:] = np.arange(len(order), dtype=np.uint32)
        self.c.falls = 0

    def follow_seam(self):
        """In a periodic room: places become the images nearest to where the list was last looked at.

        Those that have come far are put inside the room, and the list is to be made anew: far away digits are lost.
        """
        w: cython.pointer(Step) = cython.address(self.w)
        c: cython.pointer(Cells) = cython.address(self.c)
        i: cython.Py_ssize_t
        axis: cython.int
        strayed: cython.bint = False
        for axis in range(2):
            period: cython.double = c.period_y if axis else c.period_x
            low: cython.double = c.low_y if axis else c.low_x
            if period > 0 and self.l.good:
                for i in range(w.count):
                    away: cython.double = cython.cast(cython.double, w.position[2 * i + axis]) - w.checked[2 * i + axis]
                    turns: cython.double = rint(away / period)
                    if turns != 0:
                        w.position[2 * i + axis] = cython.cast(real, w.position[2 * i + axis] - period * turns)
                    far: cython.double = w.position[2 * i + axis] - low
                    strayed |= far > 1.5 * period or far < -0.5 * period
        if strayed:
            self.l.good = False
            self.wrap_seam()

    def wrap_seam(self):
        """Put all places inside a periodic room."""
        w: cython.pointer(Step) = cython.address(self.w)
        c: cython.pointer(Cells) = cython.address(self.c)
        i: cython.Py_ssize_t
        for i in range(w.count):
            w.position[2 * i] = wrapped(w.position[2 * i], c.low_x, c.period_x)
            w.position[2 * i + 1] = wrapped(w.position[2 * i + 1], c.low_y, c.period_y)

    # ---- what outlives it ----------------------------------------------------------------------------------------------------

    def take_impulses(self, particle):
        """(pairs, values) of contacts that overlap, carry load or did lately: particles low < high (k, 2), and (k, 3) m/s.

        Sorted by the lower. values: impulses along the normal and the tangent, and the load that the substep began with,
        negative of those that were apart then.
        """
        return read_impulses(cython.address(self.w), small_integers(particle), particle, self.dtype)

    def give_impulses(self, pairs, values):
        """Find them again in the next list; pairs: slots (k, 2). All others carry none."""
        self.make_kept_room(max(len(pairs), self.l.lanes_room, 8))
        fill_kept(cython.address(self.w), np.ascontiguousarray(pairs, np.int32), np.ascontiguousarray(values, self.dtype))
        self.l.listed, self.l.good, self.l.harvested = False, False, True

    def save_list(self):
        """(listed, checked, numbers): what `restore_list` needs to make the same list again; None without one."""
        l: cython.pointer(Lists) = cython.address(self.l)
        numbers = (l.diameters, l.half_skin, self.c.skin, self.w.allowed, float(l.age), float(l.hold))
        return (self.arrays["listed"].copy(), self.arrays["checked"].copy(), numbers) if l.good else None

    def restore_list(self, listed, checked, numbers):
        """Make the list that `save_list` was about; particles, their order and what they are made of are those of then."""
        w: cython.pointer(Step) = cython.address(self.w)
        l: cython.pointer(Lists) = cython.address(self.l)
        l.diameters, l.half_skin, self.c.skin = numbers[:3]
        self.c.position = reals(listed)
        while True:
            with cython.nogil:
                team_run(w.team, remake_list, w, 1)
            if not l.short:
                break
            l.short = False
            self.make_room()
        self.c.position = w.position
        self.arrays["checked"][:] = checked
        w.allowed = numbers[3]
        l.age, l.hold = int(numbers[4]), int(numbers[5])


@cython.cfunc
def map_row(rows, k: cython.int) -> cython.pointer(real):
    """The address of a row of an array."""
    return reals(rows[k])


@cython.cfunc
def map_integers(arrays, name) -> cython.pointer(int64_t):
    """The address of one of these arrays."""
    return integers(arrays[name])
