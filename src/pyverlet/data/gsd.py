"""GSD, the file of HOOMD-blue: read by OVITO, freud and MDAnalysis. By the library of that name."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pyverlet.data.frames import Array, Frame, Reader, Walls, Writer

if TYPE_CHECKING:
    from pyverlet.world.world import World

# Frames keep float32 under the names of the format. What it has no name for, and the doubles of worlds in float64, go here.
_LOGGED = ("spin", "number")
_DOUBLES = ("position", "velocity")


class GsdWriter(Writer):
    """Chunks that are as in the first frame are not written again."""

    needs = "gsd"

    def __init__(self, path: Path) -> None:
        import gsd.hoomd

        self._hoomd: Any = gsd.hoomd
        self._file: Any = gsd.hoomd.open(str(path), "w")
        self._first: dict[str, Array] = {}
        self._walls = Walls()

    def add(self, frame: Frame, world: World) -> None:
        snap = self._hoomd.Frame()
        box = self._walls.around(frame, world)
        half = np.maximum(np.abs(box[:2]), np.abs(box[2:]))  # the format's box has its middle at the origin
        snap.configuration.step = world.frames
        snap.configuration.dimensions = 2
        snap.configuration.box = [2 * half[0], 2 * half[1], 0, 0, 0, 0]
        particles = snap.particles
        particles.N = len(frame)
        particles.types = ["circle"]
        particles.position = _flat(frame.position)
        particles.velocity = _flat(frame.velocity)
        particles.diameter = (2 * frame.radius).astype(np.float32)
        particles.mass = frame.mass.astype(np.float32)
        joined = world.links.pulls()[0]
        snap.bonds.N = len(joined)
        if len(joined):
            snap.bonds.types = ["link"]
            snap.bonds.group = joined.astype(np.uint32)
        logged = {f"particles/{name}": getattr(frame, name) for name in _LOGGED}
        if frame.position.dtype == np.float64:
            logged |= {f"particles/{name}": getattr(frame, name) for name in (*_DOUBLES, "radius", "mass")}
        if not self._first:
            self._first = {name: np.array(values) for name, values in logged.items()}
        snap.log = {name: values for name, values in logged.items() if not len(self._file) or self._news(name, values)}
        snap.log |= {"time": np.array([frame.time]), "state_hash": frame.state_hash}
        self._file.append(snap)
        self._file.flush()

    def _news(self, name: str, values: Array) -> bool:
        return not np.array_equal(self._first[name], values)

    def close(self) -> None:
        self._file.close()


class GsdReader(Reader):
    """Frames of any GSD file; those of other programs have no spins and numbers, and the time is their step."""

    needs = "gsd"

    def __init__(self, path: Path) -> None:
        import gsd.hoomd

        try:
            self._file: Any = gsd.hoomd.open(str(path), "r")
        except RuntimeError as error:  # not GSD, or a newer one
            raise ValueError(str(error)) from None

    def __len__(self) -> int:
        return len(self._file)

    def frame(self, k: int) -> Frame:
        snap = self._file[k]
        particles, log, count = snap.particles, snap.log, snap.particles.N
        get = {
            "position": particles.position[:, :2],
            "velocity": particles.velocity[:, :2],
            "radius": particles.diameter / np.float32(2),
            "mass": particles.mass,
            "spin": np.zeros(count, np.float32),
            "number": np.arange(count),
        }
        get |= {name: log[f"particles/{name}"] for name in get if f"particles/{name}" in log}
        time = float(log["time"][0]) if "time" in log else float(snap.configuration.step)
        return Frame(time, state_hash=str(log.get("state_hash", "")), **get)

    def close(self) -> None:
        self._file.close()


def _flat(rows: Array) -> Array:
    """(n, 3) float32 with z = 0."""
    result = np.zeros((len(rows), 3), np.float32)
    result[:, :2] = rows
    return result
