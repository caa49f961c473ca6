"""The world: particles, forces, integrator, bounds and collisions, advanced frame by frame by `World.step`."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from pyverlet import _jit, checks
from pyverlet.actors import Actor
from pyverlet.bounds import Boundary, Open
from pyverlet.collisions import Collisions, ContactSolver, Overlap, measure_overlap
from pyverlet.constants import ALL_THREADS_FROM, ONE_THREAD_BELOW, REST_ACCELERATIONS, STANDARD_GRAVITY
from pyverlet.doors import Doors
from pyverlet.energy import Energy, energy
from pyverlet.errors import InputError, NonFiniteError
from pyverlet.forces import Force, ForceSum
from pyverlet.integrators import Integrator, PositionVerlet
from pyverlet.kernels import measure, motion
from pyverlet.obstacles import Course, Obstacles
from pyverlet.particles import Particles
from pyverlet.profile import Profile
from pyverlet.queries import Queries
from pyverlet.state import Group, Slots, State

Array = NDArray[Any]

# For scenes whose collisions argument is left alone: a fresh default each time, while None means no collisions.
_DEFAULT_COLLISIONS = Collisions()


@dataclass(frozen=True)
class Saved:
    """What `World.save` keeps: enough to continue with the same bits. Opaque."""

    world: State
    arrays: dict[str, Array]
    time: float
    frames: int
    h_last: float | None
    slots: tuple[Array, Array]
    neighbours: Any
    obstacles: Any
    actors: list[tuple[Actor, Any]]


class World(Particles, Queries, Doors):
    """Particles in a room, and the laws they follow. SI units, y up.

    Args:
        gravity: (x, y), m/s^2.
        integrator: how positions and velocities advance over a substep.
        boundary: Circle, Box or Open.
        collisions: how particles collide; None lets them pass through each other.
        substeps: steps of length h = dt / substeps in one call of `step`.
        dtype: float32 or float64, of all arrays.
        threads: at most this many for the parallel stages; None is as many as pay off. Never changes the result.

    Raises:
        InputError: an argument is outside what is allowed.
    """

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
    ) -> None:
        self._state = State(checks.floating("dtype", dtype))
        self._h_last: float | None = None  # substep of the frame before; None: the integrator starts anew
        self._slots = Slots(self._state.dtype)
        self.forces: list[Force] = []
        self._force_sum = ForceSum(checks.vector("gravity", gravity), self.forces)
        self.actors: list[Actor] = []
        self.obstacles = Obstacles()
        self._course = Course(self.obstacles)
        self.integrator = PositionVerlet() if integrator is None else integrator
        self.boundary = Open() if boundary is None else boundary
        self.collisions = collisions
        self.substeps = substeps
        self.threads = threads
        self.time = 0.0
        self.frames = 0
        self.profile = Profile()

    # ---- one frame -----------------------------------------------------------------------------------------------------

    def step(self, dt: float) -> None:
        """Advance by one frame of dt seconds, in `substeps` steps of h = dt / substeps.

        Raises:
            InputError: dt is not a number greater than 0.
            NonFiniteError: a particle turned NaN or infinite; the world still holds the frame before.
        """
        h = checks.number("dt", dt, above=0.0) / self.substeps
        for actor in self.actors:
            actor.act(self, dt)
        _jit.use_threads(self.threads)
        self.profile.begin()
        self._frame(h, self.profile.mark)
        if self._first_non_finite() >= 0:
            self._explain_non_finite(h)
        self._slots.scatter(self._state)
        self._course.end(dt)
        self.profile.mark("scatter")
        self.time += dt
        self.frames += 1
        self._h_last = h
        self.profile.end()

    def _frame(self, h: float, done: Callable[[str], None]) -> None:
        """The table of contents of the engine. `done` is told the name of each stage as it ends."""
        state, forces, integrator = self._slots, self._force_sum, self.integrator
        contacts, course = self._contacts if len(self) > 1 else None, self._course
        lag = integrator.velocity_lag * h
        self._gather()
        course.begin()
        done("gather")
        integrator.begin(state, forces, self.time, h, self._h_last)
        for substep in range(self.substeps):
            if contacts:
                contacts.before(state, h)
            if course:
                course.before(state)
            integrator.step(state, forces, self.time + substep * h, h)
            strongest = self._strongest_acceleration()
            done("integrate")
            if contacts:
                contacts.find(state)
                done("broad phase")
                contacts.project(state, h, lag, strongest)
                done("contacts")
            self.boundary.confine(state, h, lag, REST_ACCELERATIONS * strongest * h)
            done("bounds")
            if course:
                course.collide(state, substep * h, h, lag, REST_ACCELERATIONS * strongest * h)
                done("obstacles")
            if contacts:
                contacts.still(state, h)
                done("velocities")
        if contacts:
            contacts.mark_resting(state)
        integrator.end(state, h)
        done("integrate")

    def run(self, *, seconds: float, dt: float = 1 / 60) -> None:
        """Advance by as many frames of dt as come nearest to `seconds`."""
        seconds = checks.number("seconds", seconds, least=0.0)
        for _ in range(round(seconds / checks.number("dt", dt, above=0.0))):
            self.step(dt)

    def _gather(self) -> None:
        if not self._slots.gather(self._state):
            return
        try:
            checks.positive("radius", self._state.radius)
            checks.positive("mass", self._state.mass, infinite_is="pinned")
            self.boundary.check(self._state.radius)
        except InputError:
            self._slots = Slots(self.dtype)  # so that the next frame sees them as new, and refuses them again
            raise
        if self._contacts:
            self._contacts.broad_phase.forget()
            if len(self) > 1:
                self._contacts.fit(self._slots)

    def _strongest_acceleration(self) -> float:
        if not self.forces:
            return float(np.hypot(*self.gravity))
        return float(motion.largest_norm(self._slots.acceleration))

    def _first_non_finite(self) -> int:
        for array in (self._slots.position, self._slots.velocity):
            slot = int(motion.first_non_finite(array))
            if slot >= 0:
                return int(self._slots.particle[slot])
        return -1

    def _explain_non_finite(self, h: float) -> None:
        """Run the frame again from the last good state, looking after every stage: normal frames pay nothing for it."""

        def look(stage: str) -> None:
            particle = self._first_non_finite()
            if particle >= 0:
                raise NonFiniteError(particle, stage, self.time)

        if self._contacts:
            self._contacts.broad_phase.forget()
        self._frame(h, look)

    # ---- particles -----------------------------------------------------------------------------------------------------

    def add(
        self,
        *,
        position: ArrayLike,
        velocity: ArrayLike = 0.0,
        radius: ArrayLike = 0.5,
        mass: ArrayLike = 1.0,
        spin: ArrayLike = 0.0,
    ) -> Group:
        """Add particles.

        Args:
            position: (n, 2) or (2,), centres, m.
            velocity: (n, 2), (2,) or 0, m/s.
            radius: (n,) or one for all, m, greater than 0.
            mass: (n,) or one for all, kg, greater than 0; infinity pins the particle.
            spin: (n,) or one for all, rad/s, counter-clockwise.

        Returns:
            A handle whose arrays are views on these particles, in the order given.

        Raises:
            InputError: shapes disagree, a value is not finite, or a circle does not fit into the boundary; nothing is added.
        """
        dtype = self._state.dtype
        where = checks.rows("position", position, dtype)
        count = len(where)
        values = {
            "position": where,
            "velocity": checks.rows("velocity", velocity, dtype, count),
            "acceleration": np.full((count, 2), np.nan, dtype),
            "spin": checks.column("spin", spin, dtype, count),
            "radius": checks.column("radius", radius, dtype, count),
            "mass": checks.column("mass", mass, dtype, count),
            "grown": np.ones(count, dtype),
        }
        checks.rows("spin", np.column_stack((values["spin"], values["spin"])), dtype, count)
        checks.positive("radius", values["radius"])
        checks.positive("mass", values["mass"], infinite_is="pinned")
        self.boundary.check(values["radius"])
        return Group(self._state, self._state.append(values), self.remove)

    # ---- laws ----------------------------------------------------------------------------------------------------------

    @property
    def dtype(self) -> np.dtype[Any]:
        """float32 or float64."""
        return self._state.dtype

    @property
    def gravity(self) -> tuple[float, float]:
        """(x, y), m/s^2."""
        return self._force_sum.gravity

    @gravity.setter
    def gravity(self, value: Sequence[float]) -> None:
        self._force_sum.gravity = checks.vector("gravity", value)

    @property
    def substeps(self) -> int:
        """Steps of length h = dt / substeps in a frame; changing it restarts the integrator."""
        return self._substeps

    @substeps.setter
    def substeps(self, value: int) -> None:
        self._substeps = checks.whole("substeps", value)
        self._h_last = None

    @property
    def integrator(self) -> Integrator:
        """How positions and velocities advance over a substep; changing it restarts the motion from position and velocity."""
        return self._integrator

    @integrator.setter
    def integrator(self, value: Integrator) -> None:
        if not isinstance(value, Integrator):
            raise InputError(f"integrator is {value!r}; allowed is an object such as pyverlet.PositionVerlet()")
        self._integrator = value
        self._h_last = None
        self._state.acceleration[:] = np.nan

    @property
    def boundary(self) -> Boundary:
        """The room: Circle, Box, Open or your own."""
        return self._boundary

    @boundary.setter
    def boundary(self, value: Boundary) -> None:
        if not isinstance(value, Boundary):
            raise InputError(f"boundary is {value!r}; allowed is an object such as pyverlet.Circle(radius=10) or pyverlet.Open()")
        value.check(self._state.radius)
        self._boundary = value

    @property
    def collisions(self) -> Collisions | None:
        """How particles collide; None lets them pass through each other."""
        return self._collisions

    @collisions.setter
    def collisions(self, value: Collisions | None) -> None:
        if value is not None and not isinstance(value, Collisions):
            raise InputError(f"collisions is {value!r}; allowed are pyverlet.Collisions(...) and None")
        self._collisions = value
        self._contacts = None if value is None else ContactSolver(value, self._state.dtype)

    @property
    def threads(self) -> int:
        """Threads the parallel stages use; the result is the same for any number. Set None for as many as pay off."""
        if self._threads is None:
            return _jit.max_threads() if len(self) >= ALL_THREADS_FROM else 1
        return self._threads if len(self) >= ONE_THREAD_BELOW else 1

    @threads.setter
    def threads(self, value: int | None) -> None:
        most = _jit.max_threads()
        self._threads = None if value is None else checks.whole("threads", value, most=most, most_is=" (the cores here)")

    # ---- numbers -------------------------------------------------------------------------------------------------------

    def energy(self) -> Energy:
        """Kinetic (motion and spin), potential, links and total energy, J."""
        return energy(self._state, self.gravity, self.forces)

    def momentum(self) -> Array:
        """(2,) sum of m v over all free particles, kg m/s."""
        return np.array(self._momenta()[:2])

    def angular_momentum(self) -> float:
        """Sum of m (x v_y - y v_x) + I spin about the origin, kg m^2/s."""
        return float(self._momenta()[2])

    def _momenta(self) -> tuple[float, float, float]:
        s = self._state
        return measure.momenta(s.position, s.velocity, s.spin, s.radius, s.mass)  # type: ignore[no-any-return]

    def overlap(self) -> Overlap:
        """Mean and largest overlap of the touching pairs, as fractions of their contact distance, and how many there are."""
        return measure_overlap(self._state)

    def escaped(self) -> int:
        """Particles whose centre is outside the boundary."""
        return int(np.count_nonzero(self.boundary.outside(self.position)))

    def state_hash(self) -> str:
        """16 hex digits of time and every particle's position, velocity, spin, radius and mass: equal bits, equal hash."""
        digest = hashlib.blake2b(np.float64(self.time).tobytes(), digest_size=8)
        for array in (self.position, self.velocity, self.spin, self.radius, self.mass):
            digest.update(array.tobytes())
        return digest.hexdigest()

    @property
    def rebuilds(self) -> int:
        """How often the neighbour list has been built."""
        return self._contacts.broad_phase.rebuilds if self._contacts else 0

    # ---- save and restore ----------------------------------------------------------------------------------------------

    def save(self) -> Saved:
        """A copy of everything that moves; `restore` continues from it with the same bits."""
        return Saved(
            world=self._state,
            arrays={name: array.copy() for name, array in self._state.arrays()},
            time=self.time,
            frames=self.frames,
            h_last=self._h_last,
            slots=self._slots.save(),
            neighbours=self._contacts.broad_phase.save() if self._contacts else None,
            obstacles=self.obstacles.save(),
            actors=[(actor, actor.save()) for actor in self.actors],
        )

    def restore(self, saved: Saved) -> None:
        """Go back to what `save` returned, with the particles of then: groups added since are dead, removed ones live again.

        Raises:
            InputError: it is another world's.
        """
        if saved.world is not self._state:
            raise InputError("saved is the state of another world; allowed is what save() of this one returned")
        numbers = self._state.number.copy()
        self._state.restore(saved.arrays)
        if not np.array_equal(numbers, self._state.number):
            where = np.searchsorted(self._state.number, numbers).clip(max=max(len(self) - 1, 0))
            self._renumber(np.where(self._state.number[where] == numbers, where, -1) if len(self) else np.full(len(numbers), -1))
        self.obstacles.restore(saved.obstacles)
        self.actors[:] = [actor for actor, _ in saved.actors]
        for actor, memory in saved.actors:
            actor.restore(memory)
        self.time, self.frames, self._h_last = saved.time, saved.frames, saved.h_last
        self._slots.restore(saved.slots, self._state)
        if self._contacts:
            # None: collisions were off, or of a kind that remembers nothing.
            self._contacts.broad_phase.forget()
            if saved.neighbours is not None:
                self._contacts.broad_phase.restore(saved.neighbours, self._slots)
