"""Handles on particles: `Group` for those added together, and `Columns`, shared with `World`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.errors import IndexInputError, InputError
from pyverlet.state.data import Data
from pyverlet.state.state import State


class Column:
    """A property of a group or of the whole world: a view of its part of one of the state's arrays. Setting it copies.

    For picked particles it is a read-only copy; and so it is while another thread runs a frame, of the results of that frame.
    """

    def __init__(self, doc: str) -> None:
        self.__doc__ = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, group: Any, owner: type) -> Array:
        state: State = group._state
        version = state.version
        array: Array = getattr(state, self._name)[where := group._where]
        if state.version == version and not state.lock.taken and not isinstance(where, np.ndarray):
            return array  # unchanged meanwhile: no lock was needed
        with state.lock as stepped:
            array = getattr(state, self._name)[where := group._where]
            if (stepped or isinstance(where, np.ndarray)) and isinstance(array, np.ndarray):
                array = array.copy()
                array.flags.writeable = False
            return array

    def __set__(self, group: Any, value: Any) -> None:
        with group._state.lock.held():
            array = getattr(group._state, self._name)
            array[group._where] = checks.values_for(self._name, value, array[group._where])


class Measured(Column):
    """A derived property: a read-only copy."""

    def __get__(self, group: Any, owner: type) -> Array:
        found = np.array(super().__get__(group, owner))
        found.flags.writeable = False
        return found

    def __set__(self, group: Any, value: Any) -> None:
        raise InputError(f"{self._name} is only to be read; allowed is to write position")


class Columns:
    """Arrays of particles by name, for a group, one particle, or a whole world."""

    _state: State
    _where: Any
    """Their indices among the world's particles."""
    _whole = False
    """Whether these are all particles."""

    position = Column("(n, 2) centres in the order the particles were added, m; a view, as all of these but for copies.")
    unwrapped = Measured("(n, 2) centres as if a periodic room did not repeat, m, float64: whole periods count on; a copy.")
    velocity = Column("(n, 2) m/s.")
    spin = Column("(n,) angular velocity, rad/s, counter-clockwise.")
    angle = Column("(n,) rad they have turned, counter-clockwise, float64 whatever the dtype: it grows and grows.")
    radius = Column("(n,) m.")
    mass = Column("(n,) kg; infinity pins a particle.")
    restitution = Column("(n,) e of circles that have their own, negative where `Collisions` and the bounds decide.")
    friction = Column("(n,) mu of circles that have their own, negative where `Collisions` and the bounds decide.")
    rolling_resistance = Column("(n,) c of circles that have their own, else negative as for friction.")
    inertia = Column("(n,) kg m^2, moments of inertia; 0: those of discs.")
    category = Column("(n,) uint32, the bits of what each circle is.")
    mask = Column("(n,) uint32, the bits of the categories it collides with.")
    fixed_rotation = Column("(n,) uint32, 1 of circles that nothing turns, else 0; set it to True or False.")

    @property
    def material(self) -> NDArray[np.str_]:
        """(n,) names of materials, "" for none; set them as in `add`. A copy."""
        names: NDArray[np.str_] = np.array(self._state.materials)[self._state.material[self._where]]
        return names

    @material.setter
    def material(self, names: Any) -> None:
        old = self._state.material[self._where]
        self._state.material[self._where] = self._material_numbers(names, np.size(old)).reshape(np.shape(old))

    def _material_numbers(self, names: Any, count: int) -> Array:
        return self._state.material_numbers(names, count)

    @property
    def data(self) -> Data:
        """User-defined arrays of these particles by name: `world.data["age"] = 0.0`."""
        return Data(self)


class Handle(Columns):
    """Base class of handles on particles of a world."""

    _remove: Callable[[Array], None]

    @property
    def _who(self) -> tuple[Any, ...]:
        """The identity, by permanent numbers: handles of a world on the same particles are equal."""
        raise NotImplementedError

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Handle) and other._state is self._state and other._who == self._who

    def __hash__(self) -> int:
        return hash((id(self._state), self._who))

    @property
    def world(self) -> Any:
        """The world of these particles."""
        return self._remove.__self__  # type: ignore[attr-defined]

    def move_to(self, position: ArrayLike) -> None:
        """Move particles at once, without motion: they meet nothing on the way and push nothing.

        Velocities, spins and angles stay. Contacts are forgotten, links to others and pins pull from the new place, sleepers
        wake, `unwrapped` becomes the position given, and a ledger has the change of energy under `outside`.

        Args:
            position: (2,), m, for the mean of their centres, keeping their shape; or (n, 2), for each.

        Raises:
            InputError: shapes disagree, or the centre of a free particle would be inside an obstacle or outside the room; nothing
                is moved.
        """
        self.world._move_to(self, position)


class Group(Handle):
    """A handle on particles that were added together; valid whatever the engine's internal order.

    Its arrays are views of the world's, in the order the particles were added: reading copies nothing, and writing into them
    (`group.velocity[0] = 1, 0`) changes the world. Fetch them again after adding or removing particles: the world may have moved
    its arrays. Removed particles are no longer included; for an empty group, reading them raises InputError.

    Indexing is NumPy's, among the remaining particles: `group[2]` and `group[-1]` are a `Particle`, `group[1:5]` is a group whose
    arrays are views, and `for particle in group` loops over each. `group[::2]`, `group[[0, 3]]` and `group[mask]` pick particles:
    a group whose arrays are copies, which can be set as a whole (`group[[0, 3]].velocity = 0`).
    """

    def __init__(self, state: State, first: int, added: int, remove: Callable[[Array], None]) -> None:
        self._state, self._remove, self._version = state, remove, -1
        self._first, self._stop, self._added = first, first + added, added  # their permanent numbers
        self._found: Any = slice(0, 0)
        self._count = 0

    @property
    def _who(self) -> tuple[Any, ...]:
        return "from", self._first, self._stop

    def __len__(self) -> int:
        self._left()
        return self._count

    def __getitem__(self, which: Any) -> Any:
        with self._state.lock:
            numbers = self._state.number[self._where]
            try:
                picked = np.array(numbers[which])
            except (IndexError, TypeError, ValueError) as error:
                raise IndexInputError(f"index is {which!r} in a group of {len(self)} particles; {error}") from None
            if picked.ndim == 0:
                return Particle(self._state, int(picked), self._remove)
            if picked.ndim > 1:
                raise IndexInputError(
                    f"index is {which!r}; allowed are an index, several in a list, a slice, or {len(self)} bools"
                )
            if isinstance(which, slice) and which.step in (None, 1) and len(picked):
                found = Group(self._state, int(picked[0]), len(picked), self._remove)
                found._stop = int(picked[-1]) + 1
                return found
            return Picked(self._state, picked, self._remove)

    def __iter__(self) -> Iterator[Particle]:
        """Loop over the particles, skipping those removed meanwhile."""
        for number in self._state.number[self._left()].tolist():
            if (particle := Particle(self._state, number, self._remove)).is_there:
                yield particle

    def __repr__(self) -> str:
        if not len(self):
            return f"Group of {self._added} particles, all removed" if self._added else "Group of 0 particles"
        return f"Group of {len(self)} particles, {self._found.start} to {self._found.stop - 1}"

    def _left(self) -> Any:
        """Indices of the remaining particles in the world."""
        if self._version != self._state.version:
            with self._state.lock:
                self._found, self._version = self._find(), self._state.version
                self._count = len(self._state.number[self._found])
        return self._found

    def _find(self) -> Any:
        """Search by permanent numbers, which ascend, so that particles added together stay together."""
        return self._state.find(self._first, self._stop)

    @property
    def _where(self) -> Any:
        """As `_left`; raises InputError if no particle is left."""
        where = self._left()
        if not self._count and self._added:
            raise InputError(f"group is one of {self._added} particles that were all removed; allowed is one with particles left")
        return where

    def remove(self, which: ArrayLike | None = None) -> None:
        """Remove particles of this group from the world; other groups stay as they are.

        Args:
            which: index or indices within the group, or (n,) bool; None removes all. Removing many at once costs as much as one.

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

    def pin(self, index: Any = slice(None)) -> None:
        """Make particles immovable where they are: infinite mass, no velocity. Setting a mass releases them.

        Args:
            index: one in this group, or several, or a slice; all by default.

        Raises:
            InputError: there is no such particle.
        """
        state = self._state
        with state.lock.held():
            try:
                pinned = self.index[index]
            except IndexError:
                raise InputError(f"index is {index!r}; allowed are indices of this group's {len(self)} particles") from None
            state.mass[pinned], state.velocity[pinned], state.spin[pinned] = np.inf, 0.0, 0.0


class Picked(Group):
    """Particles picked from a group, in the order they were picked. Its arrays are copies; set them as a whole."""

    def __init__(self, state: State, numbers: NDArray[np.int64], remove: Callable[[Array], None]) -> None:
        super().__init__(state, 0, len(numbers), remove)
        self._numbers = numbers

    @property
    def _who(self) -> tuple[int, ...]:
        return tuple(self._numbers.tolist())

    def _find(self) -> NDArray[np.int64]:
        where = self._state.index_of(self._numbers)
        return where[where >= 0]

    def __repr__(self) -> str:
        gone = self._added - len(self)
        return f"Group of {len(self)} particles, picked out{f', {gone} removed' if gone else ''}"

    @property
    def index(self) -> NDArray[np.int64]:
        return np.array(self._where)


class Particle(Handle):
    """A handle on one particle: `group[2]`. It has the attributes of a group: `ball.velocity = (1, 0)`, `ball.mass = 2`."""

    def __init__(self, state: State, number: int, remove: Callable[[Array], None]) -> None:
        self._state, self._remove = state, remove
        self.number = number
        """Its permanent number, unique in the world."""

    @property
    def _who(self) -> tuple[str, int]:
        return "one", self.number

    def __repr__(self) -> str:
        if not self.is_there:
            return f"Particle {self.number}, removed"
        x, y = self.position
        return f"Particle {self.index} at ({x:g}, {y:g}) m"

    @property
    def is_there(self) -> bool:
        """Whether it has not been removed."""
        with self._state.lock:
            return bool(self._state.index_of(np.array(self.number)) >= 0)

    @property
    def index(self) -> int:
        """Its current index among all of the world's particles; InputError if it was removed."""
        with self._state.lock:
            where = int(self._state.index_of(np.array(self.number)))
        if where < 0:
            raise InputError(f"particle {self.number} was removed; allowed is one that is there")
        return where

    @property
    def _where(self) -> int:
        return self.index

    def remove(self) -> None:
        """Remove it from its world."""
        self._remove(np.array([self.index]))

    def pin(self) -> None:
        """Make it immovable where it is."""
        self.mass, self.velocity, self.spin = np.inf, 0.0, 0.0


def members(group: Group | None) -> Any:
    """The world's particles on which a force acts: all for None, none for an empty group."""
    if group is None:
        return slice(None)
    return group.index if len(group) else np.empty(0, np.int64)


def check_home(name: str, group: Any, state: State) -> None:
    """Raise InputError if a group or a particle belongs to another world than this state's; other objects pass."""
    if isinstance(group, Handle) and group._state is not state:
        raise InputError(f"{name} is {group!r} of another world; allowed are particles of this one")


def checked_group(name: str, group: Any) -> Group | None:
    """The checked group on which a force acts; None for all.

    Raises:
        InputError: it is not a group.
    """
    if group is None or isinstance(group, Group):
        return group
    raise InputError(f"{name} is {group!r}; allowed is what `add` has returned, particles picked out of it, or None for all")
