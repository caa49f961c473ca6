"""Trajectories: a world's moments in a file that other programs open, and such a file as arrays."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from pyverlet.data.frames import Column, Frame, Reader, Writer
from pyverlet.ground import checks
from pyverlet.ground.arrays import Array
from pyverlet.ground.errors import InputError, PyverletError
from pyverlet.ground.outside import file_errors, require
from pyverlet.ground.progress import OnProgress
from pyverlet.ground.shown import Shown
from pyverlet.world.world import World

FORMATS = {".gsd": "gsd.Gsd", ".xyz": "xyz.Xyz", ".extxyz": "xyz.Xyz", ".vtkhdf": "vtkhdf.VtkHdf", ".hdf": "vtkhdf.VtkHdf"}
"""By suffix the module here and what its Writer and Reader begin with. A new format is a module and an entry."""


class Trajectory(Shown):
    """Keeps moments of a world in a file; use it in a with statement.

        with pv.Trajectory("silo.gsd", every=10) as film:
            film.run(world, seconds=20)

    Every moment holds time, positions, velocities, spins, radii, masses, the particles' numbers and the world's hash. A file that
    exists is replaced. What was added can be read whatever ends the program.

    Args:
        path: .gsd (HOOMD's format: OVITO, freud, MDAnalysis), .xyz (extended XYZ, text: OVITO, ASE) or .vtkhdf (ParaView). The
            first and the last need the extra `data`.
        every: frames of the world from one moment to the next, in `run`.

    Attributes:
        frames: moments in the file.

    Raises:
        InputError: the suffix is unknown, a library is missing, or the file cannot be written.
    """

    _shows = ("path", "every", "frames")

    def __init__(self, path: str | Path, *, every: int = 1) -> None:
        self.path = Path(path)
        self.every = checks.whole("every", every)
        self.frames = 0
        self._last: tuple[int, float] | None = None
        kind = _kind(self.path, "Writer")
        with file_errors("path", self.path, "written"):
            self._writer: Writer | None = kind(self.path)

    def __enter__(self) -> Trajectory:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def add(self, world: World) -> None:
        """Keep the world as it is now.

        Raises:
            InputError: the trajectory is closed.
            PyverletError: the disk is full; the file holds what was added before.
        """
        if self._writer is None:
            raise InputError(f"trajectory '{self.path}' is closed; allowed is one in its with statement")
        try:
            self._writer.add(Frame.of(world), world)
        except OSError as error:
            reason = error.strerror or error
            raise PyverletError(f"'{self.path}' cannot be written any more: {reason}; it holds {self.frames} frames") from None
        self.frames += 1
        self._last = (id(world), world.time)

    def run(self, world: World, *, seconds: float, dt: float = 1 / 60, progress: OnProgress | None = None) -> None:
        """Step the world, and keep it as it is now and after every `every` frames.

        Args:
            world: stepped in place.
            seconds: as for `World.run`.
            dt: s, of a frame.
            progress: called as progress(done, total) after every frame.

        Raises:
            InputError: a value is outside what is allowed.
            NonFiniteError: the world turned NaN or infinite; the file holds what was before.
        """
        seconds, dt = checks.number("seconds", seconds, least=0.0), checks.number("dt", dt, above=0.0)
        total = round(seconds / dt)
        if self._last != (id(world), world.time):  # a second run goes on from the last moment of the first
            self.add(world)
        for done in range(1, total + 1):
            world.step(dt)
            if done % self.every == 0:
                self.add(world)
            if progress:
                progress(done, total)

    def close(self) -> None:
        """Close the file. What was added stays."""
        writer, self._writer = self._writer, None
        if writer is not None:
            try:
                writer.close()
            except OSError as error:
                raise PyverletError(f"'{self.path}' cannot be written any more: {error.strerror or error}") from None


class Moments(Sequence[Frame]):
    """A trajectory read from a file: a sequence of frames, and whole columns of those. Each is read when it is asked for.

    Made by `read_trajectory`. Closes its file when it is no longer used, or at the end of a with statement.
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

    def __enter__(self) -> Moments:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __del__(self) -> None:
        self.close()

    def close(self) -> None:
        if not self._closed:
            self._closed = True
            self._reader.close()

    @property
    def time(self) -> NDArray[np.float64]:
        """(m,) s, of each frame."""
        return np.array([frame.time for frame in self])

    @property
    def particles(self) -> NDArray[np.int64]:
        """(m,) particles of each frame."""
        return np.array([len(frame) for frame in self], np.int64)

    @property
    def state_hash(self) -> list[str]:
        """Of each frame."""
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
    """The moments in a file that `Trajectory` wrote, or in any GSD file.

        film = pv.read_trajectory("silo.gsd")
        film.time                 # (m,) s
        film[-1].position         # (n, 2) m, of the last frame
        film.position             # (m, n, 2), if the particles stayed the same

    Raises:
        InputError: there is no such file, it is of another kind, or a library is missing.
    """
    path = Path(path)
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
    module, _, name = found.partition(".")
    kind = getattr(importlib.import_module(f"pyverlet.data.{module}"), name + what)
    require(f"a {path.suffix} file", *([kind.needs] if kind.needs else []), extra="data")
    return kind
