"""Frames of plain worlds, run by the compiled core: circles in a room of ours, under gravity and forces."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.compile import jit
from pyverlet.laws.contacts.broadphase import Fast
from pyverlet.laws.integrators import PositionVerlet, SemiImplicitEuler, TimeCorrectedVerlet
from pyverlet.laws.rooms import Box, Circle, Open
from pyverlet.state.slots import Slots

sys.path.insert(0, "/tmp/w/dev/out")

Array = NDArray[Any]

ENGINES: dict[str, Any] = {}
LONGEST = 1 / 30
HERTZ, DAMPING, PUSH, RELAXES = 150.0, 15.0, 3.0, 2
import os
if os.environ.get("LAW"):
    a, b, c, d = os.environ["LAW"].split(",")
    HERTZ, DAMPING, PUSH, RELAXES = float(a), float(b), float(c), int(d)


def engine_of(dtype: Any, threads: int) -> Any:
    import importlib
    return importlib.import_module("engine64" if dtype == np.float64 else "engine32").Engine(threads)


class CoreFrames:
    """What the core remembers of one world."""

    def __init__(self, dtype: Any) -> None:
        self.dtype = dtype
        self.engine = engine_of(dtype, 2)
        self.particle = np.empty(0, np.int32)
        self.given = np.empty((0, 2), dtype)
        self.given_spin = np.empty(0, dtype)
        self.wall = np.empty((4, 0), dtype)
        self.wall_tangent = np.empty((4, 0), dtype)
        self.pairs = np.empty((0, 2), np.int32)
        self.values = np.empty((0, 2), dtype)
        self.listed: Any = None
        self.known: Any = None
        self.kick = self.h = self.hertz = self.finer = 0.0

    def serves(self, world: Any) -> bool:
        plain = type(world.integrator) in (PositionVerlet, TimeCorrectedVerlet, SemiImplicitEuler)
        plain &= not getattr(world.integrator, "naive_start", False)
        room = world.boundary
        plain &= type(room) in (Circle, Box, Open) and not room.moves
        plain &= not (world.links or world.obstacles or world.forces or world._books or world._events or world._touches or world._sleep)
        return plain and (world.collisions is None or isinstance(world.collisions.method, Fast))

    # -- memory by slot
    def follow(self, state: Slots) -> None:
        if self.particle is state.particle and len(self.given) == len(state):
            return
        now, n = state.particle, len(state)
        users = max(int(now.max(initial=-1)), int(self.particle.max(initial=-1))) + 1

        def moved(old: Array) -> Array:
            mine = np.zeros((*old.shape[:-1], users) if old.ndim == 2 and old.shape[0] == 4 else (users, *old.shape[1:]), self.dtype)
            if old.ndim == 2 and old.shape[0] == 4 and old.shape[1] == len(self.particle):
                mine[:, self.particle] = old
                return np.ascontiguousarray(mine[:, now])
            mine[self.particle] = old
            return np.ascontiguousarray(mine[now])

        wall = np.zeros((4, users), self.dtype)
        wall[:, self.particle] = self.wall
        self.wall = np.ascontiguousarray(wall[:, now])
        wall[:] = 0
        wall[:, self.particle] = self.wall_tangent
        self.wall_tangent = np.ascontiguousarray(wall[:, now])
        given = np.zeros((users, 2), self.dtype)
        given[self.particle] = self.given
        self.given = given[now]
        spin = np.zeros(users, self.dtype)
        spin[self.particle] = self.given_spin
        self.given_spin = spin[now]
        self.particle = now
        self.motion, self.free, self.free_spin = np.zeros((n, 4), self.dtype), np.zeros((n, 2), self.dtype), np.zeros(n, self.dtype)
        self.known = None

    def harvest(self) -> None:
        """The list is about to be made anew."""
        if self.listed is not None:
            self.pairs, self.values = self.engine.take_impulses(self.particle)
            self.listed = None

    def load(self, world: Any, contacts: Any, state: Slots) -> None:
        wide = contacts._pack(state) if contacts else None
        if wide is not None and not wide.fits(state):
            wide.bear(True)
            wide.fit(state)
            self.known = None
        fresh = (state.position, state.velocity, state.acceleration, state.inverse_mass, state.radius, state.restitution, wide and wide.lane_i, wide and wide.made_of)
        if self.known is None or self.listed is None or any(a is not b for a, b in zip(self.known, fresh, strict=True)):
            self.known = fresh
            self.engine.set_particles(
                position=state.position, velocity=state.velocity, acceleration=state.acceleration, spin=state.spin,
                inverse_mass=state.inverse_mass, radius=state.radius, motion=self.motion, free=self.free,
                free_spin=self.free_spin, given=self.given, given_spin=self.given_spin, wall_impulse=self.wall,
                wall_tangent=self.wall_tangent, at_wall=np.zeros(len(state), np.int32), restitution=state.restitution, friction=state.friction,
            )
            if wide is None:
                none = np.zeros(0, self.dtype)
                whole = np.zeros(1, np.int64)
                self.moved = np.zeros((len(state), 2), self.dtype)
                self.engine.set_pairs(
                    begin=whole, lanes=whole[:0], hit=whole, i=np.zeros(0, np.uint32), j=np.zeros(0, np.uint32), gap_x=none, gap_y=none,
                    normal_x=none, normal_y=none, depth=none, load=none, impulse=none, tangent_impulse=none, hit_time=np.zeros(0),
                    listed=self.moved, moved=self.moved, reach=none, share=none, e=none, mu=none, radius_i=none, radius_j=none,
                    turn_i=none, turn_j=none, sized=0, varied=0, mixed=0)
                self.listed = whole
                return
            if self.listed is not wide.lane_i:
                room = len(wide.lane_i)
                self.impulse, self.tangent = np.zeros(room, self.dtype), np.zeros(room, self.dtype)
                self.depth, self.loads = np.zeros(room, self.dtype), np.zeros(room, self.dtype)
                self.hit, self.hit_time = np.zeros(room, np.int64), np.zeros(room)
                self.listed = wide.lane_i
                give = True
            else:
                give = False
            made = wide.made_of
            self.engine.set_pairs(
                begin=wide.begin, lanes=wide.lanes, hit=self.hit, hit_time=self.hit_time, i=wide.lane_i, j=wide.lane_j, gap_x=wide.gap[0], gap_y=wide.gap[1],
                normal_x=wide.normal[0], normal_y=wide.normal[1], depth=self.depth, load=self.loads, impulse=self.impulse, tangent_impulse=self.tangent,
                listed=wide.origin, moved=wide.moved, reach=wide.reach, share=wide.share, e=made[0], mu=made[1], radius_i=made[2], radius_j=made[3],
                turn_i=made[4], turn_j=made[5], sized=wide._sized, varied=wide._varied, mixed=wide._mixed)
            if give:
                self.engine.give_impulses(self.particle, self.pairs, self.values)

    def frame(self, world: Any, h: float, done: Any) -> bool:
        state, contacts = world._slots, world._contacts if len(world) > 1 else None
        substeps = world.substeps
        dt = h * substeps
        if contacts or world.boundary.extent() is not None:
            substeps *= int(np.ceil(dt / LONGEST * (1 - 1e-9)))
        h = dt / substeps
        half = 0.5 if world.integrator.velocity_lag else 0.0
        forces, room = world._force_sum, world.boundary
        if contacts:
            contacts.broad_phase.replacing = self.harvest
        forces(state, world.time)
        strongest = forces.strongest
        kick0 = h if not half else 0.5 * (h + self.h) if self.kick else 0.5 * h
        target = 0.3125 / h
        self.finer = self.finer + dt if target > self.hertz else 0.0
        grown = self.hertz * 2 ** (0.4 * dt) if self.finer > 0.5 else self.hertz
        self.hertz = min(target, grown) if self.hertz else target
        om = 2 * np.pi * self.hertz
        a1 = 2 * DAMPING + h * om
        a2 = h * om * a1
        scale = kick0 / self.kick if self.kick else 1.0
        second = h / kick0
        rough = bool(contacts and contacts._rubs(state)) or getattr(room, "friction", 0.0) > 0
        substep, stale = 0, False
        cut = np.array([[0, 0], [0, 0]])
        checked, allowed = state.position, np.inf
        while substep < substeps:
            if contacts:
                contacts.broad_phase.strayed = True if stale else None
                contacts.find(state, 0.0)
                done("broad phase")
            self.follow(state)
            self.load(world, contacts, state)
            if substep == 0:
                self.set_room(room)
            if rough and (substep == 0 or self.unsynced):
                self.motion[:, :2], self.motion[:, 2] = state.velocity, state.spin
            law = dict(
                kick=h, rest_speed=4 * strongest * h, restless=strongest == 0, rate=om / a1, stiff=a2 / (1 + a2), 
                push=PUSH, near=0.025 * float(state.radius.max(initial=0)) * 2 + 8 * strongest * h * h, relaxes=RELAXES, rough=rough)
            if contacts:
                strips = contacts.broad_phase.strips()
                cut, checked, allowed = contacts.wide.cut(), strips.checked, strips.allowed
            parts = cut.shape[1] - 1
            one = substep + 1 if substep == 0 and second != 1.0 else substeps
            first = substep == 0
            back = (0.5 * self.h / self.kick if self.kick else 0.0) if half else 0.0
            self.engine.set_law(leak=(h / kick0 if first else 1.0) / (1 + a2), h=h, opening=(0.5 * h if half else h) if first else h, taken_back=back if first else 0.0, scale=scale if first else second if substep == 1 else 1.0, **law)
            before = substep
            substep, stale = self.engine.run(substep, one, parts, np.ascontiguousarray(cut), checked, allowed * allowed)
            if rough:
                state.velocity[:], state.spin[:] = self.motion[:, :2], self.motion[:, 2]
            self.unsynced = True
            if contacts:
                contacts.broad_phase.aged(substep - before - 1)
        self.kick = h if substeps > 1 else kick0
        self.h = h
        done("contacts")
        if half:
            forces(state, world.time + dt)
            state.velocity += self.dtype.type(0.5 * h) * (state.acceleration + self.given / self.dtype.type(self.kick))
        state.acceleration += self.given / self.dtype.type(self.kick)
        return False

    def set_room(self, room: Any) -> None:
        if type(room) is Circle:
            self.engine.set_room(1, *room.center, room.radius, 0.0, room.restitution, room.friction)
        elif type(room) is Box:
            self.engine.set_room(2, *room.lower, *room.upper, room.restitution, room.friction)
        else:
            self.engine.set_room(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
