"""Frames under the law of impulses (`Collisions(impulses=True)`): what the compiled core is given, and what it remembers.

The law, its sources and its measurements: docs/design/impulses.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet import core
from pyverlet.ground.constants import REST_ACCELERATIONS
from pyverlet.ground.errors import InputError, NonFiniteError
from pyverlet.laws.contacts.broadphase import Fast
from pyverlet.laws.integrators import PositionVerlet, SemiImplicitEuler, TimeCorrectedVerlet
from pyverlet.laws.limiter import watched
from pyverlet.laws.rooms import Box, Circle, Open, Periodic
from pyverlet.state.moves import first_non_finite
from pyverlet.state.slots import Slots
from pyverlet.world.link_rows import LinkRows

Array = NDArray[Any]

LONGEST_FRAME = 1 / 30
"""s. A longer frame is stepped as several, each of `substeps` substeps: contacts of a step longer than that are soft as mud."""

STIFFNESS = 0.3125
"""Frequency of the springs of contacts times the length of a substep. Above 0.375 columns of unequal masses become unstable."""

STIFFEST = 1.3
"""The same for a while after substeps have become longer."""

STIFFENING, SOFTENING = 0.4, 1.0
"""Octaves a second by which that frequency may rise and fall: at once, what lies on soft contacts would be thrown up, or drop."""

DAMPING = 15.0
"""Damping ratio of the springs."""

PUSH_OUT = 3.0
"""Fastest pushing out of overlaps, m/s."""

RELAXING_SWEEPS = 2

NEAR = 0.05
"""Of the largest radius: pairs and walls with larger gaps carry no load."""

OPEN, CAGE, BOX = range(3)
"""Rooms, as the core numbers them."""


class Memory(NamedTuple):
    """What outlives a frame, by the user's index: contacts between particles and on walls, what they gave each, and the step.

    pairs (k, 2) and values (k, 3): see `Engine.take_impulses`. wall: (8, n) impulses along the normals of four sides, and along
    their tangents. given: (n, 3) velocity and spin that contacts gave in the last substep, over `kick` seconds. h: length of the
    last substep, s. hertz: frequency of the springs; finer: for how long, s, a higher one would have been possible.
    """

    pairs: Array
    values: Array
    wall: Array
    given: Array
    kick: float
    h: float
    hertz: float
    finer: float


class ImpulseFrames:
    """The law of impulses in one world."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self._engine: Any = None
        self._synced = False  # whether `_motion` holds the velocities of now
        self._parts = 1
        self._links = LinkRows()
        self.forget()

    def forget(self) -> None:
        """No contact remembers anything."""
        none = (
            np.empty((0, 2), np.int32),
            np.empty((0, 3), self._dtype),
            np.empty((8, 0), self._dtype),
            np.empty((0, 3), self._dtype),
        )
        self.restore(Memory(*none, 0.0, 0.0, 0.0, 0.0))

    def save(self) -> Memory:
        """What `restore` needs to go on with the same bits."""
        self._harvest()
        count = int(self._particle.max(initial=-1)) + 1
        wall, given = np.zeros((8, count), self._dtype), np.zeros((count, 3), self._dtype)
        wall[:, self._particle] = self._wall
        given[self._particle] = self._given
        pairs, values = self._kept
        return Memory(pairs.copy(), values.copy(), wall, given, self._kick, self._h, self._hertz, self._finer)

    def restore(self, memory: Memory) -> None:
        """Back to what `save` returned."""
        self._kept = memory.pairs, memory.values
        self._links.forget()
        self._particle = np.arange(len(memory.given), dtype=np.int32)
        self._wall, self._given = memory.wall, memory.given
        self._kick, self._h, self._hertz, self._finer = memory.kick, memory.h, memory.hertz, memory.finer
        self._held: Any = None
        self._listed: Any = None  # the lanes that hold the impulses of now

    def renumber(self, now: Array) -> None:
        """The particles are now at `now` (n,), or no more (-1)."""
        self._harvest()
        memory = self.save()
        count, alive = int(now.max(initial=-1)) + 1, now[: len(memory.given)] >= 0
        wall, given = np.zeros((8, count), self._dtype), np.zeros((count, 3), self._dtype)
        to = now[: len(memory.given)][alive]
        wall[:, to], given[to] = memory.wall[:, alive], memory.given[alive]
        pairs = now[memory.pairs].astype(np.int32)
        kept = (pairs >= 0).all(axis=1)
        self.restore(memory._replace(pairs=pairs[kept], values=memory.values[kept], wall=wall, given=given))

    # ---- a frame -------------------------------------------------------------------------------------------------------------

    def step(self, world: Any, dt: float) -> None:
        """Advance the slots of a world by a frame of dt seconds: all of `World.step` but for what its arrays become.

        Raises:
            InputError: there is something in the world that this law does not know yet.
            NonFiniteError: a particle turned NaN or infinite.
        """
        self.check(world)
        world._slots.clear_notes()
        if world.links.begin_apart() and world._contacts:
            world._contacts.broad_phase.forget()
        world._gather()
        world.profile.mark("gather")
        self.run(world, dt, world.profile.mark)

    def check(self, world: Any) -> None:
        """Refuse what this law does not know yet.

        Raises:
            InputError: there is such a thing in the world.
        """
        integrator, room = world.integrator, world.boundary
        known = type(integrator) in (PositionVerlet, TimeCorrectedVerlet, SemiImplicitEuler)
        unknown = {
            "obstacles": bool(world.obstacles),
            "a ledger": world.keeps_ledger,
            "events": world.tells_events,
            "contacts=True": world._touches is not None,
            "sleep=True": world._sleep is not None,
            repr(integrator): not known or getattr(integrator, "naive_start", False),
            f"a room of type {type(room).__name__}": type(room) not in (Circle, Box, Open, Periodic),
            "brute force": world.collisions is not None and not isinstance(world.collisions.method, Fast),
        }
        if found := [name for name, there in unknown.items() if there]:
            raise InputError(
                f"impulses is True in a world with {found[0]}; allowed are circles in a Circle, Box, Periodic or Open room, with "
                "forces, stepped by PositionVerlet, TimeCorrectedVerlet or SemiImplicitEuler"
            )

    def run(self, world: Any, dt: float, done: Callable[[str], None]) -> None:
        """Advance the gathered slots by a frame of dt seconds.

        Raises:
            NonFiniteError: a particle turned NaN or infinite.
        """
        state, forces = world._slots, world._force_sum
        state.grown.fill(1)
        state.resize()
        contacts = world._contacts if len(world) > 1 else None
        contained = contacts is not None or not isinstance(world.boundary, Open)
        substeps = world.substeps * (int(np.ceil(dt / LONGEST_FRAME * (1 - 1e-9))) if contained or world.links else 1)
        h, half = dt / substeps, world.integrator.velocity_lag
        first_kick = half * (h + (self._h if self._kick else 0.0)) if half else h
        self._stiffen(h, dt)
        # The limiter would take what velocities shown of linked particles are off by, h^2, for surplus.
        watch = watched(world, dt / world.substeps, None) if contained and not world.links else None
        state.h = h
        rough = bool(contacts and contacts._rubs(state)) or getattr(world.boundary, "friction", 0.0) > 0.0
        step, stale = 0, None
        if contacts:
            contacts.broad_phase.replacing = self._harvest
        while step < substeps:
            if step == 0 or forces.forces:
                self._evaluate(world, step * h, half * h if step else 0.0)
                done("integrate")
            last = 1.0 if not self._kick else self._kick
            kick = first_kick if step == 0 else h
            self._load(world, contacts, stale)
            self._load_links(world)
            done("broad phase")
            self._set_law(forces.strongest, h, kick, kick / last, opening=step == 0, half=half, rough=rough, state=state)
            if step == 0:
                self._set_room(world.boundary)
                if contacts and self._engine.strays():
                    self._load(world, contacts, True)
            if rough and not self._synced:
                self._motion[:, :2], self._motion[:, 2] = state.velocity, state.spin
            # The first substep has a kick of its own; forces of Python are asked in each.
            stop = step + 1 if forces.forces or kick != h else substeps
            before = step
            step, stale = self._engine.run(step, stop, self._parts)
            self._kick, self._synced = (h if step > 1 else first_kick), not forces.forces
            if rough:
                state.velocity[:], state.spin[:] = self._motion[:, :2], self._motion[:, 2]
            if contacts:
                contacts.broad_phase.aged(step - before - 1)
            done("contacts")
            world._show(step * h, half * h) if step < substeps else None
        self._h, self._synced = h, False
        self._given[:, :2], self._given[:, 2] = self._gave, self._gave_spin
        self._end(world, dt, half * h)
        if watch:
            watch.close(state, contacts)
        done("finish")

    def _evaluate(self, world: Any, since: float, ahead: float) -> None:
        """Accelerations by gravity and forces; these see velocities of now, not of half a substep ago."""
        state, forces = world._slots, world._force_sum
        if ahead and forces.velocity_dependent:
            velocity = state.velocity.copy()
            state.velocity += state.real(ahead) * (state.acceleration + self._gave / state.real(self._kick))
            forces(state, world.time + since)
            state.velocity[:] = velocity
        else:
            forces(state, world.time + since)

    def _end(self, world: Any, dt: float, half: float) -> None:
        """Velocities that belong to the positions, and the accelerations of now."""
        state, by_contacts = world._slots, self._given[:, :2] / self._dtype.type(self._kick)
        if half:
            self._evaluate(world, dt, half)
            state.velocity += state.real(half) * (state.acceleration + by_contacts)
        state.acceleration += by_contacts
        if (particle := first_non_finite(state)) >= 0:
            self.forget()
            raise NonFiniteError(particle, "contacts", world.time)

    def _stiffen(self, h: float, dt: float) -> None:
        best = STIFFNESS / h
        self._finer = self._finer + dt if best > self._hertz else 0.0
        if not self._hertz:
            self._hertz = best
        elif best < self._hertz:
            self._hertz = min(max(best, self._hertz * 2.0 ** (-SOFTENING * dt)), STIFFEST / h)
        elif self._finer > 0.5:
            self._hertz = min(best, self._hertz * 2.0 ** (STIFFENING * dt))

    def _set_law(
        self, strongest: float, h: float, kick: float, scale: float, *, opening: bool, half: float, rough: bool, state: Slots
    ) -> None:
        omega = 2.0 * np.pi * self._hertz
        damped = 2.0 * DAMPING + h * omega
        hard = h * omega * damped
        known = self._kick > 0.0
        self._engine.set_law(
            h=h,
            kick=kick,
            opening=(half * h if half else h) if opening else h,
            taken_back=half * self._h / self._kick if opening and known else 0.0,
            scale=scale if known else 1.0,
            rest_speed=REST_ACCELERATIONS * strongest * h,
            restless=strongest == 0.0,
            rate=omega / damped,
            stiff=hard / (1.0 + hard),
            # As in a substep whose kick is as long as itself: the depth at which a contact carries its load stays the same.
            leak=h / kick / (1.0 + hard),
            push=PUSH_OUT,
            near=NEAR * float(state.radius.max(initial=0.0)) + 2.0 * REST_ACCELERATIONS * strongest * h * h,
            relaxes=RELAXING_SWEEPS,
            rough=rough,
        )

    def _set_room(self, room: Any) -> None:
        if isinstance(room, Circle):
            speed = room.angular_velocity * room.radius
            self._engine.set_room(CAGE, *room.center, room.radius, 0.0, room.restitution, room.friction, speed)
        elif isinstance(room, Open) or (isinstance(room, Periodic) and room.axes == "xy"):
            self._engine.set_room(OPEN, *(0.0,) * 7)
        else:
            corners = room._box if isinstance(room, Periodic) else (*room.lower, *room.upper)
            self._engine.set_room(BOX, *corners, room.restitution, room.friction, 0.0)

    # ---- arrays --------------------------------------------------------------------------------------------------------------

    def _load(self, world: Any, contacts: Any, stale: bool | None) -> None:
        """Bring the list of pairs up to date, and have the engine see the arrays of now."""
        state = world._slots
        wide = None
        if contacts:
            contacts.broad_phase.strayed = stale
            contacts.find(state, 0.0)
            wide = contacts._pack(state)
            if not wide.fits(state):
                wide.bear(True)
                wide.fit(state)
        self._follow(state)
        self._parts = 1 if wide is None else wide.cut().shape[1] - 1
        if self._engine is None or self._engine.threads < self._parts:
            self._engine, self._held = core.unit("engine", self._dtype).Engine(self._parts), None
        seen = (
            state.position,
            state.velocity,
            state.inverse_mass,
            state.radius,
            self._motion,
            wide and (wide.lane_i, wide.made_of),
        )
        if self._held is None or self._listed is None or not all(a is b for a, b in zip(self._held, seen, strict=True)):
            self._held = seen
            self._engine.set_particles(
                position=state.position, velocity=state.velocity, acceleration=state.acceleration,
                inverse_mass=state.inverse_mass, radius=state.radius, own_restitution=state.restitution,
                own_friction=state.friction, motion=self._motion, free=self._free, free_spin=self._free_spin, given=self._gave,
                given_spin=self._gave_spin, wall_impulse=self._wall[:4], wall_tangent=self._wall[4:], at_wall=self._at_wall,
            )  # fmt: skip
            self._load_pairs(state, wide)
        if wide is None:
            self._engine.set_list(np.zeros((2, 2), np.int64), state.position, np.inf)
        else:
            strips = contacts.broad_phase.strips()
            self._engine.set_list(np.ascontiguousarray(wide.cut()), strips.checked, strips.allowed)

    def _load_links(self, world: Any) -> None:
        if world.links or len(self._links):
            self._links.load(world.links, world._slots, world._state.mass)
            passes, period = world.links.iterations, world._slots.seam.period
            self._engine.set_links(self._links.cut(self._parts), self._links.rows, passes, *period)

    def end_links(self, world: Any) -> None:
        """The frame is good: what it did to the links holds."""
        world.links.accept(self._links.hand_over() if world.links else [])

    def _load_pairs(self, state: Slots, wide: Any) -> None:
        real = self._dtype
        begin = np.zeros(1, np.int64) if wide is None else wide.begin
        room = 0 if wide is None else len(wide.lane_i)
        none = np.empty((6, 0), real)
        if fresh := self._listed is None:
            self._lanes = {name: np.zeros(room, real) for name in ("depth", "load", "impulse", "tangent_impulse")}
            self._lanes |= {"hit": np.zeros(room, np.int64), "hit_time": np.zeros(room)}
        names = ("sized", "varied", "mixed")
        if wide is None:
            unsigned = np.empty(0, np.uint32)
            arrays = {"lanes": begin[:0], "i": unsigned, "j": unsigned, "gap": none, "normal": none, "made_of": none}
            arrays |= {"listed": state.position, "moved": np.zeros_like(state.position), "reach": none[0], "share": none[0]}
            kinds = dict.fromkeys(names, 0)
        else:
            arrays = {"lanes": wide.lanes, "i": wide.lane_i, "j": wide.lane_j, "gap": wide.gap, "normal": wide.normal}
            arrays |= {"listed": wide.origin, "moved": wide.moved, "reach": wide.reach, "share": wide.share}
            arrays["made_of"] = wide.made_of
            kinds = {name: getattr(wide, f"_{name}") for name in names}
        self._engine.set_pairs(begin=begin, **arrays, **kinds, **self._lanes)
        if fresh:
            self._engine.give_impulses(self._particle, *self._kept)
            self._listed = begin

    def _follow(self, state: Slots) -> None:
        """Have what is remembered of particles in the order of the slots of now."""
        if self._particle is state.particle:
            return
        count = max(int(state.particle.max(initial=-1)), int(self._particle.max(initial=-1))) + 1
        if self._listed is not None:  # particles have been added: the list is made anew
            self._harvest()
        wall, given = np.zeros((8, count), self._dtype), np.zeros((count, 3), self._dtype)
        wall[:, self._particle], given[self._particle] = self._wall, self._now_given()
        self._particle = state.particle
        self._wall, self._given = np.ascontiguousarray(wall[:, state.particle]), given[state.particle]
        self._gave, self._gave_spin = np.ascontiguousarray(self._given[:, :2]), np.ascontiguousarray(self._given[:, 2])
        self._motion, self._free = np.zeros((len(state), 4), self._dtype), np.zeros((len(state), 2), self._dtype)
        self._free_spin, self._at_wall = np.zeros(len(state), self._dtype), np.zeros(len(state), np.int32)
        self._held, self._synced = None, False

    def _now_given(self) -> Array:
        """`_given`, or what has become of it within a frame."""
        if self._held is not None:
            self._given[:, :2], self._given[:, 2] = self._gave, self._gave_spin
        return self._given

    def _harvest(self) -> None:
        """The list of pairs is about to be made anew: keep what its contacts remember."""
        if self._listed is not None:
            self._kept = self._engine.take_impulses(self._particle)
            self._listed = None
