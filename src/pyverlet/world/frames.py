"""Runs a frame under the contact law: prepares what the compiled core needs and keeps the contact state between frames.

The law, its sources and its measurements: docs/design/contact-law.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.constants import REST_ACCELERATIONS
from pyverlet.common.errors import NonFiniteError
from pyverlet.laws.forces import Substep
from pyverlet.laws.gains import gained_much, less_to_part, most_gained, undriven
from pyverlet.laws.integrators import advance, solve_velocity
from pyverlet.laws.ledger import FrameLedger
from pyverlet.laws.limiter import EnergyLimiter
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.world.contact_memory import Memory
from pyverlet.world.core_arrays import CoreArrays
from pyverlet.world.core_events import recorded_events, rows_of_sleepers, sensed_by
from pyverlet.world.core_links import CoreLinks
from pyverlet.world.frame_plan import FramePlan
from pyverlet.world.free_steps import FreeSteps, OwnWalls, keep_way
from pyverlet.world.stiffness import STIFFEST, STIFFNESS, follow, moves
from pyverlet.world.time_step_check import TimeStepCheck

DAMPING = 15.0
"""Damping ratio of the springs."""

PUSH_OUT, PUSH_OUT_FALLS = 8.0, 4.0
"""Fastest separation of overlaps: so many mean radii per second, or so many times the speed that gravity gives in a substep,
whichever is more. With less, contacts of small circles carry few layers."""

RELAXING_SWEEPS = 2


class Frames:
    """Applies the contact law to one world."""

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self._dtype = dtype
        self.held = CoreArrays(dtype)
        self._flight = FreeSteps()
        self.links = CoreLinks()
        self._time_step_check = TimeStepCheck()
        self._law: Any = None  # the last arguments of `engine.set_law`
        self.repeats = False  # whether the next frame would pass the engine the same arguments
        self._pull: tuple[Any, float] = None, 0.0  # gravity and its magnitude, m/s^2
        self.save, self.renumber = self.held.save, self.held.renumber

    def forget(self) -> None:
        """Discard all contact state."""
        self.links.forget()
        self.held.forget()

    def restore(self, memory: Memory, obstacles: ObstacleArrays) -> None:
        """Set the state that `save` returned, with the current obstacles; links are restored separately."""
        self.links.forget()
        self.held.restore(memory, obstacles)

    # ---- a frame -------------------------------------------------------------------------------------------------------------

    def step(self, world: Any, dt: float, on_stage_end: Callable[[str], None]) -> None:
        """Advance the rows of a world by a frame of dt seconds; `World.step` then copies them back to the user's arrays.

        on_stage_end: called with the name of each stage; it may be the page of a ledger.

        Raises:
            NonFiniteError: a particle turned NaN or infinite.
        """
        world._clear_records()
        world._obstacle_arrays.begin()
        self.links.keep_apart(world, self.held.engine)
        if changed := world._gather():
            self.held.forget_list()
        if changed or world._state.let_go:
            self.held.h, world._state.let_go = 0.0, False
        before = self.held.note(world._sorted)
        with np.errstate(over="ignore", invalid="ignore"):  # infinite values are reported as NonFiniteError
            senses = world._events and world._events.senses(world._obstacle_arrays)
            if world._sleep and world._sleep.all_asleep(world._sorted) and not senses:
                on_stage_end("gather")  # nothing moves, and contacts keep the impulses of when the last one fell asleep
                on_stage_end("finish")
                return
            good = False
            try:
                good = self.run(world, dt, on_stage_end)
                if not good:
                    try:
                        self.refuse_non_finite(world, dt)
                    finally:
                        self.links.forget()
                        self.held.go_back(before)
            finally:
                if not good:
                    self.held.engine.record_contacts(False)

    def let_sleep(self, world: Any, dt: float, gravity: tuple[float, float]) -> bool:
        """At the end of a frame of dt seconds: put particles to sleep that may; returns whether there were any."""
        state, start = world._sorted, world._state.shown["position"]
        asleep = bool(world._sleep and world._sleep.end(state, start, self.listed(), dt, float(np.hypot(*gravity))))
        if asleep:
            self.held.set_aside(state)
        return asleep

    def run(self, world: Any, dt: float, on_stage_end: Callable[[str], None]) -> bool:
        """Advance the gathered rows by a frame of dt seconds. False if a particle turned NaN or infinite."""
        self.held.engine.record_contacts(False)  # the last frame's contacts are no longer needed
        self.held.load(world, dt)
        world._sorted.thread_team = self.held.engine.thread_team, self.held.parts  # it was replaced if there are more threads now
        frame = FramePlan(world, self.held, dt, on_stage_end)
        self._open(world, frame)
        on_stage_end("gather")
        self._attend(world, frame)
        finite = self.substeps(world, frame)
        return self.close(world, frame, finite=finite)

    def _open(self, world: Any, frame: FramePlan) -> None:
        """Prepare the first substep: springs, links and start velocities."""
        state, dt = world._sorted, frame.dt
        state.h, state.own_walls = frame.h, frame.own_walls is not None
        self._time_step_check.look(world, frame.h)

        def moving() -> bool:
            return moves(state, self._typical(world, uninterrupted=frame.uninterrupted), self.held.mean_radius)

        follow(self.held, dt / (frame.substeps // frame.pieces), dt, frame.pieces, moving)
        self.links.load(world, self.held.engine, frame.substeps)
        if frame.keeps_way:
            keep_way(state, frame.before, frame.h)
        if getattr(world.integrator, "naive_start", False):
            self._naive_start(world, (1.0 - frame.half) * frame.h)

    def _attend(self, world: Any, frame: FramePlan) -> None:
        """Start recording what the ledger, contacts, events and sleep need from this frame."""
        engine = self.held.engine
        if frame.ledger:  # in a loaded world the core does not know yet whether contacts have friction
            self._set_law(world, self._typical(world, uninterrupted=frame.uninterrupted), frame.h, frame.h)
            frame.ledger.begin(engine, frame.half * frame.before / self.held.kick if self.held.kick else 0.0)
        engine.record_contacts(world._contact_records is not None)
        if world._contact_records is not None and world._contact_records.dt == np.inf:
            world._contact_records.prepare(world._state.shown["number"])
        if world._events is not None:
            engine.record_events(world._state.shown["number"])
        if world._sleep:
            self._watch(world, frame.h, uninterrupted=frame.uninterrupted)

    def substeps(self, world: Any, frame: FramePlan, reached: int | None = None) -> bool:
        """Run all substeps, as many per call as possible. Returns False if a particle turned NaN or infinite.

        reached: so many are done, and then an awake particle touches a sleeper.
        """
        state, forces, engine, held = world._sorted, world._force_sum, self.held.engine, self.held
        h, half, by_core, uninterrupted, ledger = frame.h, frame.half, frame.by_core, frame.uninterrupted, frame.ledger
        step, finite, before, self.repeats = reached or 0, True, frame.before, False
        met = reached is not None or not uninterrupted
        while step < frame.substeps:
            opens, known = step == 0 or not by_core, held.kick > 0.0  # opens: velocities belong to the positions
            if met and world._sleep and world._sleep.anyone:
                self._wake_met(world, step, h, uninterrupted=uninterrupted)
            kick = half * (h + before) if half and opens else h
            opening = 0.0 if not by_core else half * h if half and opens else h
            if not by_core:
                self._flight.take(world.integrator, state, forces, world.time + step * h, h)
            elif not uninterrupted:
                self._evaluate(world, step * h, half * h if step else 0.0)
                if opening != h:
                    # Same rounding as methods that store u: back by half a substep, on by a whole one: x' = 2 x - x_prev + a h^2.
                    advance(state.velocity, state.velocity, state.acceleration, opening - h)
                    opening = h
            frame.on_stage_end("integrate")
            # A first substep with a kick of its own, or an observer between substeps, needs a call for each.
            stop = step + 1 if not uninterrupted or world.observer or kick != h else frame.substeps
            last = stop == frame.substeps
            self._set_law(world, self._typical(world, uninterrupted=uninterrupted), h, kick)
            engine.set_frame(
                opening,
                half * before / held.kick if opens and known else 0.0,
                kick / held.kick if known else 1.0,
                half * h if last else 0.0,
                1.0 / (kick if stop == step + 1 else h) if last else 0.0,
                uninterrupted,
                *world.gravity,
                h / kick,
                None if uninterrupted else state.strength,
            )
            reached, finite = engine.run(step, stop, held.parts)
            met = not uninterrupted or reached < stop
            if reached == step:
                continue
            self.repeats = uninterrupted and known and kick == before == h == held.kick and reached - step == frame.substeps
            held.kick, before, step = kick if reached == step + 1 else h, h, reached
            frame.on_stage_end("contacts")
            lag = half * h if by_core else 0.0
            if not by_core:
                self._flight.end(state, held.gave, held.gave_spin, h / held.kick)
            if frame.own_walls:
                frame.own_walls.confine(state, ledger, h, lag, forces.typical)
            if ledger:
                ledger.moved(lag, held.gave, held.kick)
            if forces.forces and self._end_substep(world, step - 1, h, lag, ledger) and ledger:
                ledger.moved(lag, held.gave, held.kick, leaps=True)
            world._show(step * h, lag) if world.observer and step < frame.substeps else None
        return bool(finite)

    def close(self, world: Any, frame: FramePlan, *, finite: bool) -> bool:
        """Bring velocities to the time of the positions and report to listeners. False if a particle turned NaN or infinite."""
        state, engine, held, h, half, dt = world._sorted, self.held.engine, self.held, frame.h, frame.half, frame.dt
        forces = world._force_sum
        held.h, held.steps, held.typical, held.strongest = h, frame.substeps, forces.typical, forces.strongest
        self.repeats &= frame.pieces == 1 and held.hertz == STIFFNESS / h and not held.finer
        if not frame.uninterrupted:
            self._end(world, dt, half * h if frame.by_core else 0.0, frame.own_walls, frame.ledger)
        engine.show_links(half * h, held.kick)
        if (not finite or not frame.uninterrupted) and state.first_non_finite() >= 0:
            return False
        if frame.ledger:
            frame.ledger.end(half * h / held.kick)
        if frame.limited and frame.gravity == world.gravity:
            self.limit(world, frame.limiter, dt, may_limit=frame.may_limit)
        if world._contact_records is not None:
            world._contact_records.dt = dt
            if world._sleep:  # the core does not know the contacts of particles that fall asleep now
                world._take_contacts(rows_of_sleepers(held.asleep, world._state.shown["mass"].astype(float), dt))
        if world._events is not None:
            world._events.record(recorded_events(engine, world._obstacle_arrays))
            world._events.sense(world._obstacle_arrays, *sensed_by(engine, world))
            engine.record_events(None)
        if self.let_sleep(world, dt, frame.gravity):
            self.repeats = False  # the core watches for sleepers from the next frame on
        frame.on_stage_end("finish")
        if state.periodic:
            engine.wrap_positions(state.crossed)
        return True

    @staticmethod
    def _end_substep(world: Any, step: int, h: float, lag: float, ledger: FrameLedger | None) -> float:
        """Call forces that act once per substep, such as heat baths; returns the energy that they have added, J."""
        given = 0.0
        for force in world.forces[:]:
            if act := getattr(force, "end_substep", None):
                at = Substep(world._state.births, world.frames, step, h, lag)
                given += (joules := act(world._sorted, at))
                if ledger:
                    ledger.gained(getattr(force, "account", "forces"), joules)
        return given

    def _watch(self, world: Any, h: float, *, uninterrupted: bool) -> None:
        """Have the core look for contacts with sleepers in substeps of h seconds."""
        strongest = self._strongest(world.gravity) if uninterrupted else world._force_sum.strongest
        nearer = REST_ACCELERATIONS * strongest * h * h
        self.held.engine.watch(world._sorted.island if world._sleep.anyone else None, nearer)

    def _wake_met(self, world: Any, step: int, h: float, *, uninterrupted: bool) -> None:
        """Wake islands that are touched in the coming substep, and those that they may then be thrown at."""
        state, typical = world._sorted, self._typical(world, uninterrupted=uninterrupted)
        self._watch(world, h, uninterrupted=uninterrupted)
        self._set_law(world, typical, h, h)
        while (met := self.held.engine.find_met(step, self.held.parts)) is not None:
            if world._events:
                world._events.wake(state, world._state)
            world._sleep.wake(state, met)
            self.held.wake(world)
            self.held.hertz = min(self.held.hertz, STIFFEST / h)
            self._set_law(world, typical, h, h)

    def _typical(self, world: Any, *, uninterrupted: bool) -> float:
        """The mean acceleration of free particles, m/s^2; uninterrupted: by gravity alone."""
        return self._strongest(world.gravity) if uninterrupted else float(world._force_sum.typical)

    def _strongest(self, gravity: tuple[float, float]) -> float:
        """The largest acceleration by gravity alone, m/s^2."""
        if gravity is not self._pull[0]:
            x, y = map(self._dtype.type, gravity)
            self._pull = gravity, float(np.sqrt(x * x + y * y))
        return self._pull[1] if self.held.free else 0.0

    def limit(self, world: Any, limiter: Any, dt: float, *, may_limit: bool = True) -> None:
        """Remove the energy that a frame of dt seconds has gained, if it is too much."""
        if limiter is None and may_limit and gained_much(world) and undriven(world):
            limiter = EnergyLimiter(world, dt)
        if limiter is not None:
            limiter.limit(world._sorted, self.listed)
        if self.held.parting:
            self.held.parting = less_to_part(self.held.parting, dt, most_gained(world))

    def refuse_non_finite(self, world: Any, dt: float) -> None:
        """Repeat a failed frame from the last good state and check each stage; normal frames pay nothing for this."""
        state = world._sorted
        last = state.first_non_finite()

        def look(stage: str) -> None:
            bad = ~np.isfinite(state.acceleration).all(axis=1) if stage == "integrate" and world.forces else np.zeros(1, bool)
            if (particle := int(state.particle[bad.argmax()]) if bad.any() else state.first_non_finite()) >= 0:
                raise NonFiniteError(particle, stage, world.time)

        self.forget()
        world._gather()
        self.run(world, dt, look)
        raise NonFiniteError(last, "contacts", world.time)

    def _naive_start(self, world: Any, missing: float) -> None:
        """Kick new particles by what x_prev = x - v h leaves out, since their first kick is taken to be a whole one."""
        state = world._sorted
        fresh = np.isnan(state.acceleration[:, 0])
        if fresh.any():
            self._evaluate(world, 0.0, 0.0)
            state.velocity[fresh] += state.real(missing) * state.acceleration[fresh]

    def _evaluate(self, world: Any, since: float, ahead: float) -> None:
        """Evaluate gravity and forces. Forces see velocities at the time of the positions, not half a substep earlier.

        These velocities depend on the accelerations: for user-defined forces they are solved for.
        """
        state, forces = world._sorted, world._force_sum
        if not (ahead and forces.velocity_dependent):
            forces(state, world.time + since)
            return
        velocity, state.velocity = state.velocity, state.scratch(0)
        try:
            given = self.held.gave, ahead / self.held.kick
            state.motion.advance_by_two(state.velocity, velocity, state.acceleration, ahead, *given)
            if forces.functions:
                advance(base := state.scratch(1), velocity, *given)
                solve_velocity(state, forces, world.time + since, base, ahead)
            else:
                forces(state, world.time + since)
        finally:
            state.velocity = velocity

    def _end(self, world: Any, dt: float, half: float, own_walls: OwnWalls | None, ledger: FrameLedger | None) -> None:
        """Bring velocities to the time of the positions; accelerations then include those by contacts."""
        state = world._sorted
        if half:
            self._evaluate(world, dt, half)
            velocity, given = state.velocity, (self.held.gave, half / self.held.kick)
            state.motion.advance_by_two(velocity, velocity, state.acceleration, half, *given)
            state.spin += self.held.gave_spin * state.real(half / self.held.kick)
            if own_walls:
                own_walls.go_on(state, ledger, half / self.held.kick)
        advance(state.acceleration, state.acceleration, self.held.gave, 1.0 / self.held.kick)

    def _set_law(self, world: Any, strongest: float, h: float, kick: float) -> None:
        held, falls = self.held, self._strongest(world.gravity)
        law = strongest, h, kick, falls, held.hertz, held.mean_radius, held.rough
        if law == self._law:
            return
        self._law = law
        omega = 2.0 * np.pi * held.hertz
        damped = 2.0 * DAMPING + h * omega
        hard = h * omega * damped
        held.engine.set_law(
            h,
            omega / damped,
            hard / (1.0 + hard),
            # As in a substep whose kick has its own length, so that the depth at which a contact carries its load stays the same.
            h / kick / (1.0 + hard),
            max(PUSH_OUT * held.mean_radius, PUSH_OUT_FALLS * h * falls),
            2.0 * REST_ACCELERATIONS * strongest * h * h,
            REST_ACCELERATIONS * strongest * h,
            REST_ACCELERATIONS * h,
            strongest == 0.0,
            RELAXING_SWEEPS,
            held.rough,
            STIFFNESS / held.hertz,
        )

    # ---- what others ask of it -----------------------------------------------------------------------------------------------

    @property
    def gravity(self) -> tuple[float, float]:
        """Gravity in the last substeps, m/s^2."""
        gravity: tuple[float, float] = self._pull[0]
        return gravity

    @property
    def rebuilds(self) -> int:
        """How often the pair list has been built."""
        return int(self.held.engine.rebuilds())

    def listed(self) -> tuple[Array, Array, Array, Array]:
        """first, count, i, j: the ranges of the pair list, by row. Some pairs occur twice."""
        pairs: tuple[Array, Array, Array, Array] = self.held.engine.pairs()
        return pairs
