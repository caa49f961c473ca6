# mypy: ignore-errors
"""The object that Python holds: it takes the addresses of arrays once, and runs substeps over them without the GIL."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import doubles, indices, integers, reals, small_integers
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, int64_t
from cython.cimports.team import team_free, team_new, team_run

from pyverlet.core.frame import run_substeps, strays
from pyverlet.core.step import Step


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def remembers(w: cython.pointer(Step), s: cython.Py_ssize_t, k: cython.Py_ssize_t) -> cython.bint:
    """Whether lane k of group s has something to remember, and is no repeated pair."""
    if not (w.impulse[k] > 0 or w.depth[k] > 0 or w.load[k] < 0):
        return False
    return not (k > w.begin[s] and w.i[k] == w.i[k - 1] and w.j[k] == w.j[k - 1])


@cython.cclass
class Engine:
    """Particles, their pairs and their room, and a team of threads. Arrays are named as in `Step`; the engine keeps them.

    Args:
        threads: most threads that go through a frame together.
    """

    w: Step
    arrays = cython.declare(dict, visibility="public")
    threads = cython.declare(cython.int, visibility="readonly")

    def __init__(self, threads: cython.int):
        self.w.team = team_new(threads)
        if self.w.team == cython.NULL:
            raise MemoryError
        self.threads = threads
        self.arrays = {
            "fastest": np.zeros(threads, np.float64 if cython.sizeof(real) == 8 else np.float32),
            "stale": np.zeros(threads, np.int32),
        }
        self.w.fastest, self.w.stale = reals(self.arrays["fastest"]), small_integers(self.arrays["stale"])

    def __dealloc__(self):
        team_free(self.w.team)

    def set_particles(self, **a):
        """Arrays by slot, those of walls (4, count)."""
        self.arrays.update(a)
        w: cython.pointer(Step) = cython.address(self.w)
        w.count = len(a["position"])
        w.position, w.velocity, w.acceleration = reals(a["position"]), reals(a["velocity"]), reals(a["acceleration"])
        w.inverse_mass, w.radius = reals(a["inverse_mass"]), reals(a["radius"])
        w.motion, w.free, w.free_spin = reals(a["motion"]), reals(a["free"]), reals(a["free_spin"])
        w.given, w.given_spin = reals(a["given"]), reals(a["given_spin"])
        w.wall_impulse, w.wall_tangent = reals(a["wall_impulse"]), reals(a["wall_tangent"])
        w.at_wall = small_integers(a["at_wall"])
        w.own_restitution, w.own_friction = reals(a["own_restitution"]), reals(a["own_friction"])

    def set_pairs(self, **a):
        """Arrays by lane; made_of: rows restitution, friction, radii of i and j, 2 / radii."""
        self.arrays.update(a)
        w: cython.pointer(Step) = cython.address(self.w)
        made_of = a["made_of"]
        w.groups = len(a["lanes"])
        w.begin, w.lanes, w.hit, w.hit_time = (
            integers(a["begin"]),
            integers(a["lanes"]),
            integers(a["hit"]),
            doubles(a["hit_time"]),
        )
        w.i, w.j, w.gap_x, w.gap_y = indices(a["i"]), indices(a["j"]), reals(a["gap"][0]), reals(a["gap"][1])
        w.normal_x, w.normal_y, w.depth = reals(a["normal"][0]), reals(a["normal"][1]), reals(a["depth"])
        w.load, w.impulse, w.tangent_impulse = reals(a["load"]), reals(a["impulse"]), reals(a["tangent_impulse"])
        w.listed, w.moved, w.reach, w.share = reals(a["listed"]), reals(a["moved"]), reals(a["reach"]), reals(a["share"])
        w.restitution, w.friction, w.radius_i, w.radius_j = (
            map_rows(made_of, 0),
            map_rows(made_of, 1),
            map_rows(made_of, 2),
            map_rows(made_of, 3),
        )
        w.turn_i, w.turn_j = map_rows(made_of, 4), map_rows(made_of, 5)
        w.sized, w.varied, w.mixed = a["sized"], a["varied"], a["mixed"]

    def set_room(self, room, x0, y0, x1, y1, restitution, friction, speed):
        """Walls: none (0); a cage (1) by centre and radius; a box (2) by two corners; m. speed: of a cage's surface, m/s."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.room, w.x0, w.y0, w.x1, w.y1 = room, x0, y0, x1, y1
        w.wall_restitution, w.wall_friction, w.wall_speed = restitution, friction, speed

    def set_links(self, cut, rows, passes, period_x, period_y):
        """Rows of links (world/link_rows.py), blocks of each thread (parts + 1,), and periods of the room, m or 0."""
        self.arrays["links"] = cut, rows
        r = rows
        w: cython.pointer(Step) = cython.address(self.w)
        w.link_cut, w.link_passes, w.period_x, w.period_y = integers(cut), passes, period_x, period_y
        w.block_begin, w.block_band, w.link_single = integers(r["begin"]), integers(r["band"]), small_integers(r["single"])
        w.link_first, w.link_node, w.link_kind = integers(r["first"]), indices(r["node"]), small_integers(r["kind"])
        w.link_gradient, w.link_rest, w.link_stiffness = doubles(r["gradient"]), doubles(r["rest"]), doubles(r["stiffness"])
        w.link_damping, w.link_upper, w.link_strength = doubles(r["damping"]), doubles(r["upper"]), doubles(r["strength"])
        w.link_intact, w.link_acts = small_integers(r["intact"]), small_integers(r["acts"])
        w.link_impulse, w.link_pull, w.link_value = doubles(r["impulse"]), doubles(r["pull"]), doubles(r["value"])
        w.link_next, w.link_soft, w.link_target = doubles(r["next"]), doubles(r["soft"]), doubles(r["target"])
        w.link_aim, w.link_left, w.link_matrix = doubles(r["aim"]), doubles(r["left"]), doubles(r["matrix"])
        w.link_pivot, w.link_inverse = doubles(r["pivot"]), doubles(r["inverse"])
        w.link_rows, w.link_band = len(r["kind"]), r["matrix"].shape[1] - 1

    def set_law(self, **n):
        """Numbers of the substeps that come."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.h, w.opening, w.taken_back, w.scale = n["h"], n["opening"], n["taken_back"], n["scale"]
        w.rest_speed, w.restless, w.rate, w.stiff, w.leak = n["rest_speed"], n["restless"], n["rate"], n["stiff"], n["leak"]
        w.kick = n["kick"]
        w.push, w.near, w.relaxes, w.rough = n["push"], n["near"], n["relaxes"], n["rough"]

    def set_list(self, cut, checked, allowed: cython.double):
        """Which groups each thread does, (2, parts + 1); the list is good within `allowed`, m, of `checked` (count, 2)."""
        self.arrays["cut"], self.arrays["checked"] = cut, checked
        self.w.cut, self.w.checked, self.w.allowed = integers(cut), reals(checked), allowed * allowed

    def strays(self) -> bool:
        """Whether a particle may leave where the list of pairs is good in the first substep."""
        return strays(cython.address(self.w)) != 0

    def run(self, substep: cython.int, substeps: cython.int, parts: cython.int):
        """Substeps from `substep` on by `parts` threads; returns how far they came, and whether the list needs a look."""
        w: cython.pointer(Step) = cython.address(self.w)
        w.first, w.substep, w.substeps = substep, substep, substeps
        with cython.nogil:
            team_run(w.team, run_substeps, w, parts)
        return w.substep, bool(self.arrays["stale"][:parts].any())

    def take_impulses(self, particle):
        """(pairs, values) of contacts that overlap, carry load or did lately: particles low < high (k, 2), and (k, 3) m/s.

        Sorted by the lower. values: impulses along the normal and the tangent, and the load that the substep began with.
        """
        w: cython.pointer(Step) = cython.address(self.w)
        who: cython.pointer(int32_t) = small_integers(particle)
        first = np.zeros(int(particle.max(initial=-1)) + 2, np.int64)
        begin: cython.pointer(int64_t) = integers(first)
        s: cython.Py_ssize_t
        k: cython.Py_ssize_t
        for s in range(w.groups):
            for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
                if remembers(w, s, k):
                    begin[min(who[w.i[k]], who[w.j[k]]) + 1] += 1
        np.cumsum(first, out=first)
        pairs = np.empty((first[-1], 2), np.int32)
        values = np.empty((first[-1], 3), np.float64 if cython.sizeof(real) == 8 else np.float32)
        pair: cython.pointer(int32_t) = small_integers(pairs)
        value: cython.pointer(real) = reals(values)
        for s in range(w.groups):
            for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
                if remembers(w, s, k):
                    p: int32_t = who[w.i[k]]
                    q: int32_t = who[w.j[k]]
                    n: int64_t = begin[min(p, q)]
                    begin[min(p, q)] = n + 1
                    pair[2 * n], pair[2 * n + 1] = min(p, q), max(p, q)
                    value[3 * n] = w.impulse[k]
                    value[3 * n + 1] = w.tangent_impulse[k] if w.rough else 0
                    value[3 * n + 2] = w.load[k]
        return pairs, values

    def give_impulses(self, particle, pairs, values):
        """Find them again for the pairs of another list; all others carry none."""
        w: cython.pointer(Step) = cython.address(self.w)
        begin = np.zeros(int(particle.max(initial=-1)) + 2, np.int64)
        np.cumsum(np.bincount(pairs[:, 0], minlength=len(begin) - 1), out=begin[1:])
        who: cython.pointer(int32_t) = small_integers(particle)
        first: cython.pointer(int64_t) = integers(begin)
        pair: cython.pointer(int32_t) = small_integers(pairs)
        value: cython.pointer(real) = reals(values)
        s: cython.Py_ssize_t
        k: cython.Py_ssize_t
        n: cython.Py_ssize_t
        for s in range(w.groups):
            for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
                w.impulse[k] = w.tangent_impulse[k] = w.load[k] = 0
                w.depth[k] = -1
                p: int32_t = who[w.i[k]]
                q: int32_t = who[w.j[k]]
                for n in range(first[min(p, q)], first[min(p, q) + 1]):
                    if pair[2 * n + 1] == max(p, q):
                        w.impulse[k], w.tangent_impulse[k], w.load[k] = value[3 * n], value[3 * n + 1], value[3 * n + 2]
                        w.depth[k] = 1 if value[3 * n] > 0 or value[3 * n + 2] > 0 else -1


@cython.cfunc
def map_rows(rows, k: cython.int) -> cython.pointer(real):
    """The address of a row of an array."""
    return reals(rows[k])
