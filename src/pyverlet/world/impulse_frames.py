"""Frames under the law of impulses (`Collisions(impulses=True)`): what the compiled core is given, and what it remembers.

The law, its sources and its measurements: docs/design/impulses.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet import core
from pyverlet.ground.constants import REST_ACCELERATIONS, SKIN, SURPLUS
from pyverlet.ground.errors import InputError, NonFiniteError
from pyverlet.laws.contacts.broadphase import Fast
from pyverlet.laws.contacts.growth import Growth
from pyverlet.laws.limiter import fall, watched
from pyverlet.laws.rooms import Open
from pyverlet.state.moves import first_non_finite
from pyverlet.state.slots import Slots
from pyverlet.world.free_steps import FreeSteps, kicks
from pyverlet.world.impulse_materials import ROOMS, materials_of, walls_of
from pyverlet.world.impulse_memory import Memory, columns_of
from pyverlet.world.impulse_notes import ImpulseNotes

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

SORTED_FROM = 1024
UNSORTED = 0.2
"""Slots of so many particles and more are put into the order of the cells when such a part of them is followed by one that
belongs before."""

NEAR = 0.05
"""Of the largest radius: pairs and walls with larger gaps carry no load."""


class ImpulseFrames:
    """The law of impulses in one world."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self._core = core.unit("engine", dtype)
        self._engine: Any = self._core.Engine(1)
        self._parts, self._flight = 1, FreeSteps()
        self._checked: Any = None  # what the world was made of when it was last found to be known
        self._law: Any = None  # numbers that the engine holds
        self._pull: tuple[Any, float] = None, 0.0  # gravity, and how strong it is, m/s^2
        self._room: Any = None
        self.growth = Growth()
        self.forget()

    def forget(self) -> None:
        """No contact remembers anything."""
        self.restore(Memory.empty(self._dtype))

    def save(self) -> Memory:
        """What `restore` needs to go on with the same bits."""
        particle, count = self._particle, int(self._particle.max(initial=-1)) + 1
        wall, given = np.zeros((8, count), self._dtype), np.zeros((count, 3), self._dtype)
        wall[:, particle], given[particle, :2], given[particle, 2] = self._wall, self._gave, self._gave_spin
        pairs, values = (array.copy() for array in self._impulses())
        kept = self._kept_list or (self._engine.save_list() if self._kick else None)
        if kept is None:
            none = np.empty((0, 2), self._dtype)
            return Memory(pairs, values, wall, given, self._kick, self._h, self._hertz, self._finer, none, none)
        listed, checked = (np.zeros((count if len(rows) else 0, 2), self._dtype) for rows in kept[:2])
        if len(listed):
            listed[particle], checked[particle] = kept[:2]
        skin = kept[2]
        return Memory(pairs, values, wall, given, self._kick, self._h, self._hertz, self._finer, listed, checked, skin)

    def restore(self, memory: Memory) -> None:
        """Back to what `save` returned."""
        self._kept: tuple[Array, Array] | None = (memory.pairs, memory.values)  # what the engine is still to be given
        self._kept_list: Any = (memory.listed, memory.checked, memory.skin) if memory.skin else None
        self._particle = np.arange(len(memory.given), dtype=np.int32)
        self._wall, self._gave, self._gave_spin = memory.wall, *columns_of(memory.given)
        self._kick, self._h, self._hertz, self._finer = memory.kick, memory.h, memory.hertz, memory.finer
        self._made = -1  # of `Slots.given`, what the engine holds; -1: nothing
        self._collisions: Any = None
        self._skin: float | None = -1.0

    def _impulses(self) -> tuple[Array, Array]:
        """Pairs and values of `Memory`."""
        return self._kept if self._kept is not None else self._engine.take_impulses(self._particle)

    def renumber(self, now: Array) -> None:
        """The particles are now at `now` (n,), or no more (-1)."""
        self.restore(self.save().renumbered(now))

    # ---- a frame -------------------------------------------------------------------------------------------------------------

    def step(self, world: Any, dt: float) -> None:
        """Advance the slots of a world by a frame of dt seconds: all of `World.step` but for what its arrays become.

        Raises:
            InputError: there is something in the world that this law does not know yet.
            NonFiniteError: a particle turned NaN or infinite.
        """
        if (known := (world.collisions, len(world.links), len(world.obstacles))) != self._checked:
            self.check(world)
            self._checked = known
        world._slots.rows = self._core
        world._slots.clear_notes()
        if world._gather():
            self._engine.forget_list()
        self.run(world, dt, world.profile.mark)

    def check(self, world: Any) -> None:
        """Refuse what this law does not know yet.

        Raises:
            InputError: there is such a thing in the world.
        """
        unknown = {
            "links": bool(world.links),
            "obstacles": bool(world.obstacles),
            "a ledger": world.keeps_ledger,
            "events": world.tells_events,
            "sleep=True": world._sleep is not None,
            "brute force": not isinstance(world.collisions.method, Fast),
        }
        if found := [name for name, there in unknown.items() if there]:
            raise InputError(f"impulses is True in a world with {found[0]}; allowed are circles in a room, with forces")

    def run(self, world: Any, dt: float, done: Callable[[str], None]) -> None:
        """Advance the gathered slots by a frame of dt seconds.

        Raises:
            NonFiniteError: a particle turned NaN or infinite.
        """
        state, forces, engine, collisions = world._slots, world._force_sum, self._engine, world.collisions
        contained = len(world) > 1 or not isinstance(world.boundary, Open)
        substeps = world.substeps
        if contained and dt > LONGEST_FRAME:
            substeps *= int(np.ceil(dt / LONGEST_FRAME * (1 - 1e-9)))
        by_core = kicks(world.integrator)
        h, half = dt / substeps, world.integrator.velocity_lag if by_core else 0.5
        before = self._h if self._kick else 0.0
        self._stiffen(h, dt)
        own_walls = None if isinstance(world.boundary, ROOMS) else world.boundary.confine
        alone = by_core and not (forces.forces or own_walls or world.onlooker)
        watch = watched(world, dt / world.substeps, None) if contained and (forces.forces or world.links) else None
        gravity = world.gravity
        state.h = h
        self._load(world)
        if getattr(world.integrator, "naive_start", False):
            self._start_naively(world, (1.0 - half) * h)
        rough = max(collisions.friction, state.most_friction, getattr(world.boundary, "friction", 0.0)) > 0.0
        done("gather")
        notes = None if world._touches is None else ImpulseNotes(world._touches, engine, state)
        step, finite = 0, True
        while step < substeps:
            opens, known = step == 0 or not by_core, self._kick > 0.0  # opens: from velocities that belong to the positions
            kick = half * (h + before) if half and opens else h
            if not by_core:
                self._flight.take(world.integrator, state, forces, world.time + step * h, h)
            elif not alone:
                self._evaluate(world, step * h, half * h if step else 0.0)
            # The first substep may have a kick of its own; whoever looks or acts in each has a call for each.
            stop = step + 1 if not alone or notes or kick != h else substeps
            last_kick = kick if stop == step + 1 else h
            self._set_law(self._strongest(gravity) if alone else forces.strongest, h, kick, rough=rough)
            engine.set_frame(
                0.0 if not by_core else half * h if half and opens else h,
                half * before / self._kick if opens and known else 0.0,
                kick / self._kick if known else 1.0,
                half * h if stop == substeps else 0.0,
                1.0 / last_kick if stop == substeps else 0.0,
                alone,
                *gravity,
                h / kick,
            )
            finite = engine.run(step, stop, self._parts)
            if notes:
                notes.read(h / kick)
            self._kick, before, step = last_kick, h, stop
            done("contacts")
            if own_walls:
                own_walls(state, h, half * h if by_core else 0.0, 0.0)
            if not by_core:
                self._flight.end(state, self._gave, self._gave_spin, h / self._kick)
            world._show(step * h, half * h if by_core else 0.0) if step < substeps else None
        self._h = h
        if not alone:
            self._end(world, dt, half * h if by_core else 0.0)
        if not finite or not alone:
            self._refuse_non_finite(world)
        if contained and gravity == world.gravity:
            self._limit(world, watch, dt)
        if notes:
            notes.close(world, dt)
        if state.seam:
            engine.wrap_seam()
        done("finish")

    def _strongest(self, gravity: tuple[float, float]) -> float:
        """The largest acceleration by gravity alone, m/s^2."""
        if gravity is not self._pull[0]:
            x, y = map(self._dtype.type, gravity)
            self._pull = gravity, float(np.sqrt(x * x + y * y))
        return self._pull[1] if self._free else 0.0

    def _limit(self, world: Any, watch: Any, dt: float) -> None:
        """Take back what energy a frame of dt seconds has gained, if it is too much."""
        state = world._slots
        if watch is None and not world.forces and not world.links:
            start, (gx, gy) = world._state, world.gravity
            gained = self._core.energy_gained(
                (start.position, start.velocity, start.spin, start.radius, start.mass),
                (state.position, state.velocity, state.spin, state.radius, state.mass), gx, gy,
            )  # fmt: skip
            if gained > SURPLUS * fall(state.total_mass, world.gravity, world.boundary.extent()):
                watch = watched(world, dt / world.substeps, None)
        if watch is not None:
            watch.close(state, self)

    def _refuse_non_finite(self, world: Any) -> None:
        if (particle := first_non_finite(world._slots)) >= 0:
            self.forget()
            raise NonFiniteError(particle, "contacts", world.time)

    def _start_naively(self, world: Any, missing: float) -> None:
        """Kick those that are new by what x_prev = x - v h leaves out: it takes the first kick to be a whole one."""
        state = world._slots
        fresh = np.isnan(state.acceleration[:, 0])
        if fresh.any():
            self._evaluate(world, 0.0, 0.0)
            state.velocity[fresh] += state.real(missing) * state.acceleration[fresh]

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
        state, by_contacts = world._slots, self._gave / self._dtype.type(self._kick)
        if half:
            self._evaluate(world, dt, half)
            state.velocity += state.real(half) * (state.acceleration + by_contacts)
            state.spin += self._gave_spin * state.real(half / self._kick)
        state.acceleration += by_contacts

    def _stiffen(self, h: float, dt: float) -> None:
        best = STIFFNESS / h
        self._finer = self._finer + dt if best > self._hertz else 0.0
        if not self._hertz:
            self._hertz = best
        elif best < self._hertz:
            self._hertz = min(max(best, self._hertz * 2.0 ** (-SOFTENING * dt)), STIFFEST / h)
        elif self._finer > 0.5:
            self._hertz = min(best, self._hertz * 2.0 ** (STIFFENING * dt))

    def _set_law(self, strongest: float, h: float, kick: float, *, rough: bool) -> None:
        omega = 2.0 * np.pi * self._hertz
        damped = 2.0 * DAMPING + h * omega
        hard = h * omega * damped
        numbers = (
            h,
            omega / damped,
            hard / (1.0 + hard),
            # As in a substep whose kick is as long as itself: the depth at which a contact carries its load stays the same.
            h / kick / (1.0 + hard),
            PUSH_OUT,
            NEAR * self._largest + 2.0 * REST_ACCELERATIONS * strongest * h * h,
            REST_ACCELERATIONS * strongest * h,
            strongest == 0.0,
            RELAXING_SWEEPS,
            rough,
        )
        if numbers != self._law:
            self._engine.set_law(*numbers)
            self._law = numbers

    # ---- arrays --------------------------------------------------------------------------------------------------------------

    def _load(self, world: Any) -> None:
        """Have the engine see the particles of now, and what they are made of."""
        state, engine, collisions = world._slots, self._engine, world.collisions
        parts = world._team.now
        if engine.threads < parts:
            engine.set_threads(parts)
        self._parts = parts
        if self._particle is not state.particle or self._kept is not None:
            self._follow(state)
        if state.given != self._made or collisions is not self._collisions:
            self._hold(state)
            self._set_materials(world)
        if collisions.method.skin != self._skin:
            self._skin = collisions.method.skin
            if self._kept_list is None:
                engine.set_skin(SKIN if self._skin is None else self._skin, self._skin is None)
        engine.set_room(*walls_of(world.boundary))
        if world.boundary is not self._room:
            engine.set_seam(*state.seam)
            self._room = world.boundary
        if self._kept_list is not None:
            engine.set_skin(self._kept_list[2][0], self._skin is None)
            engine.restore_list(*self._kept_list)
            self._kept_list = None
        if len(state) >= SORTED_FROM:
            self._sort(state)
        if state.seam:
            engine.follow_seam()

    def _sort(self, state: Slots) -> None:
        """Put slots in the order of the cells if many are not; the list of pairs stays what it is."""
        falls, order = self._engine.order()
        if falls > UNSORTED * len(state):
            self._engine.renumber(order)
            self._wall, self._gave = np.ascontiguousarray(self._wall[:, order]), self._gave[order]
            self._gave_spin = self._gave_spin[order]
            state.reorder(order)
            self._particle = state.particle
            self._hold(state)

    def _follow(self, state: Slots) -> None:
        """Have what is remembered of particles in the order of the slots of now."""
        count = max(int(state.particle.max(initial=-1)), int(self._particle.max(initial=-1))) + 1
        pairs, values = self._impulses()
        wall, given = np.zeros((8, count), self._dtype), np.zeros((count, 3), self._dtype)
        wall[:, self._particle] = self._wall
        given[self._particle, :2], given[self._particle, 2] = self._gave, self._gave_spin
        if self._kept_list is not None:
            rows, same = self._kept_list[:2], len(self._kept_list[0]) == len(state)
            listed, checked = (np.ascontiguousarray(row[state.particle]) if same else row[:0] for row in rows)
            self._kept_list = listed, checked, self._kept_list[2]
        self._particle, place = state.particle, np.zeros(count, np.int32)
        place[state.particle] = np.arange(len(state), dtype=np.int32)
        self._wall, self._gave, self._gave_spin = (
            np.ascontiguousarray(wall[:, state.particle]),
            *columns_of(given[state.particle]),
        )
        self._hold(state)
        self._engine.give_impulses(place[pairs], values)
        self._kept = None

    def _hold(self, state: Slots) -> None:
        """Have the engine take the arrays of now."""
        count, real = len(state), self._dtype
        self._engine.set_particles(
            position=state.position, velocity=state.velocity, acceleration=state.acceleration,
            inverse_mass=state.inverse_mass, radius=state.radius, own_restitution=state.restitution,
            own_friction=state.friction, spin=state.spin, motion=np.zeros((count, 4), real), free=np.zeros((count, 2), real),
            free_spin=np.zeros(count, real), given=self._gave, given_spin=self._gave_spin, wall_impulse=self._wall[:4],
            wall_tangent=self._wall[4:], at_wall=np.zeros(count, np.int32),
            particle=state.particle, category=state.category, mask=state.mask,
        )  # fmt: skip

    def _set_materials(self, world: Any) -> None:
        """What circles are made of has changed."""
        state = world._slots
        self._made, self._collisions = state.given, world.collisions
        state.grown.fill(1)
        state.resize()
        self._free = bool((state.inverse_mass > 0).any())
        self._largest = float(state.radius.max(initial=0.0))
        self._engine.set_materials(**materials_of(state, world._state.radius, world.collisions))

    # ---- what others ask of it -----------------------------------------------------------------------------------------------

    @property
    def rebuilds(self) -> int:
        """How often the list of pairs has been made."""
        return int(self._engine.rebuilds())

    def listed(self) -> tuple[Array, Array, Array, Array]:
        """first, count, i, j: where the pairs of the list are, by slot. Some come twice."""
        pairs: tuple[Array, Array, Array, Array] = self._engine.pairs()
        return pairs
