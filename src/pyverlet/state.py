"""Where the numbers live: `State` in the order the user added particles, `Slots` in the order the engine likes.

The user's arrays are the truth between frames. A frame begins by gathering them into slots, sorted so that neighbours in
space are neighbours in memory, and ends by scattering the result back; nobody outside ever sees the engine's order.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.constants import SERIAL_BELOW
from pyverlet.errors import InputError
from pyverlet.kernels import motion

Array = NDArray[Any]

_ROWS = ("position", "velocity", "acceleration")
_COLUMNS = ("spin", "radius", "mass", "grown")


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
    """

    position: Array
    velocity: Array
    acceleration: Array
    spin: Array
    radius: Array
    mass: Array
    grown: Array

    def __init__(self, dtype: np.dtype[Any]) -> None:
        self.dtype = dtype
        self._store: dict[str, Array] = {name: np.empty((0, 2), dtype) for name in _ROWS}
        self._store |= {name: np.empty(0, dtype) for name in _COLUMNS}
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
                self._store[name] = np.empty((capacity, *old.shape[1:]), self.dtype)
                self._store[name][:start] = old[:start]
        self._show(stop)
        for name, value in values.items():
            getattr(self, name)[start:stop] = value
        return slice(start, stop)

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
        self._resize(0)

    def __len__(self) -> int:
        return len(self.radius)

    def _resize(self, count: int) -> None:
        self.particle = np.arange(count, dtype=np.int32)
        for name in (*_ROWS, "force"):
            setattr(self, name, np.zeros((count, 2), self.dtype))
        for name in (*_COLUMNS, "inverse_mass"):
            setattr(self, name, np.zeros(count, self.dtype))
        self.start = np.zeros((count, 2), self.dtype)
        self.size = self.radius
        self.resting = np.zeros(count, np.uint8)
        self.fed = np.zeros(count, np.uint8)
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
        resized = len(state) != len(self)
        if resized:
            self._resize(len(state))
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
        self._resize(len(saved[0]))
        self.particle[:], self.fed[:] = saved
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
    (`group.velocity[0] = 1, 0`) changes the world. Fetch them anew after adding particles: the world may have moved its arrays.
    """

    def __init__(self, state: State, where: slice) -> None:
        self._state = state
        self._where = where

    def __len__(self) -> int:
        return int(self._where.stop - self._where.start)

    def __repr__(self) -> str:
        return f"Group of {len(self)} particles, {self._where.start} to {self._where.stop - 1}"

    @property
    def index(self) -> NDArray[np.int64]:
        """(n,) indices of these particles among all of the world's."""
        return np.arange(self._where.start, self._where.stop)

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

    def pin(self, index: Any = slice(None)) -> None:
        """Make particles immovable where they are: mass infinite, no velocity. Give them a mass again to let go.

        Args:
            index: in this group, or several, or a slice; all of them unless said.

        Raises:
            InputError: there is no such particle.
        """
        try:
            self.mass[index], self.velocity[index], self.spin[index] = np.inf, 0.0, 0.0
        except IndexError:
            raise InputError(f"index is {index!r}; allowed are indices of this group's {len(self)} particles") from None
