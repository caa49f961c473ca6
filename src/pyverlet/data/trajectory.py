"""Trajectories: frames of a world in a file for other programs, and such files as arrays; the parts common to all formats."""

import importlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Self, overload

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Array
from pyverlet.common.errors import InputError, PyverletError
from pyverlet.common.interrupts import without_interrupts
from pyverlet.common.outside import file_errors, require
from pyverlet.common.progress import OnProgress
from pyverlet.common.shown import Shown
from pyverlet.data.atomic_file import Closing
from pyverlet.world.world import World

ROOM = 1.5  # half width of the box of an unbounded world, over the extent of its circles


@dataclass(frozen=True, eq=False)
class Frame:
    """A world at one time, in the order its particles were added.

    Attributes:
        time: s.
        position: (n, 2) centres, m.
        velocity: (n, 2) m/s.
        spin: (n,) rad/s, counter-clockwise.
        radius: (n,) m.
        mass: (n,) kg, infinite where pinned.
        number: (n,) permanent number of each particle, ascending.
        state_hash: `World.state_hash` at that time.
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
    def of(cls, world: World) -> Self:
        """The current state of a world: views of its arrays, valid until it changes."""
        columns = (world.position, world.velocity, world.spin, world.radius, world.mass, world.number)
        return cls(float(world.time), *columns, world.state_hash())


class Column:
    """A documented read-only array of an object: the result of the object's `_column(name)`."""

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
    """Base class of writers: appends frames to a new file. What `add` has written is readable even if the program crashes."""

    _file: Any

    @abstractmethod
    def add(self, frame: Frame, world: World) -> None:
        """Append a frame. Raises OSError if the disk refuses it."""

    def close(self) -> None:
        self._file.close()


class Reader(ABC):
    """Base class of readers: reads frames of a file in any order. OSError, or ValueError with a reason if it is unsuitable."""

    _file: Any

    @abstractmethod
    def __len__(self) -> int: ...

    @abstractmethod
    def frame(self, k: int) -> Frame:
        """Frame k, from 0."""

    def close(self) -> None:
        self._file.close()


class Walls:
    """A box (x0, y0, x1, y1), m, around a world: its bounds, or its circles with a margin; it never shrinks."""

    def __init__(self) -> None:
        self._box: Array | None = None

    def around(self, frame: Frame, world: World) -> tuple[float, float, float, float]:
        """The current box."""
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


_XYZ, _VTK = ("xyz", "Xyz"), ("vtkhdf", "VtkHdf", "h5py")

FORMATS: dict[str, tuple[str, ...]] = {
    ".gsd": ("gsd", "Gsd", "gsd"), ".xyz": _XYZ, ".extxyz": _XYZ, ".vtkhdf": _VTK, ".hdf": _VTK,
}  # fmt: skip
"""By suffix the module here, the prefix of its Writer and Reader, and its requirement. A new format is a module and an entry."""


class Trajectory(Shown, Closing):
    """Writes frames of a world to a file; a context manager.

        with pv.Trajectory("silo.gsd", every=10) as film:
            film.run(world, seconds=20)

    Every frame has time, positions, velocities, spins, radii, masses, the particles' numbers and the world's hash. An existing
    file is replaced. Frames already added are readable even if the program crashes.

    Args:
        path: .gsd (HOOMD's format: OVITO, freud, MDAnalysis), .xyz (extended XYZ, text: OVITO, ASE) or .vtkhdf (ParaView). The
            first and the last need the extra `data`.
        every: frames of the world per frame of the file, in `run`.

    Attributes:
        frames: number of frames in the file.

    Raises:
        InputError: the suffix is unknown, a library is missing, or the file cannot be written.
    """

    _shows = ("path", "every", "frames")

    def __init__(self, path: str | Path, *, every: int = 1) -> None:
        self.path = checks.path("path", path)
        self.every = checks.integer("every", every)
        self.frames = 0
        self._last: tuple[int, float] | None = None
        kind = _kind(self.path, "Writer")
        with file_errors("path", self.path, "written"):
            self._writer: Writer | None = kind(self.path)

    def add(self, world: World) -> None:
        """Write the current state of the world.

        Raises:
            InputError: the trajectory is closed.
            PyverletError: the disk is full; the file has the frames added before.
        """
        if self._writer is None:
            raise InputError(f"trajectory '{self.path}' is closed; allowed is one in its with statement")
        try:
            with without_interrupts:  # Ctrl-C is delayed until the whole frame is in the file
                self._writer.add(Frame.of(world), world)
        except OSError as error:
            reason = error.strerror or error
            raise PyverletError(f"'{self.path}' cannot be written any more: {reason}; it holds {self.frames} frames") from None
        self.frames += 1
        self._last = (id(world), world.time)

    def run(self, world: World, *, seconds: float, dt: float = 1 / 60, progress: OnProgress | None = None) -> None:
        """Step the world, and write its state now and after every `every` frames.

        Args:
            world: stepped in place.
            seconds: as for `World.run`.
            dt: s, of a frame.
            progress: called as progress(done, total) after every frame.

        Raises:
            InputError: a value is outside what is allowed.
            NonFiniteError: the world turned NaN or infinite; the file has the frames before.
        """
        seconds, dt = checks.number("seconds", seconds, least=0.0), checks.number("dt", dt, above=0.0)
        total = round(seconds / dt)
        if self._last != (id(world), world.time):  # a second run continues after the last frame of the first
            self.add(world)
        for done in range(1, total + 1):
            world.step(dt)
            if done % self.every == 0:
                self.add(world)
            if progress:
                progress(done, total)

    def close(self) -> None:
        """Close the file."""
        writer, self._writer = self._writer, None
        if writer is not None:
            try:
                writer.close()
            except OSError as error:
                raise PyverletError(f"'{self.path}' cannot be written any more: {error.strerror or error}") from None


class Moments(Sequence[Frame], Closing):
    """A trajectory read from a file: a sequence of frames, and columns of all frames, each read on demand.

    Made by `read_trajectory`. Its file is closed at the end of a with statement, or when it is no longer used.
    """

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self._closed = False

    def __len__(self) -> int:
        return len(self._reader)

    @overload
    def __getitem__(self, index: int) -> Frame: ...
    @overload
    def __getitem__(self, index: slice) -> list[Frame]: ...
    def __getitem__(self, index: int | slice) -> Frame | list[Frame]:
        where = range(len(self))[index]
        return self._reader.frame(where) if isinstance(where, int) else [self._reader.frame(k) for k in where]

    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        if not self._closed:
            self._closed = True
            self._reader.close()

    @property
    def time(self) -> NDArray[np.float64]:
        """(m,) times of the frames, s."""
        return np.array([frame.time for frame in self])

    @property
    def particles(self) -> NDArray[np.int64]:
        """(m,) number of particles in each frame."""
        return np.array([len(frame) for frame in self], np.int64)

    @property
    def state_hash(self) -> list[str]:
        """State hash of each frame."""
        return [frame.state_hash for frame in self]

    position = Column("(m, n, 2) m. This and all that follow: InputError unless all frames have the same particles.")
    velocity = Column("(m, n, 2) m/s.")
    spin = Column("(m, n) rad/s.")
    radius = Column("(m, n) m.")
    mass = Column("(m, n) kg.")

    def _column(self, name: str) -> Array:
        frames = list(self)
        for k, (before, frame) in enumerate(pairwise(frames)):
            if not np.array_equal(before.number, frame.number):
                raise InputError(
                    f"{name} of all frames is no array: particles came or went before frame {k + 1}; ask frame by frame"
                )
        return np.array([getattr(frame, name) for frame in frames])


def read_trajectory(path: str | Path) -> Moments:
    """Read the frames of a file that `Trajectory` wrote, or of any GSD file.

        film = pv.read_trajectory("silo.gsd")
        film.time                 # (m,) s
        film[-1].position         # (n, 2) m, of the last frame
        film.position             # (m, n, 2), if no particles were added or removed

    Raises:
        InputError: the file is missing, of another kind, or a library is missing.
    """
    path = checks.path("path", path)
    kind = _kind(path, "Reader")
    try:
        return Moments(kind(path))
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise InputError(f"path is '{path}', which cannot be read as a trajectory: {reason}") from None


def _kind(path: Path, what: str) -> Any:
    found = FORMATS.get(path.suffix.lower())
    if found is None:
        raise InputError(f"path is '{path}'; allowed for a trajectory is a name that ends in {', '.join(FORMATS)}")
    module, name, *needs = found
    require(f"a {path.suffix} file", *needs, extra="data")
    return getattr(importlib.import_module(f"pyverlet.data.{module}"), name + what)
