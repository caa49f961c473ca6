"""Handles on particles: `Group`, those that were added together."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.state.state import State

Array = NDArray[Any]


class Column:
    """A property of a group, or of the whole world: a view on its part of one of the state's arrays. Setting it copies.

    While another thread makes a frame it is a copy, not to be written, of what that frame comes to.
    """

    def __init__(self, doc: str) -> None:
        self.__doc__ = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, group: Any, owner: type) -> Array:
        state: State = group._state
        version = state.version
        array: Array = getattr(state, self._name)[group._where]
        if state.version == version and not state.turn.taken:  # nothing has changed meanwhile, and no lock was needed
            return array
        with state.turn as stepped:
            array = getattr(state, self._name)[group._where]
            if stepped:
                array = array.copy()
                array.flags.writeable = False
            return array

    def __set__(self, group: Any, value: Any) -> None:
        with group._state.turn.held():
            getattr(group._state, self._name)[group._where] = value


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

    @classmethod
    def of(cls, state: State, first: int, added: int, remove: Callable[[Array], None]) -> Group:
        """The group of `added` particles that were added together and have the numbers from `first` on."""
        group = cls(state, slice(0, 0), remove)
        group._first, group._added, group._stop = first, added, first + added
        group._version = -1  # to be looked for
        return group

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
            with self._state.turn:
                self._found, self._version = self._state.find(self._first, self._stop), self._state.version
        return self._found

    @property
    def _where(self) -> slice:
        """As `_span`; refused if there is nobody left."""
        where = self._span()
        if where.start == where.stop and self._added:
            raise InputError(f"group is one of {self._added} particles that were all removed; allowed is one with particles left")
        return where

    @property
    def world(self) -> Any:
        """The world they are in."""
        return self._remove.__self__  # type: ignore[attr-defined]

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

    position = Column("(n, 2) centres, m.")
    velocity = Column("(n, 2) m/s.")
    spin = Column("(n,) angular velocity, rad/s, counter-clockwise.")
    angle = Column("(n,) rad they have turned, counter-clockwise; float64.")
    radius = Column("(n,) m.")
    mass = Column("(n,) kg; infinity pins a particle.")
    restitution = Column("(n,) e of these circles; negative: as the world's `Collisions` and bounds say.")
    friction = Column("(n,) mu of these circles; negative: as the world's `Collisions` and bounds say.")
    category = Column("(n,) uint32, the bits of what these circles are.")
    mask = Column("(n,) uint32, the bits of the categories they collide with.")

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
