"""GSD, the file format of HOOMD-blue: read by OVITO, freud and MDAnalysis. Uses the library `gsd`."""

from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.data.trajectory import Frame, Reader, Walls, Writer
from pyverlet.world.world import World

SCHEMA = (1, 4)  # version of HOOMD's schema: https://gsd.readthedocs.io/en/stable/schema-hoomd.html

# Frames keep float32 under the names of the format; values without a name there, and float64, are logged quantities.
_LOGGED = ("spin", "number")
_DOUBLES = ("position", "velocity", "radius", "mass")


class GsdWriter(Writer):
    """Writes frames as named chunks. Chunks equal to those of the first frame are left out, as the format specifies."""

    def __init__(self, path: Path) -> None:
        import gsd.fl

        self._file: Any = gsd.fl.open(str(path), "w", application="pyverlet", schema="hoomd", schema_version=SCHEMA)
        self._first: dict[str, Array] = {}
        self._walls = Walls()

    def add(self, frame: Frame, world: World) -> None:
        # The box of the format is centred at the origin.
        x0, y0, x1, y1 = self._walls.around(frame, world)
        joined = world.links.pulls()[0]
        chunks: dict[str, Any] = {
            "configuration/step": np.array([world.frames], np.uint64),
            "configuration/dimensions": np.array([2], np.uint8),
            "configuration/box": np.array([2 * max(abs(x0), abs(x1)), 2 * max(abs(y0), abs(y1)), 0, 0, 0, 0], np.float32),
            "particles/N": np.array([len(frame)], np.uint32),
            "particles/types": _name("circle"),
            "particles/position": np.pad(frame.position, ((0, 0), (0, 1))).astype(np.float32),
            "particles/velocity": np.pad(frame.velocity, ((0, 0), (0, 1))).astype(np.float32),
            "particles/diameter": (2 * frame.radius).astype(np.float32),
            "particles/mass": frame.mass.astype(np.float32, copy=False),
            "bonds/N": np.array([len(joined)], np.uint32),
            "bonds/types": _name("link"),
            "bonds/group": joined.astype(np.uint32),
            "log/time": np.array([frame.time]),
        }
        chunks |= {f"log/particles/{name}": getattr(frame, name) for name in _LOGGED}
        if frame.position.dtype == np.float64:
            chunks |= {f"log/particles/{name}": getattr(frame, name) for name in _DOUBLES}
        if not self._first:
            self._first = {name: np.array(values) for name, values in chunks.items()}
        for name, values in chunks.items():
            if len(values) and (not self._file.nframes or not np.array_equal(self._first[name], values)):
                self._file.write_chunk(name, values)
        self._file.write_chunk("log/state_hash", frame.state_hash)
        self._file.end_frame()
        self._file.flush()


class GsdReader(Reader):
    """Reads frames of any GSD file; those of other programs have no spins and numbers, and their step as time."""

    def __init__(self, path: Path) -> None:
        import gsd.hoomd

        try:
            self._file: Any = gsd.hoomd.open(str(path), "r")
        except RuntimeError as error:  # not GSD, or a newer version
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
        if count:  # for frames without particles the library returns the first frame's
            get |= {name: log[f"particles/{name}"] for name in get if f"particles/{name}" in log}
        time = float(log["time"][0]) if "time" in log else float(snap.configuration.step)
        return Frame(time, state_hash=str(log.get("state_hash", "")), **get)


def _name(name: str) -> Array:
    """The name of the only type as a row of characters."""
    return np.frombuffer(f"{name}\0".encode(), np.int8)[None]
