"""The energy limiter: contacts and links must not add energy, so an excess that a frame has gained is removed.

Separating circles lifts them and throws them: after an impact that a substep sees as a deep overlap, and where circles were
placed inside each other. So the energy at the end of a frame is compared with that at its start. A gain beyond SURPLUS of the
world's scale is removed, cluster by cluster, in proportion to the gain of each, and never more than that. A cluster is connected
by contacts in this frame, by links, and by forces that sum to zero, such as gravitation. Its gain is its kinetic energy and that
of its links, minus the work of gravity and of forces with a potential, by the trapezoidal rule, which is exact for springs.
Energy is removed in this order:

1. From velocities within the cluster, relative to its motion and rotation as a whole: that keeps its momentum and its angular
   momentum. Kinetic energy is quadratic, so all are multiplied by sqrt(1 - taken / energy).
2. From all velocities and spins: its rotation, which pushes have changed, and of its motion as a whole the part along what has
   changed its momentum besides gravity: there something else took part, since a cluster cannot push itself. A smooth floor leaves
   the momentum along it. Forces that depend on position conserve no momentum: with them all of the motion counts. So it does
   under gravity, if what follows is not enough: in a wedged crowd, or with masses of 1:1000 in free fall.
3. From the height gained against these forces in this frame: circles are lowered by a part of it.
4. From displacements. Lowering may push circles into walls, or forces may hold them elsewhere: circles whose motion had too
little
   energy go only a part of their displacement in this frame. If they did not move and still gained, the motion of the cluster as
   a whole is slowed, too.

Particles whose centre was outside the room or inside an obstacle at the start of the frame were placed there, and are moved back
at once: the energy of that is no gain. Nor is the energy that separates circles placed inside each other which attract each
other: to pay for it, all that attract them would have to stop.

Circles that the user has placed inside each other since the last frame, or enlarged, may rise to separate. One that overlaps k
others by more than DEEP of the contact distance may gain the energy to rise to the top of its heap, and by RISE radii times
sqrt(k), the width of a crowd of k. Of what is left of that energy, a frame of dt may gain dt / PARTING_S.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.constants import SLEEP_NEAR, SURPLUS
from pyverlet.core import unit
from pyverlet.laws.boundaries import Boundary
from pyverlet.laws.forces import ForceSum, has_potential
from pyverlet.laws.gains import DEEP, TO_PART, Listed, body_of, most_gained, parting_now, rounding, to_part
from pyverlet.laws.links import Links
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.state.sorted_state import SortedState
from pyverlet.state.state import State, spin_radius

_ROUNDED = 1e-5
"""Relative momentum change below which it is rounding, as of a thousand circles or so over eight substeps in float32. Contacts of
rounded positions add velocities of rounding over h."""

_RIPPLE = 0.05
"""If the energy oscillates by more than this fraction, substeps are too long for the method to follow the forces."""

_NEARLY = 1.01
"""Times the allowed gain: more would be too much, and lowering could not remove it."""


class EnergyLimiter:
    """Limits the energy gain of a frame of dt seconds in an undriven world; created before the frame."""

    def __init__(self, world: Any, dt: float) -> None:
        self._start: State = world._state  # the user's arrays, unchanged until the frame is accepted
        self._forces: ForceSum = world._force_sum
        self._links: Links = world.links
        self._room: Boundary = world.boundary
        self._obstacle_arrays: ObstacleArrays = world._obstacle_arrays
        self._order, self._dt, self._most, forces = world.integrator.order, dt, most_gained(world), self._forces
        self._gravity, self._contacts = forces.gravity, world._frames.held
        self._kept: list[Any] = [force for force in forces.forces if has_potential(force)] if forces.forces else []
        self._in_any_order = all(getattr(force, "in_any_order", False) for force in self._kept)
        self._plain = not (self._kept or self._links.pool.gives)
        by_forces, self._by_links = self._holds(world._sorted if self._in_any_order else self._start)
        # Potentials are defined up to a constant, so under gravity, which sets a scale, they do not count.
        self._held = self._by_links if any(self._gravity) else by_forces + self._by_links
        self._energy = 0.0 if self._plain else by_forces + self._by_links + self._mechanical(self._start, self._gravity)

    def _mechanical(self, now: State | SortedState, gravity: tuple[float, float]) -> float:
        position, velocity, *body = body_of(now)
        return float(unit("engine", now.dtype).total_energy(position, velocity, velocity, 0.0, *body, *gravity))

    def _holds(self, now: State | SortedState) -> tuple[float, float]:
        """Energy in forces and in links, J."""
        by_links = 0.0
        if self._links.pool.gives:
            by_links = self._links.energy(now.where() if isinstance(now, SortedState) else now.shown["position"])
        return self._by_forces(now), by_links

    def _by_forces(self, now: State | SortedState) -> float:
        if isinstance(now, SortedState) and not self._in_any_order:
            now = now.in_users_order()
        return float(sum(force.potential(now) for force in self._kept))

    def _gained(self, now: SortedState) -> float:
        """Total energy now minus that at the start, J."""
        if not self._plain:
            return self._mechanical(now, self._gravity) + sum(self._holds(now)) - self._energy
        return float(now.engine.energy_gained(body_of(self._start), body_of(now), *self._gravity))

    def limit(self, state: SortedState, listed: Callable[[], Listed]) -> None:
        """After the frame: remove the excess. listed: the pair list, as first, count, i, j."""
        gained = self._gained(state)
        if gained > TO_PART * self._most and state.placed.any():
            heap, mass = self._joined(state, listed(), SLEEP_NEAR), np.where(state.inverse_mass > 0, state.mass, 0.0)
            weight = np.hypot(*(np.outer(mass, self._gravity) + (self._pulls(state)[1] if self._kept else 0.0)).T)
            begin = self._start.position[state.particle].astype(float)
            self._contacts.parting += to_part(state, begin, listed(), heap, weight, self._gravity)
        surplus = self._surplus(gained, state)
        if surplus > 0.0 and self._excuse_misplaced(state, listed):
            gained = self._gained(state)
            surplus = self._surplus(gained, state)
        if surplus > 0.0 and self._kept and self._order == 2:
            surplus -= self._rippled(state)
        if surplus > 0.0:
            raised = self.limit_energy(state, listed(), surplus)
            state.taken = gained - self._put_back(state, raised, gained - surplus)

    def _surplus(self, gained: float, state: SortedState) -> float:
        """The excess in this gain, J."""
        if not self._most < gained < np.inf or gained <= rounding(state, () if self._plain else (self._start, state)):
            return 0.0
        return gained - max(self._most, SURPLUS * self._there()) - parting_now(self._contacts.parting, self._dt)

    def _there(self) -> float:
        """Energy other than that of a fall, J: kinetic, and in forces and links."""
        return self._mechanical(self._start, (0.0, 0.0)) + abs(self._held)

    def _rippled(self, state: SortedState) -> float:
        """Energy that the integration method has added in this frame, J, and removes in others; 0 if substeps are too long for
        it.

        The Stormer-Verlet method moves particles by F - h^2 F" / 12, and shows v + h^2 F' / 6 m. So the energy shown changes by
        h^2 / 12 times the change of v F', plus the integral of a F', with the total acceleration a. Links are corrected for that
        (core/link_softness.py).
        """
        start, order, free = self._start, state.particle, state.inverse_mass > 0
        before = self._bent(state, start.position[order], start.velocity[order])
        now = self._bent(state, state.position, state.velocity)
        pulled = [array[free] for array in self._pulls(state)]
        falls = state.inverse_mass[free][:, None] * pulled[0] + self._gravity
        given = start.acceleration[order][free]
        mean = 0.5 * (np.where(np.isnan(given), falls, given) + state.acceleration[free])
        raised = before - now + state.h**2 / 12.0 * float((mean * (pulled[1] - pulled[0])).sum())
        return raised if 0.0 < raised <= _RIPPLE * self._there() else 0.0

    def _bent(self, state: SortedState, position: Array, velocity: Array) -> float:
        """-h^2 v F' / 12, J, by the second difference of the potential along the path of a substep."""
        here, way, held = state.position, state.real(state.h) * velocity, []
        for step in (-1, 1, 0):
            state.position = position + step * way
            held.append(self._by_forces(state))
        state.position = here
        return float(held[0] + held[1] - 2.0 * held[2]) / 12.0

    def _excuse_misplaced(self, state: SortedState, listed: Callable[[], Listed]) -> bool:
        """Let particles at impossible places start where they are now. Returns False if there were none."""
        start = self._start
        marks = start.category, start.mask
        misplaced = self._room.outside(start.position) & self._room.holds(*marks)
        misplaced |= self._obstacle_arrays.covering(start.position, *marks) >= 0
        moved = (misplaced & np.isfinite(start.mass))[state.particle]
        if any(hasattr(force, "among") for force in self._kept):
            moved |= self._overlapped(state, listed())
        if not moved.any():
            return False
        self._start = copy(start)
        self._start.position[state.particle[moved]] = state.position[moved]
        if not self._plain:
            self._energy = self._by_forces(self._start) + self._by_links + self._mechanical(self._start, self._gravity)
        return True

    def _overlapped(self, state: SortedState, listed: Listed) -> Array:
        """(n,) bool: circles that overlapped another by more than contacts allow, at the start of the frame."""
        root = self._joined(state, listed, 1.0 - DEEP)
        return np.asarray(np.bincount(root, minlength=len(root))[root] > 1)

    def _joined(self, state: SortedState, listed: Listed, near: float) -> Array:
        """(n,) lowest row of the set connected at the start of the frame by pairs closer than so many radii."""
        root, begin = np.arange(len(state)), self._start.position[state.particle]
        bodies = (begin, np.zeros_like(begin), state.radius, *state.periodic.period, state.inverse_mass)
        state.motion.join_near_pairs(*bodies, listed, near, root)
        state.motion.compress_paths(root)
        return root

    def limit_energy(self, state: SortedState, listed: Listed, surplus: float) -> Array:
        """Remove this energy, J, from the clusters that gained it. Returns (n,) bool: those whose motion had less than that."""
        start = self._start
        before, pull = self._pulls(state)
        then, now = body_of(start), body_of(state)
        limits = (
            surplus, self._dt, *self._gravity, *state.periodic.period, bool(self._forces.forces), bool(self._kept), _ROUNDED,
            float(np.finfo(state.dtype).eps) / (state.h * _ROUNDED),
        )  # fmt: skip
        lift, moved, lower = np.empty(len(state)), *np.empty((2, len(state), 2))
        state.motion.raise_of(then, now, state.particle, before, pull, limits, lift, moved)
        share = self._links.pool.gains(start.position, state.where(), state.periodic, start.mass) if self._links else np.zeros(0)
        about = self._clusters(state, listed, moved), pull, state.particle, share
        more = state.motion.remove_energy(then, now, about, limits, lift, moved, lower)
        within = self._within_boundary(state.position.astype(float), lower, state.radius)
        held = self._room.holds(start.category, start.mask)[state.particle]
        state.position[:] = np.where(held[:, None], within, lower)
        return np.asarray(more)

    def _put_back(self, state: SortedState, raised: Array, allowed: float) -> float:
        """Reduce the displacements of `raised` in this frame until no more than `allowed` J are gained; returns the gain.

        Paths are straight and rooms convex, so none leaves the room. The work of gravity is linear along a path.
        """
        left = self._gained(state)
        if left <= allowed * _NEARLY or not raised.any():
            return left
        start, order = self._start, state.particle[raised]
        begin = start.position[order].astype(float)
        way = state.periodic.nearest(state.position[raised].astype(float) - begin)

        def come(part: float) -> float:
            state.position[raised] = begin + part * way
            return self._gained(state)

        none = come(0.0)
        if none < allowed:
            left = come((allowed - none) / (left - none))
            if left <= allowed * _NEARLY:
                return left
            none = come(0.0)
        if none > allowed * _NEARLY:
            self._slow(state, raised, none - allowed)
        return self._gained(state)

    def _slow(self, state: SortedState, which: Array, surplus: float) -> None:
        """Remove this energy, J, from the motion of `which`, or all of it."""
        radius = spin_radius(state.inertia[which], state.radius[which], state.mass[which])
        m, rim = state.mass[which].astype(float), (radius * state.spin[which]).astype(float)
        motion = 0.5 * float(m @ (state.velocity[which].astype(float) ** 2).sum(axis=1)) + 0.25 * float(m @ rim**2)
        part = state.real(np.sqrt(max(1.0 - surplus / motion, 0.0)) if motion > 0.0 else 1.0)
        state.velocity[which] *= part
        state.spin[which] *= part

    def _pulls(self, state: SortedState) -> tuple[Array, Array]:
        """(n, 2) N, forces with a potential besides gravity, at the start of the frame and now; empty without any."""
        if not self._kept:
            return np.zeros((0, 2)), np.zeros((0, 2))
        now = state.position
        state.position = self._start.position[state.particle]
        before = self._pull(state)
        state.position = now
        return before, self._pull(state)

    def _pull(self, state: SortedState) -> Array:
        """(n, 2) N, these forces at the current positions."""
        state.force.fill(0)
        for force in self._kept:
            force.apply(state, self._forces.t)
        return state.force.astype(float)

    def _within_boundary(self, here: Array, lower: Array, radius: Array) -> Array:
        """(n, 2) m, `lower`, or as far in that direction as walls allow; a strong force may lead through one."""
        faced = self._room.facing(lower)
        if faced is None:
            return np.where(self._room.outside(lower)[:, None], here, lower)
        was, _ = self._room.facing(here) or faced
        for before, gap, normal in zip(was.T, faced[0].T, faced[1].swapaxes(0, 1), strict=True):
            lower = lower + np.maximum(np.minimum(radius, before) - gap, 0)[:, None] * normal
        return lower

    def _since_thrown(self, state: SortedState) -> Array:
        """(n, 2) m: bound of the displacement since the last collision: after a bounce a pair may be where it was before.

        It is twice that at the current speed, as there may have been other collisions since.
        """
        kick = state.velocity - self._start.velocity[state.particle] - self._dt * np.asarray(self._gravity)
        met = np.abs(kick).max(axis=1) > _ROUNDED * np.abs(state.velocity).max(axis=1)
        return np.where(met[:, None], 2.0 * self._dt * state.velocity, 0.0)

    def _clusters(self, state: SortedState, listed: Listed, moved: Array) -> Array:
        """(n,) lowest row of the cluster of each row."""
        root = np.arange(len(state))
        for way in (moved, self._since_thrown(state)):
            bodies = (state.position, way.astype(state.dtype), state.radius, *state.periodic.period, state.inverse_mass)
            state.motion.join_near_pairs(*bodies, listed, SLEEP_NEAR, root)
        if self._links:
            state.motion.join_rows(state.sorted_index(self._links.joined()), state.inverse_mass, root)
        for force in self._kept:
            if among := getattr(force, "among", None):
                members = among(state)[state.inverse_mass[among(state)] > 0].astype(np.int32)
                state.motion.join_rows(np.column_stack((members, np.roll(members, 1))), state.inverse_mass, root)
        state.motion.compress_paths(root)
        return root


def holds(world: Any) -> bool:
    """Whether forces or links store energy, whose initial value is lost when a frame is over."""
    return world.links.pool.gives or any(map(has_potential, world.forces))
