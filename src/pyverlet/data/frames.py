"""A moment of a recorded world, and where moments go to and come from: what every format of a trajectory has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.arrays import Array
from pyverlet.world.world import World

ROOM = 1.5  # half sides of the box of a world without bounds, in terms of how far its circles reach


@dataclass(frozen=True, eq=False)
class Frame:
    """A world at a moment, in the order its particles were added.

    Attributes:
        time: s.
        position: (n, 2) centres, m.
        velocity: (n, 2) m/s.
        spin: (n,) rad/s, counter-clockwise.
        radius: (n,) m.
        mass: (n,) kg, infinite where pinned.
        number: (n,) of each particle, ascending: it keeps that while others come and go.
        state_hash: of the world at that moment, `World.state_hash`.
    """

    time: float
    position: Array
    velocity: Array
    spin: Array
    radius: Array
    mass: Array
    number: NDArray[np.int64]
    state_hash: str

    def __len__(self) -> int:
        return len(self.radius)

    @classmethod
    def of(cls, world: World) -> Frame:
        """The world now: views on its arrays, good until it moves."""
        columns = (world.position, world.velocity, world.spin, world.radius, world.mass, world.number)
        return cls(float(world.time), *columns, world.state_hash())


class Column:
    """A read-only array of an object, documented by its text: what the object's `_column(name)` returns."""

    def __init__(self, doc: str) -> None:
        self.__doc__ = doc

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, owner: Any, kind: type) -> Array:
        array: Any = self if owner is None else owner._column(self._name)
        return array  # type: ignore[no-any-return]

    def __set__(self, owner: Any, value: Any) -> None:
        raise AttributeError(f"{self._name} of {type(owner).__name__} cannot be replaced; allowed is to read it")


class Writer(ABC):
    """Appends moments to a new file, its argument. What `add` has written can be read whatever happens to this program."""

    needs: ClassVar[str | None] = None
    _file: Any

    @abstractmethod
    def add(self, frame: Frame, world: World) -> None:
        """Append a moment. Raises OSError where the disk does not take it."""

    def close(self) -> None:
        self._file.close()


class Reader(ABC):
    """Reads moments of a file, its argument, in any order. OSError, or ValueError with a reason if it is not such a file."""

    needs: ClassVar[str | None] = None
    _file: Any

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def frame(self, k: int) -> Frame:
        """Moment k, from 0."""

    def close(self) -> None:
        self._file.close()


class Walls:
    """A box (x0, y0, x1, y1) in metres around a world: its bounds, or where its circles are and some room; it never shrinks."""

    def __init__(self) -> None:
        self._box: Array | None = None

    def around(self, frame: Frame, world: World) -> tuple[float, float, float, float]:
        """The box now."""
        box: Any = world.boundary.extent()
        old = self._box
        if box is None:
            reach = frame.radius.max(initial=0.0)
            low, high = (f(frame.position, axis=0) for f in (np.min, np.max)) if len(frame) else (np.zeros(2), np.ones(2))
            low, high = low - reach, high + reach
            if old is None or (low < old[:2]).any() or (high > old[2:]).any():
                if old is not None:
                    low, high = np.minimum(low, old[:2]), np.maximum(high, old[2:])
                more = (ROOM - 1.0) * (high - low) / 2
                self._box = np.concatenate((low - more, high + more)).astype(float)
            box = self._box
        x0, y0, x1, y1 = map(float, box)
        return x0, y0, x1, y1
