"""The world: particles, forces, integrator, bounds and collisions, advanced frame by frame by `World.step`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from pyverlet.common import checks
from pyverlet.common.constants import ALL_THREADS_FROM, MOST_SUBSTEPS, ONE_THREAD_BELOW, STANDARD_GRAVITY
from pyverlet.common.errors import InputError, PyverletError
from pyverlet.common.renamed import Renamed
from pyverlet.common.step_lock import exclusive
from pyverlet.common.threads import max_threads
from pyverlet.laws.boundaries import Boundary, Open
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.contact_records import ContactRecords
from pyverlet.laws.events import Events, Place
from pyverlet.laws.forces import ForceList, ForceSum
from pyverlet.laws.integrators import Integrator, TimeCorrectedVerlet
from pyverlet.laws.ledger import EnergyLedger, FrameLedger
from pyverlet.laws.links import Links
from pyverlet.laws.obstacles import ObstacleArrays, Obstacles
from pyverlet.laws.precision import Precision
from pyverlet.laws.sleep import Sleep, laws
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State
from pyverlet.world.actors import Actors, act_after, act_once, have_own
from pyverlet.world.casts import Casts
from pyverlet.world.contact_rules import ContactRule
from pyverlet.world.convenience import ConvenienceMethods
from pyverlet.world.frames import Frames
from pyverlet.world.measures import Measures
from pyverlet.world.plain import follow, plain_frames
from pyverlet.world.profile import Profile
from pyverlet.world.saved import Saved
from pyverlet.world.substep_snapshot import SubstepSnapshot
from pyverlet.world.team import Team

LONGEST_PAUSE = 15
"""Most frames to wait before trying plain frames again."""

_DEFAULT_COLLISIONS = Collisions()  # for unspecified arguments, since None means no collisions


class World(Measures, Casts, ConvenienceMethods):
    """Particles in a room, and the laws they follow. SI units, y up.

    Args:
        gravity: (x, y), m/s^2.
        integrator: how positions and velocities advance over a substep; TimeCorrectedVerlet if None.
        boundary: Circle, Box, Periodic or Open.
        collisions: how particles collide; None lets them pass through each other.
        substeps: steps of length h = dt / substeps in one call of `step`.
        dtype: float32 or float64, of all arrays. In float32 heaps stay at rest up to 0.03 h sqrt(g r) / 1.2e-7 m from the
            origin, 700 m for radii of 0.2 m and 480 substeps a second. Contacts are correct up to 0.02 r / 1.2e-7, and steady
            motion at v is correct to 5 % up to v h / 1e-6. Beyond any of them a CoarseCoordinatesWarning is issued once.
        events: record in `events` which contacts begin and end in each frame, and the impacts.
        contacts: record all contacts, their points and impulses, in `contacts`, and for `force_on` and `pressure`.
        sleep: let circles at rest sleep until touched, at little cost; not with links, moving obstacles or forces except drag.
        ledger: keep energy accounts, in `ledger`.
        threads: most threads of the parallel stages; fewer are used if more do not measurably help. Results are the same.

    Attributes:
        forces: list of forces besides gravity; append and remove as you like.
        links: list of the links between particles.
        obstacles: list of the obstacles.
        actors: list of actors, such as emitters, that act before each frame; they may add and remove actors.
        time, frames: simulated seconds, and calls of `step`, since the world was built.
        profile: the time of the last frame: `frame_ms`, and `stages`, ms by name.

    Raises:
        InputError: an argument is outside what is allowed.
    """

    onlooker: Any = Renamed("observer")
    _plain: Any = None  # runs plain frames while they last
    _extent: Any = None  # extent of the room for which circles have been checked
    _vain = _pause = 0  # consecutive plain frames objects that made no frame; frames to wait

    def __init__(
        self,
        *,
        gravity: Sequence[float] = STANDARD_GRAVITY,
        integrator: Integrator | None = None,
        boundary: Boundary | None = None,
        collisions: Collisions | None = _DEFAULT_COLLISIONS,
        substeps: int = 8,
        dtype: DTypeLike = np.float32,
        threads: int | None = None,
        ledger: bool = False,
        events: bool = False,
        contacts: bool = False,
        sleep: bool = False,
    ) -> None:
        asked = {"ledger": ledger, "events": events, "contacts": contacts, "sleep": sleep}
        ledger, events, contacts, sleep = (checks.flag(name, value) for name, value in asked.items())
        self._state = State(checks.floating("dtype", dtype))
        self._sorted = SortedState(self._state.dtype, sleeps=sleep)
        self.links, self.forces, self.obstacles = Links(self._state), ForceList(), Obstacles()
        self._frames = Frames(self._state.dtype)
        self._events = Events() if events else None
        self._contact_records = ContactRecords(self._frames.held.engine) if contacts else None
        self._sleep, self._energy_ledger = Sleep() if sleep else None, EnergyLedger() if ledger else None
        self._force_sum = ForceSum(checks.vector("gravity", gravity), self.forces)
        self._obstacle_arrays = ObstacleArrays(self.obstacles)
        self.integrator = TimeCorrectedVerlet() if integrator is None else integrator
        self.boundary = Open() if boundary is None else boundary
        self.collisions, self.substeps, self.threads = collisions, substeps, threads
        self.time, self.frames, self.profile, self.actors = 0.0, 0, Profile(), Actors()
        self._team, self._precision = Team(), Precision()
        self._kept = None
        # Called between the substeps of a frame. It may read, and change gravity; other changes take effect in the next frame.
        self.observer: Callable[[SubstepSnapshot], None] | None = None

    # ---- one frame -----------------------------------------------------------------------------------------------------

    def step(self, dt: float) -> None:
        """Advance by one frame of dt seconds, in `substeps` steps of h = dt / substeps.

        Raises:
            InputError: dt is not a number greater than 0, or this is called in the middle of a frame of this world.
            NonFiniteError: a particle turned NaN or infinite; the world still holds the frame before.
        """
        plain = self._plain
        if plain is None or not (plain.step(self, dt) or (follow(self, dt) and plain.step(self, dt))):
            self._step(dt)
        if self._plain is None or self._plain.far:
            self._precision.look(self, dt / self.substeps)

    @exclusive
    def _step(self, dt: float) -> None:
        """Run a frame in which anything may have changed."""
        checks.number("dt", dt, above=0.0)
        if self._plain is not None:  # something has changed, and may do so in every frame
            self._vain = 0 if self._plain.used else self._vain + 1
            self._pause, self._plain = min((1 << self._vain) - 1, LONGEST_PAUSE), None
        if self.actors:
            act_once(self, dt)
        with self._state.lock.frame():
            self._team.gather(self.threads, 0.0 if self._sorted.taken else self.profile.frame_ms)
            self.profile.begin()
            ledger, memories = FrameLedger(self) if self._energy_ledger else None, self._memories()
            self._sorted.thread_team = self._frames.held.engine.thread_team, self._frames.held.parts
            try:
                try:
                    self._frames.step(self, dt, ledger or self.profile.mark)
                except PyverletError:
                    for force, memory in memories:
                        force.restore(memory)
                    raise
                self._accept(dt, ledger)
            finally:
                self._sorted.thread_team = (0, 1)
        if self._pause == 0:
            self._plain = plain_frames(self, dt)
        self._pause = max(self._pause - 1, 0)
        if self.actors:
            act_after(self, dt)

    def _accept(self, dt: float, ledger: Any) -> None:
        """Commit a successful frame: copy its results to the user's arrays."""
        self._sorted.scatter(self._state, dt, self._frames.held.still())
        if ledger:
            ledger.close(-self._sorted.taken)
        self._obstacle_arrays.end(dt)
        self._frames.links.end(self.links)
        if self._events:
            self._events.close(self._sorted, self._state, Place(self.boundary, self._obstacle_arrays, bool(self.collisions)))
        self.profile.mark("scatter")
        self.time, self.frames = self.time + dt, self.frames + 1
        self.profile.divide("contacts", self._frames.held.engine.spans())
        self.profile.end()

    def _gather(self) -> bool:
        """Read the user's changes; returns whether the pair list is invalid."""
        self.forces.check(self._state)
        woken = self._sleep.begin(self._sorted, self._state, laws(self)) if self._sleep else False
        changed = self._sorted.gather(self._state) or woken
        extent = self.boundary.extent()  # sides of the room may be set while circles are in it
        if self._sorted.unchecked or extent != self._extent:
            try:
                self._sorted.check()
                self.boundary.check(self._state.shown["radius"])
            except InputError:
                # The next frame then checks the same values again.
                self._sorted = SortedState(self.dtype, sleeps=self._sleep is not None)
                raise
            self._sorted.unchecked, self._extent = False, extent
        return changed

    def _memories(self) -> list[tuple[Any, Any]]:
        """Forces with state, and their state."""
        return [(force, force.save()) for force in self.forces[:] if hasattr(force, "save")]

    def _show(self, since: float, lag: float) -> None:
        """Call the observer at `since` s after the start of the frame, with velocities `lag` s old."""
        assert self.observer
        self.observer(SubstepSnapshot(self._sorted, self.time + since, lag))
        self.profile.mark("pictures")

    def _clear_records(self) -> None:
        """Clear the records of walls and contacts for a new frame."""
        self._sorted.clear_records()
        if self._events:
            self._events.forget()

    # ---- laws ----------------------------------------------------------------------------------------------------------

    @property
    def dtype(self) -> np.dtype[Any]:
        """The type of all arrays, float32 or float64."""
        return self._state.dtype

    @property
    def gravity(self) -> tuple[float, float]:
        """Acceleration by gravity (x, y), m/s^2."""
        return self._force_sum.gravity

    @gravity.setter
    def gravity(self, value: Sequence[float]) -> None:
        self._force_sum.turn(checks.vector("gravity", value), self._state)

    @property
    def substeps(self) -> int:
        """Steps of length h = dt / substeps in a frame."""
        return self._substeps

    @substeps.setter
    @exclusive
    def substeps(self, value: int) -> None:
        self._plain = None
        self._substeps = checks.integer("substeps", value, most=MOST_SUBSTEPS, most_is=" (finer steps take a smaller dt)")

    @property
    def integrator(self) -> Integrator:
        """How positions and velocities advance over a substep; setting it restarts the motion from positions and velocities."""
        return self._integrator

    @integrator.setter
    @exclusive
    def integrator(self, value: Integrator) -> None:
        if not isinstance(value, Integrator):
            raise InputError(f"integrator is {value!r}; allowed is an object such as pyverlet.PositionVerlet()")
        self._integrator, self._plain = value, None
        self._state.acceleration[:] = np.nan

    @property
    def boundary(self) -> Boundary:
        """The room: Circle, Box, Periodic, Open or a user-defined boundary."""
        return self._boundary

    @boundary.setter
    @exclusive
    def boundary(self, value: Boundary) -> None:
        if not isinstance(value, Boundary):
            raise InputError(f"boundary is {value!r}; allowed is an object such as pyverlet.Circle(radius=10) or pyverlet.Open()")
        value.check(self._state.radius)
        self.links.check(value.periodic)
        self._boundary, self._state.periodic, self._obstacle_arrays.periodic, self._plain = (
            value,
            value.periodic,
            value.periodic,
            None,
        )
        self._state.boundary, self._state.let_go = value, True

    @property
    def collisions(self) -> Collisions | None:
        """How particles collide; None lets them pass through each other."""
        return self._collisions

    @collisions.setter
    @exclusive
    def collisions(self, value: Collisions | None) -> None:
        if value is not None and not isinstance(value, Collisions):
            raise InputError(f"collisions is {value!r}; allowed are pyverlet.Collisions(...) and None")
        self._collisions, self._plain = value, None

    @property
    def _rules(self) -> list[ContactRule]:
        """The active contact rules."""
        return [actor for actor in self.actors if isinstance(actor, ContactRule)]

    @property
    def threads(self) -> int:
        """Most threads of the parallel stages; fewer are used if more do not help. Results are the same for any number."""
        if self._threads is None:
            return max_threads() if len(self) >= ALL_THREADS_FROM else 1
        return self._threads if len(self) >= ONE_THREAD_BELOW else 1

    @threads.setter
    def threads(self, value: int | None) -> None:
        self._threads = (
            None if value is None else checks.integer("threads", value, most=max_threads(), most_is=" (the cores here)")
        )

    # ---- save and restore ----------------------------------------------------------------------------------------------

    @exclusive
    def save(self) -> Saved:
        """A copy of everything that moves; `restore` continues from it with the same bits."""
        have_own(self)
        if self._state.let_go:
            self._frames.held.h = 0.0
        return Saved(
            world=self._state,
            arrays={name: array.copy() for name, array in self._state.arrays()},
            time=self.time,
            frames=self.frames,
            next_birth=self._state.next_birth,
            sorted_state=self._sorted.save(self._state),
            impulses=self._frames.save(self._obstacle_arrays),
            energy_ledger=self._energy_ledger and self._energy_ledger.copy(),
            events=self._events and self._events.copy(),
            sleep=self._sleep and self._sleep.copy(laws(self)),
            obstacles=self.obstacles.save(),
            actors=[(actor, actor.save()) for actor in self.actors],
            links=self.links.save(),
            forces=self._memories(),
            data={name: column.copy() for name, column in self._state.data.items()},
        )

    @exclusive
    def restore(self, saved: Saved) -> None:
        """Go back to what `save` returned. Groups added since then become invalid; removed particles are alive again.

        Raises:
            InputError: it belongs to another world.
        """
        if not isinstance(saved, Saved):
            raise InputError(f"saved is {saved!r}; allowed is what save() has returned")
        saved, self._plain = saved.of(self), None
        self._take_contacts()
        numbers = self._state.number.copy()
        self._state.restore(saved.arrays, saved.data)
        self._state.rewind(saved.next_birth)
        if not np.array_equal(numbers, self._state.number):
            self._renumber(self._state.index_of(numbers))
        self.links.restore(saved.links)
        self.obstacles.restore(saved.obstacles)
        for force, memory in saved.forces:
            force.restore(memory)
        self.actors[:] = [actor for actor, _ in saved.actors]
        for actor, memory in saved.actors:
            actor.restore(memory)
        self.time, self.frames = saved.time, saved.frames
        self._sorted.restore(saved.sorted_state, self._state)
        self._energy_ledger = saved.energy_ledger and saved.energy_ledger.copy()
        if self._sleep and saved.sleep:
            self._sleep.take(saved.sleep, laws(self))
        if self._events and saved.events:
            self._events.take(saved.events)
        self._frames.restore(saved.impulses, self._obstacle_arrays)
        self._state.let_go = False
