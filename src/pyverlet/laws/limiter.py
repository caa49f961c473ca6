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

from pyverlet.core import unit
from pyverlet.ground.arrays import Array
from pyverlet.ground.constants import SLEEP_NEAR, SURPLUS
from pyverlet.laws.forces import ForceSum, has_potential
from pyverlet.laws.gains import DEEP, TO_PART, Listed, body_of, most_gained, parting_now, rounding, to_part
from pyverlet.laws.links import Links
from pyverlet.laws.obstacles import ObstacleArrays
from pyverlet.laws.rooms import Boundary
from pyverlet.state.slots import Slots
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
        by_forces, self._by_links = self._holds(world._slots if self._in_any_order else self._start)
        # Potentials are defined up to a constant, so under gravity, which sets a scale, they do not count.
        self._held = self._by_links if any(self._gravity) else by_forces + self._by_links
        self._energy = 0.0 if self._plain else by_forces + self._by_links + self._mechanical(self._start, self._gravity)

    def _mechanical(self, now: State | Slots, gravity: tuple[float, float]) -> float:
        position, velocity, *body = body_of(now)
        return float(unit("engine", now.dtype).total_energy(position, velocity, velocity, 0.0, *body, *gravity))

    def _holds(self, now: State | Slots) -> tuple[float, float]:
        """Energy in forces and in links, J."""
        by_links = 0.0
        if self._links.pool.gives:
            by_links = self._links.energy(now.where() if isinstance(now, Slots) else now.shown["position"])
        return self._by_forces(now), by_links

    def _by_forces(self, now: State | Slots) -> float:
        if isinstance(now, Slots) and not self._in_any_order:
            now = now.in_users_order()
        return float(sum(force.potential(now) for force in self._kept))

    def _gained(self, now: Slots) -> float:
        """Total energy now minus that at the start, J."""
        if not self._plain:
            return self._mechanical(now, self._gravity) + sum(self._holds(now)) - self._energy
        return float(now.engine.energy_gained(body_of(self._start), body_of(now), *self._gravity))

    def limit(self, slots: Slots, listed: Callable[[], Listed]) -> None:
        """After the frame: remove the excess. listed: the pair list, as first, count, i, j."""
        gained = self._gained(slots)
        if gained > TO_PART * self._most and slots.placed.any():
            heap, mass = self._joined(slots, listed(), SLEEP_NEAR), np.where(slots.inverse_mass > 0, slots.mass, 0.0)
            weight = np.hypot(*(np.outer(mass, self._gravity) + (self._pulls(slots)[1] if self._kept else 0.0)).T)
            begin = self._start.position[slots.particle].astype(float)
            self._contacts.parting += to_part(slots, begin, listed(), heap, weight, self._gravity)
        surplus = self._surplus(gained, slots)
        if surplus > 0.0 and self._excuse_misplaced(slots, listed):
            gained = self._gained(slots)
            surplus = self._surplus(gained, slots)
        if surplus > 0.0 and self._kept and self._order == 2:
            surplus -= self._rippled(slots)
        if surplus > 0.0:
            raised = self.take_back(slots, listed(), surplus)
            slots.taken = gained - self._put_back(slots, raised, gained - surplus)

    def _surplus(self, gained: float, slots: Slots) -> float:
        """The excess in this gain, J."""
        if not self._most < gained < np.inf or gained <= rounding(slots, () if self._plain else (self._start, slots)):
            return 0.0
        return gained - max(self._most, SURPLUS * self._there()) - parting_now(self._contacts.parting, self._dt)

    def _there(self) -> float:
        """Energy other than that of a fall, J: kinetic, and in forces and links."""
        return self._mechanical(self._start, (0.0, 0.0)) + abs(self._held)

    def _rippled(self, slots: Slots) -> float:
        """Energy that the integration method has added in this frame, J, and removes in others; 0 if substeps are too long for
        it.

        The Stormer-Verlet method moves particles by F - h^2 F" / 12, and shows v + h^2 F' / 6 m. So the energy shown changes by
        h^2 / 12 times the change of v F', plus the integral of a F', with the total acceleration a. Links are corrected for that
        (core/link_softness.py).
        """
        start, order, free = self._start, slots.particle, slots.inverse_mass > 0
        before = self._bent(slots, start.position[order], start.velocity[order])
        now = self._bent(slots, slots.position, slots.velocity)
        pulled = [array[free] for array in self._pulls(slots)]
        falls = slots.inverse_mass[free][:, None] * pulled[0] + self._gravity
        given = start.acceleration[order][free]
        mean = 0.5 * (np.where(np.isnan(given), falls, given) + slots.acceleration[free])
        raised = before - now + slots.h**2 / 12.0 * float((mean * (pulled[1] - pulled[0])).sum())
        return raised if 0.0 < raised <= _RIPPLE * self._there() else 0.0

    def _bent(self, slots: Slots, position: Array, velocity: Array) -> float:
        """-h^2 v F' / 12, J, by the second difference of the potential along the path of a substep."""
        here, way, held = slots.position, slots.real(slots.h) * velocity, []
        for step in (-1, 1, 0):
            slots.position = position + step * way
            held.append(self._by_forces(slots))
        slots.position = here
        return float(held[0] + held[1] - 2.0 * held[2]) / 12.0

    def _excuse_misplaced(self, slots: Slots, listed: Callable[[], Listed]) -> bool:
        """Let particles at impossible places start where they are now. Returns False if there were none."""
        start = self._start
        marks = start.category, start.mask
        misplaced = self._room.outside(start.position) & self._room.holds(*marks)
        misplaced |= self._obstacle_arrays.covering(start.position, *marks) >= 0
        moved = (misplaced & np.isfinite(start.mass))[slots.particle]
        if any(hasattr(force, "among") for force in self._kept):
            moved |= self._overlapped(slots, listed())
        if not moved.any():
            return False
        self._start = copy(start)
        self._start.position[slots.particle[moved]] = slots.position[moved]
        if not self._plain:
            self._energy = self._by_forces(self._start) + self._by_links + self._mechanical(self._start, self._gravity)
        return True

    def _overlapped(self, slots: Slots, listed: Listed) -> Array:
        """(n,) bool: circles that overlapped another by more than contacts allow, at the start of the frame."""
        root = self._joined(slots, listed, 1.0 - DEEP)
        return np.asarray(np.bincount(root, minlength=len(root))[root] > 1)

    def _joined(self, slots: Slots, listed: Listed, near: float) -> Array:
        """(n,) lowest slot of the set connected at the start of the frame by pairs closer than so many radii."""
        root, begin = np.arange(len(slots)), self._start.position[slots.particle]
        bodies = (begin, np.zeros_like(begin), slots.radius, *slots.seam.period, slots.inverse_mass)
        slots.motion.join_near_pairs(*bodies, listed, near, root)
        slots.motion.compress_paths(root)
        return root

    def take_back(self, slots: Slots, listed: Listed, surplus: float) -> Array:
        """Remove this energy, J, from the clusters that gained it. Returns (n,) bool: those whose motion had less than that."""
        start = self._start
        before, pull = self._pulls(slots)
        then, now = body_of(start), body_of(slots)
        limits = (
            surplus, self._dt, *self._gravity, *slots.seam.period, bool(self._forces.forces), bool(self._kept), _ROUNDED,
            float(np.finfo(slots.dtype).eps) / (slots.h * _ROUNDED),
        )  # fmt: skip
        lift, moved, lower = np.empty(len(slots)), *np.empty((2, len(slots), 2))
        slots.motion.raise_of(then, now, slots.particle, before, pull, limits, lift, moved)
        share = self._links.pool.gains(start.position, slots.where(), slots.seam, start.mass) if self._links else np.zeros(0)
        about = self._clusters(slots, listed, moved), pull, slots.particle, share
        more = slots.motion.take_energy(then, now, about, limits, lift, moved, lower)
        within = self._within_room(slots.position.astype(float), lower, slots.radius)
        held = self._room.holds(start.category, start.mask)[slots.particle]
        slots.position[:] = np.where(held[:, None], within, lower)
        return np.asarray(more)

    def _put_back(self, slots: Slots, raised: Array, allowed: float) -> float:
        """Reduce the displacements of `raised` in this frame until no more than `allowed` J are gained; returns the gain.

        Paths are straight and rooms convex, so none leaves the room. The work of gravity is linear along a path.
        """
        left = self._gained(slots)
        if left <= allowed * _NEARLY or not raised.any():
            return left
        start, order = self._start, slots.particle[raised]
        begin = start.position[order].astype(float)
        way = slots.seam.nearest(slots.position[raised].astype(float) - begin)

        def come(part: float) -> float:
            slots.position[raised] = begin + part * way
            return self._gained(slots)

        none = come(0.0)
        if none < allowed:
            left = come((allowed - none) / (left - none))
            if left <= allowed * _NEARLY:
                return left
            none = come(0.0)
        if none > allowed * _NEARLY:
            self._slow(slots, raised, none - allowed)
        return self._gained(slots)

    def _slow(self, slots: Slots, which: Array, surplus: float) -> None:
        """Remove this energy, J, from the motion of `which`, or all of it."""
        radius = spin_radius(slots.inertia[which], slots.radius[which], slots.mass[which])
        m, rim = slots.mass[which].astype(float), (radius * slots.spin[which]).astype(float)
        motion = 0.5 * float(m @ (slots.velocity[which].astype(float) ** 2).sum(axis=1)) + 0.25 * float(m @ rim**2)
        part = slots.real(np.sqrt(max(1.0 - surplus / motion, 0.0)) if motion > 0.0 else 1.0)
        slots.velocity[which] *= part
        slots.spin[which] *= part

    def _pulls(self, slots: Slots) -> tuple[Array, Array]:
        """(n, 2) N, forces with a potential besides gravity, at the start of the frame and now; empty without any."""
        if not self._kept:
            return np.zeros((0, 2)), np.zeros((0, 2))
        now = slots.position
        slots.position = self._start.position[slots.particle]
        before = self._pull(slots)
        slots.position = now
        return before, self._pull(slots)

    def _pull(self, slots: Slots) -> Array:
        """(n, 2) N, these forces at the current positions."""
        slots.force.fill(0)
        for force in self._kept:
            force.apply(slots, self._forces.t)
        return slots.force.astype(float)

    def _within_room(self, here: Array, lower: Array, radius: Array) -> Array:
        """(n, 2) m, `lower`, or as far in that direction as walls allow; a strong force may lead through one."""
        faced = self._room.facing(lower)
        if faced is None:
            return np.where(self._room.outside(lower)[:, None], here, lower)
        was, _ = self._room.facing(here) or faced
        for before, gap, normal in zip(was.T, faced[0].T, faced[1].swapaxes(0, 1), strict=True):
            lower = lower + np.maximum(np.minimum(radius, before) - gap, 0)[:, None] * normal
        return lower

    def _since_thrown(self, slots: Slots) -> Array:
        """(n, 2) m: bound of the displacement since the last collision: after a bounce a pair may be where it was before.

        It is twice that at the current speed, as there may have been other collisions since.
        """
        kick = slots.velocity - self._start.velocity[slots.particle] - self._dt * np.asarray(self._gravity)
        met = np.abs(kick).max(axis=1) > _ROUNDED * np.abs(slots.velocity).max(axis=1)
        return np.where(met[:, None], 2.0 * self._dt * slots.velocity, 0.0)

    def _clusters(self, slots: Slots, listed: Listed, moved: Array) -> Array:
        """(n,) lowest slot of the cluster of each slot."""
        root = np.arange(len(slots))
        for way in (moved, self._since_thrown(slots)):
            bodies = (slots.position, way.astype(slots.dtype), slots.radius, *slots.seam.period, slots.inverse_mass)
            slots.motion.join_near_pairs(*bodies, listed, SLEEP_NEAR, root)
        if self._links:
            slots.motion.join_rows(slots.slots_of(self._links.joined()), slots.inverse_mass, root)
        for force in self._kept:
            if among := getattr(force, "among", None):
                members = among(slots)[slots.inverse_mass[among(slots)] > 0].astype(np.int32)
                slots.motion.join_rows(np.column_stack((members, np.roll(members, 1))), slots.inverse_mass, root)
        slots.motion.compress_paths(root)
        return root


def holds(world: Any) -> bool:
    """Whether forces or links store energy, whose initial value is lost when a frame is over."""
    return world.links.pool.gives or any(map(has_potential, world.forces))
