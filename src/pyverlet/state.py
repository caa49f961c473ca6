"""Where the numbers live: `State` in the order the user added particles, `Slots` in the order the engine likes.

The user's arrays are the truth between frames. A frame begins by gathering them into slots, sorted so that neighbours in
space are neighbours in memory, and ends by scattering the result back; nobody outside ever sees the engine's order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet import checks
from pyverlet.constants import SERIAL_BELOW
from pyverlet.errors import InputError
from pyverlet.kernels import motion

Array = NDArray[Any]

_ROWS = ("position", "velocity", "acceleration")
_COLUMNS = ("spin", "radius", "mass", "grown")
_NUMBERS = ("number",)


class State:
    """Structure of arrays of n particles, in the order they were added. SI units.

    Attributes:
        position: (n, 2) centres, m.
        velocity: (n, 2) m/s.
        acceleration: (n, 2) m/s^2, of the last substep; the memory of the Verlet integrators. NaN: not evaluated yet.
        spin: (n,) angular velocity, rad/s, counter-clockwise.
        radius: (n,) m.
        mass: (n,) kg; infinity pins the particle.
        grown: (n,) part of the radius that other circles feel; less than 1 for those that were added on top of another.
        number: (n,) of each particle, in ascending order; no two particles of a world ever have the same.
        version: how often particles were added or removed.
    """

    position: Array
    velocity: Array
    acceleration: Array
    spin: Array
    radius: Array
    mass: Array
    grown: Array
    number: Array

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self.dtype = dtype
        self._store: dict[str, Array] = {name: np.empty((0, 2), dtype) for name in _ROWS}
        self._store |= {name: np.empty(0, dtype) for name in _COLUMNS}
        self._store |= {name: np.empty(0, np.int64) for name in _NUMBERS}
        self._numbers = 0
        self.version = 0
        self._show(0)

    def __len__(self) -> int:
        return len(self.radius)

    def arrays(self) -> Iterator[tuple[str, Array]]:
        """Names and arrays, always in the same order."""
        for name in self._store:
            yield name, getattr(self, name)

    def append(self, values: dict[str, Array]) -> slice:
        """Add particles; `values` holds an array for each name. Returns where they stand."""
        start = len(self)
        stop = start + len(values["radius"])
        capacity = len(self._store["radius"])
        if stop > capacity:
            # Doubling: adding one by one costs O(1) each on average.
            capacity = max(stop, 2 * capacity)
            for name, old in self._store.items():
                self._store[name] = np.empty((capacity, *old.shape[1:]), old.dtype)
                self._store[name][:start] = old[:start]
        self._show(stop)
        for name, value in values.items():
            getattr(self, name)[start:stop] = value
        self.number[start:] = np.arange(self._numbers, self._numbers + stop - start)
        self._numbers += stop - start
        self.version += 1
        return slice(start, stop)

    def remove(self, kept: Array) -> Array:
        """Keep the particles marked in `kept` (n,) bool, in their order. Returns (n,) where each of the old is now, or -1."""
        now = np.where(kept, np.cumsum(kept) - 1, -1)
        first = int(np.argmin(kept)) if not kept.all() else len(kept)
        left = int(np.count_nonzero(kept))
        for array in self._store.values():
            array[first:left] = array[first : len(kept)][kept[first:]]
        self._show(left)
        self.version += 1
        return now

    def restore(self, arrays: dict[str, Array]) -> None:
        """Take up what `arrays` gave once, however many particles that were."""
        count = len(arrays["number"])
        if count > len(self._store["number"]):
            self._store = {name: np.empty((count, *old.shape[1:]), old.dtype) for name, old in self._store.items()}
        self._show(count)
        for name in self._store:
            getattr(self, name)[:] = arrays[name]
        self.version += 1

    def find(self, first: int, stop: int) -> slice:
        """Where the particles with numbers from `first` up to, not including, `stop` are."""
        a, b = np.searchsorted(self.number, (first, stop))
        return slice(int(a), int(b))

    def _show(self, count: int) -> None:
        for name, array in self._store.items():
            setattr(self, name, array[:count])


class Slots:
    """The engine's working copy, in an order of its own: what forces, integrators, contacts and bounds see during a frame.

    Attributes:
        particle: (n,) the user's index of the particle in each slot.
        position, velocity, acceleration, spin, radius, mass, grown: as in State.
        size: (n,) grown * radius, m: what contacts between particles take as the radius.
        inverse_mass: (n,) 1/kg; 0 for a pinned particle.
        force: (n, 2) N, the sum of the forces besides gravity in this evaluation.
        start: (n, 2) positions before the integration of this substep, m. Kept only if circles rub.
        fed: (n,) 1 where a contact at rest fed the velocity in the last substep: it carries weight. Kept only if circles bounce.
        resting: (n,) 1 where a contact without bounce held the particle in the last substep.
    """

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self.dtype = dtype
        self.real = dtype.type
        self._order = np.zeros(0, np.int32), np.zeros(0, np.uint8)
        self._resize(0)

    def __len__(self) -> int:
        return len(self.radius)

    def _resize(self, count: int) -> None:
        """Room for `count` particles: those of `_order`, as they stood, and behind them the new ones."""
        order, fed = self._order
        self.particle = np.concatenate((order, np.arange(len(order), count, dtype=np.int32)))
        for name in (*_ROWS, "force"):
            setattr(self, name, np.zeros((count, 2), self.dtype))
        for name in (*_COLUMNS, "inverse_mass"):
            setattr(self, name, np.zeros(count, self.dtype))
        self.start = np.zeros((count, 2), self.dtype)
        self.size = self.radius
        self.resting = np.zeros(count, np.uint8)
        self.fed = np.concatenate((fed, np.zeros(count - len(fed), np.uint8)))
        self._order = np.zeros(0, np.int32), np.zeros(0, np.uint8)
        self._changed = True
        self._scratch: list[Array] = []
        self._slot_of: Array | None = None

    position: Array
    velocity: Array
    acceleration: Array
    force: Array
    start: Array
    spin: Array
    radius: Array
    mass: Array
    grown: Array
    inverse_mass: Array

    def gather(self, state: State) -> bool:
        """Copy the user's arrays in. True if particles, radii or masses are not what they were: no list survives that."""
        if len(state) != len(self):
            self._order = self.particle, self.fed
            self._resize(len(state))
        resized, self._changed = self._changed, False
        for name in _ROWS:
            motion.take_rows(getattr(self, name), getattr(state, name), self.particle)
        motion.take_checking(self.spin, state.spin, self.particle)
        motion.take_checking(self.grown, state.grown, self.particle)
        changed = motion.take_checking(self.radius, state.radius, self.particle)
        if motion.take_checking(self.mass, state.mass, self.particle):
            with np.errstate(divide="ignore"):  # a mass of 0 is refused by the world, with a sentence
                np.divide(1, self.mass, out=self.inverse_mass)
            changed = True
        self.resize()
        return bool(resized or changed)

    def forget(self, now: Array) -> None:
        """The user's particles are now at `now` (n,), or no more (-1): let those go, keep the order of the others."""
        order = now[self.particle].astype(np.int32)
        kept = order >= 0
        self._order = order[kept], self.fed[kept]
        self._resize(int(np.count_nonzero(kept)))

    def resize(self) -> None:
        """Bring `size` up to date with `grown`."""
        self.size = self.radius if (self.grown >= 1).all() else self.radius * self.grown

    def scatter(self, state: State) -> None:
        """Copy what a frame changes back to the user's arrays."""
        for name in _ROWS:
            motion.put_rows(getattr(state, name), getattr(self, name), self.particle)
        motion.put(state.spin, self.spin, self.particle)
        motion.put(state.grown, self.grown, self.particle)

    def reorder(self, order: Array) -> None:
        """Put the particle of slot order[k] into slot k."""
        for name in _ROWS:
            old = getattr(self, name)
            new = self.scratch(0)
            motion.take_rows(new, old, order)
            setattr(self, name, new)
            self._scratch[0] = old
        for name in ("spin", "radius", "mass", "inverse_mass", "particle", "resting", "fed", "start", "grown"):
            setattr(self, name, getattr(self, name)[order])
        self.resize()
        self._slot_of = None

    def save(self) -> tuple[Array, Array]:
        """What outlives a frame here and not in the user's arrays: the order, and who carried weight."""
        return self.particle.copy(), self.fed.copy()

    def restore(self, saved: tuple[Array, Array], state: State) -> None:
        """Take up what `save` returned and gather the state into that order."""
        self._order = saved[0].copy(), saved[1].copy()
        self._resize(len(saved[0]))
        self.gather(state)

    def scratch(self, number: int) -> Array:
        """An (n, 2) array for use within one substep; its contents are left over from whoever used it last."""
        while len(self._scratch) <= number:
            self._scratch.append(np.empty_like(self.position))
        return self._scratch[number]

    def slot_of(self, particle: int) -> int:
        """The slot that holds the user's particle."""
        if self._slot_of is None:
            self._slot_of = np.empty_like(self.particle)
            self._slot_of[self.particle] = np.arange(len(self), dtype=self.particle.dtype)
        return int(self._slot_of[particle])

    def slots_of(self, particles: Array) -> Array:
        """(k,) slots that hold these of the user's particles."""
        if len(particles):
            self.slot_of(0)
        return np.zeros(0, np.int32) if self._slot_of is None else self._slot_of[particles]


def advance(out: Array, base: Array, slope: Array, h: float) -> None:
    """out = base + h * slope on (n, 2) arrays; the move every integrator is made of. out may be base."""
    if len(out) < SERIAL_BELOW:
        motion.advance_serial(out, base, slope, out.dtype.type(h))
    else:
        motion.advance_parallel(out, base, slope, out.dtype.type(h))


def farthest(position: Array, reference: Array) -> float:
    """The largest distance any particle has moved from its row of `reference`, m."""
    if len(position) < SERIAL_BELOW:
        return float(np.sqrt(motion.farthest_serial(position, reference)))
    return float(np.sqrt(motion.farthest_parallel(position, reference)))


class Group:
    """A handle on particles that were added together; valid whatever order the engine keeps inside.

    Its arrays are views on the world's, in the order the particles were added: reading copies nothing, and writing into them
    (`group.velocity[0] = 1, 0`) changes the world. Fetch them anew after adding or removing particles: the world may have moved
    its arrays. Who was removed is no longer among them; with nobody left, asking for them raises InputError.
    """

    def __init__(self, state: State, where: slice, remove: Callable[[Array], None]) -> None:
        self._state = state
        self._remove = remove
        self._found = where
        self._version = state.version
        self._added = where.stop - where.start
        self._first = int(state.number[where.start]) if self._added else 0
        self._stop = self._first + self._added

    def __len__(self) -> int:
        where = self._span()
        return int(where.stop - where.start)

    def __repr__(self) -> str:
        if not len(self):
            return f"Group of {self._added} particles, all removed" if self._added else "Group of 0 particles"
        return f"Group of {len(self)} particles, {self._found.start} to {self._found.stop - 1}"

    def _span(self) -> slice:
        """Where they are among the world's now; numbers stay in order, so that those added together stay together."""
        if self._version != self._state.version:
            self._found, self._version = self._state.find(self._first, self._stop), self._state.version
        return self._found

    @property
    def _where(self) -> slice:
        """As `_span`; refused if there is nobody left."""
        where = self._span()
        if where.start == where.stop and self._added:
            raise InputError(f"group is one of {self._added} particles that were all removed; allowed is one with particles left")
        return where

    def remove(self, which: ArrayLike | None = None) -> None:
        """Remove particles of this group from the world; other groups stay as they are.

        Args:
            which: index or indices within the group, or (n,) bool; None removes all. Many at once cost as much as one.

        Raises:
            InputError: there is no such particle, or all were removed before; nothing is removed.
        """
        index = self.index
        self._remove(index if which is None else index[checks.indices("which", which, len(index))])

    @property
    def index(self) -> NDArray[np.int64]:
        """(n,) indices of these particles among all of the world's."""
        where = self._where
        return np.arange(where.start, where.stop)

    @property
    def position(self) -> Array:
        """(n, 2) centres, m."""
        return self._state.position[self._where]

    @position.setter
    def position(self, value: Any) -> None:
        self._state.position[self._where] = value

    @property
    def velocity(self) -> Array:
        """(n, 2) m/s."""
        return self._state.velocity[self._where]

    @velocity.setter
    def velocity(self, value: Any) -> None:
        self._state.velocity[self._where] = value

    @property
    def spin(self) -> Array:
        """(n,) angular velocity, rad/s, counter-clockwise."""
        return self._state.spin[self._where]

    @spin.setter
    def spin(self, value: Any) -> None:
        self._state.spin[self._where] = value

    @property
    def radius(self) -> Array:
        """(n,) m."""
        return self._state.radius[self._where]

    @radius.setter
    def radius(self, value: Any) -> None:
        self._state.radius[self._where] = value

    @property
    def mass(self) -> Array:
        """(n,) kg; infinity pins a particle."""
        return self._state.mass[self._where]

    @mass.setter
    def mass(self, value: Any) -> None:
        self._state.mass[self._where] = value
