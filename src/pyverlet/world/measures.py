"""Measurements of a world: energy, momentum, contacts, pressure, overlap and a hash of its state."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError
from pyverlet.common.renamed import Renamed
from pyverlet.common.shown import line
from pyverlet.common.step_lock import between_frames
from pyverlet.core import unit
from pyverlet.laws.boundaries import Boundary
from pyverlet.laws.collisions import Overlap, measure_overlap
from pyverlet.laws.contact_records import WALLS, ContactRecords
from pyverlet.laws.events import Events
from pyverlet.laws.forces import ForceSum, has_potential
from pyverlet.laws.integrators import Integrator
from pyverlet.laws.ledger import EnergyLedger, Ledger
from pyverlet.laws.obstacles import Obstacle
from pyverlet.state.state import spin_radius
from pyverlet.world.particles import Particles


class Energy(NamedTuple):
    """Energy of a world, J. Pinned particles have none. Gravity's potential is 0 at the origin."""

    kinetic: float
    spin: float
    potential: float
    links: float

    @property
    def total(self) -> float:
        """kinetic + potential + links; spin is part of kinetic."""
        return self.kinetic + self.potential + self.links

    def __repr__(self) -> str:
        return line("Energy", **self._asdict())


def hash_of(time: float, arrays: Iterable[Array]) -> str:
    """`Measures.state_hash` of a time and positions, velocities, spins, radii and masses."""
    digest = hashlib.blake2b(np.float64(time).tobytes(), digest_size=8)
    for array in arrays:
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


class Measures(Particles):
    """The measurements of a world."""

    time: float
    gravity: tuple[float, float]
    _energy_ledger: EnergyLedger | None
    _force_sum: ForceSum
    integrator: Integrator
    profile: Any
    threads: int

    @between_frames
    def energy(self) -> Energy:
        """Kinetic (motion and spin), potential, links and total energy, J."""
        s, links = self._state, self.links.energy() if self.links else 0.0
        motion, spin, potential = unit("engine", s.dtype).energies(*self._bodies(), *self.gravity)
        if self.forces:
            self.forces.check(s)
            potential += sum(force.potential(s) for force in self.forces if has_potential(force))
        return Energy(motion + spin, spin, potential, links)

    @property
    def keeps_ledger(self) -> bool:
        """Whether the world was built with World(ledger=True), so that `ledger` can be read."""
        return self._energy_ledger is not None

    @property
    @between_frames
    def ledger(self) -> Ledger:
        """Energy accounts since the world was built, as of the last frame.

        Raises:
            InputError: the world keeps no ledger.
        """
        if self._energy_ledger is None:
            raise InputError("ledger is off in this world; allowed is a world built with World(ledger=True)")
        return self._energy_ledger.ledger

    @property
    @between_frames
    def asleep(self) -> Array:
        """(n,) bool, which particles sleep; none unless the world was built with World(sleep=True). A copy."""
        asleep = np.zeros(len(self), bool)
        asleep[self._sorted.particle[self._sorted.asleep]] = True
        return asleep

    @property
    def records_events(self) -> bool:
        """Whether the world was built with World(events=True), so that `events` can be read."""
        return self._events is not None

    @property
    @between_frames
    def events(self) -> Events:
        """Contacts that began or ended in the last frame, and hits.

        Raises:
            InputError: the world records no events.
        """
        if self._events is None:
            raise InputError("events are off in this world; allowed is a world built with World(events=True)")
        return self._events

    # ---- who touches -----------------------------------------------------------------------------------------------------

    @property
    @between_frames
    def contacts(self) -> Array:
        """Contacts of the last frame, a structured array sorted by `a`, then `b`; impacts that have ended are included.

        Fields: circles `a` < `b`, or b = -1 and the number of a `wall` of the room (of a Box: left, right, floor, ceiling) or
        of an `obstacle`, else -1; `point` (2), m; `normal` (2) out of a; `impulse` along it, N s, summed over the frame, and
        `rub`, the tangential impulse on a along (-n_y, n_x), N s.

        Raises:
            InputError: the world records no contacts.
        """
        return self._recorded().records

    @between_frames
    def force_on(self, what: Obstacle | Boundary) -> Array:
        """(2,) N, the force of all circles on an obstacle or on all walls of the room, averaged over the last frame.

        The pressure of a `Fluid` on walls is not a contact force and is left out, as it is from `pressure`: see docs/fluid.md.

        Raises:
            InputError: it is not in this world, or the world records no contacts.
        """
        records, which = self._recorded(), WALLS
        if what is not self.boundary:
            number = self._obstacle_arrays.number_of(what)
            if number is None:
                raise InputError(f"what is {what!r}; allowed is an obstacle of this world, or its boundary")
            which = self._frames.held.obstacles.number_then(what, number)
        return records.force_on(which)

    @between_frames
    def pressure(self) -> float:
        """Pressure on the walls of the room in the last frame, N/m: the normal force of circles over the length of the walls.

        A periodic room without walls has the pressure of the virial theorem: the sum of m |v - u|^2, with the mean velocity u,
        and of each pair's contact force times distance, over twice the area. Forces between particles add the `virial` of their
        pair force; links, `Gravitation` and fluids, which have a `pressure` of their own, are left out.

        Raises:
            InputError: the room has neither walls of a known length nor periods, or the world records no contacts.
        """
        records, length = self._recorded(), self.boundary.perimeter()
        if length is not None:
            return records.pushed() / length
        if not self.boundary.periodic:
            allowed = "a pyverlet.Box, Circle or Periodic"
            raise InputError(f"boundary is {self.boundary!r}; allowed is {allowed}, to have a pressure")
        free = np.isfinite(self.mass)
        mass, velocity = self.mass[free].astype(float), self.velocity[free].astype(float)
        stream = mass @ velocity / max(mass.sum(), 1e-300)
        motion = float((mass[:, None] * (velocity - stream) ** 2).sum())
        pairs: float = sum(force.virial(self._state) for force in self.forces if hasattr(force, "virial"))
        return (motion + records.virial() + pairs) / (2 * self.boundary.periodic.period_x * self.boundary.periodic.period_y)

    def _recorded(self) -> ContactRecords:
        records = self._contact_records
        if records is None:
            raise InputError("contacts are off in this world; allowed is a world built with World(contacts=True)")
        records.take(self._state.shown["number"], self._frames.held.obstacles.count)
        return records

    @contextmanager
    def recording_contacts(self) -> Iterator[ContactRecords]:
        """Context manager: frames record contacts as with World(contacts=True); yields the record."""
        before = self._contact_records
        self._contact_records = ContactRecords(self._frames.held.engine) if before is None else before
        try:
            yield self._contact_records
            self._take_contacts()
        finally:
            self._contact_records = before

    noting_contacts: Any = Renamed("recording_contacts")
    tells_events: Any = Renamed("records_events")

    def momentum(self) -> Array:
        """(2,) sum of m v over all free particles, kg m/s."""
        return np.array(self._momenta()[:2])

    def angular_momentum(self) -> float:
        """Sum of m (x v_y - y v_x) + I spin about the origin, kg m^2/s."""
        return float(self._momenta()[2])

    @between_frames
    def _momenta(self) -> tuple[float, float, float]:
        found: tuple[float, float, float] = unit("engine", self._state.dtype).momenta(*self._bodies())
        return found

    def _bodies(self) -> tuple[Array, ...]:
        """Read-only positions, velocities, spins, radii of gyration and masses."""
        s = self._state.shown
        return s["position"], s["velocity"], s["spin"], spin_radius(s["inertia"], s["radius"], s["mass"]), s["mass"]

    @between_frames
    def overlap(self) -> Overlap:
        """Mean and largest overlap of touching pairs, as fractions of their contact distance, and the number of pairs."""
        return measure_overlap(self._state, self.links.known_apart())

    @between_frames
    def escaped(self) -> int:
        """Number of particles whose centre is outside the boundary, without those that its walls do not hold."""
        held = self.boundary.holds(self.category, self.mask)
        return int(np.count_nonzero(self.boundary.outside(self.position) & held))

    @between_frames
    def state_hash(self) -> str:
        """16 hex digits of time and every particle's position, velocity, spin, angle, radius and mass: equal bits, equal hash."""
        return hash_of(self.time, (self.position, self.velocity, self.spin, self.angle, self.radius, self.mass))

    @property
    def rebuilds(self) -> int:
        """How often the neighbour list has been built."""
        return int(self._frames.rebuilds)
