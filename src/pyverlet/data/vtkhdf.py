"""VTKHDF: moving points in an HDF5 file that ParaView opens. Uses h5py.

A moment is a step of a PolyData with a vertex for each circle: https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
"""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from pyverlet.data.trajectory import Frame, Reader, Writer
from pyverlet.world.world import World


class JournaledFile:
    """A binary file for h5py whose contents change only at commits.

    So it is intact even if the program crashes between two commits; HDF5 alone leaves incomplete files. New bytes behind the end
    of the last commit are written at once, as nothing refers to them yet. Changes before it, about 27 kB of tables per frame,
    stay in memory until `commit`.

    Methods called by h5py never raise, because HDF5 would end the process: after an error, such as a full disk, everything
    written stays in memory, and `commit` raises the error.
    """

    _error: OSError | None = None

    def __init__(self, path: Path) -> None:
        self._file = path.open("w+b", buffering=0)
        self._at = self._end = self._committed = 0
        self._changes: list[tuple[int, bytes]] = []

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._end}[whence]
        return self._at

    def tell(self) -> int:
        return self._at

    def write(self, data: bytes) -> int:
        """Write behind the end of the last commit, or store for the next one."""
        content, start = bytes(data), self._at
        inside = min(max(self._committed - start, 0), len(content))
        if inside:
            self._changes.append((start, content[:inside]))
        if inside < len(content):
            self._append(start + inside, content[inside:])
        self._at = start + len(content)
        self._end = max(self._end, self._at)
        return len(content)

    def readinto(self, buffer: memoryview) -> int:
        data = self.read(len(buffer))
        buffer[: len(data)] = data
        return len(data)

    def read(self, count: int) -> bytes:
        self._file.seek(self._at)
        data = bytearray(self._file.read(count))
        data.extend(bytes(max(min(self._end - self._at, count) - len(data), 0)))
        for start, content in self._changes:
            low, high = max(start, self._at), min(start + len(content), self._at + len(data))
            if low < high:
                data[low - self._at : high - self._at] = content[low - start : high - start]
        self._at += len(data)
        return bytes(data)

    def truncate(self, size: int | None = None) -> int:
        self._end = self._at if size is None else size
        if self._end >= self._committed:
            self._try(self._file.truncate, self._end)
        return self._end

    def flush(self) -> None:
        """Do nothing: only commits count."""

    def commit(self) -> None:
        """Make all writes since the last commit part of the file.

        Raises:
            OSError: that failed; the file is as at the last commit.
        """
        for start, content in self._changes if self._error is None else ():
            self._try(self._put, start, content)
        if self._error is not None:
            raise self._error
        self._changes.clear()
        self._committed = self._end

    def close(self) -> None:
        """Commit, unless that has failed before."""
        try:
            if self._error is None:
                self.commit()
        finally:
            self._file.close()

    def _append(self, start: int, content: bytes) -> None:
        if not self._try(self._put, start, content):
            self._changes.append((start, content))

    def _try(self, act: Callable[..., object], *given: Any) -> bool:
        """Call `act`, unless an earlier call failed; returns whether it succeeded."""
        try:
            if self._error is None:
                act(*given)
        except OSError as error:
            self._error = error
        return self._error is None

    def _put(self, start: int, content: bytes) -> None:
        self._file.seek(start)
        left = memoryview(content)
        while left:
            left = left[self._file.write(left) or 0 :]


VERSION = (2, 0)  # of the format: the first with PolyData steps
KINDS = ("Vertices", "Lines", "Polygons", "Strips")  # cells of a PolyData, in the order of the format; only vertices are used

COLUMNS = ("velocity", "radius", "mass", "spin", "number")

STEPS = 128  # entries per chunk of arrays with one entry per step; the last chunk of each is rewritten with every frame
ROWS = (256, 1 << 16)  # least and most circles per chunk; in between one frame fills a chunk


class VtkHdfWriter(Writer):
    """Appends all steps to each array; Steps has the offsets."""

    def __init__(self, path: Path) -> None:
        import h5py

        self._disk = JournaledFile(path)
        self._file: Any = h5py.File(self._disk, "w", libver=("v110", "v110"))
        self._file.flush()
        try:
            self._disk.commit()
        except OSError:
            self.close()
            raise
        self._parts, self._count = 0, -1  # number of parts, and circles in the current one
        self._cells = 0  # first vertex of that part
        self._rows = 0  # circles per chunk

    def add(self, frame: Frame, world: World) -> None:
        count = len(frame)
        if not self._rows:
            self._rows = min(max(count, ROWS[0]), ROWS[1])
            root = self._file.create_group("VTKHDF")
            root.attrs["Version"] = np.array(VERSION, np.int64)
            root.attrs.create("Type", np.bytes_(b"PolyData"))
        if count != self._count:
            self._begin_part(count)
        at = self._append("VTKHDF/Points", np.pad(frame.position, ((0, 0), (0, 1))), rows=self._rows)
        for name in COLUMNS:
            values = getattr(frame, name)
            values = np.pad(values, ((0, 0), (0, 1))) if name == "velocity" else values
            self._append(f"VTKHDF/PointData/{name}", values, rows=self._rows)
            self._append(f"VTKHDF/Steps/PointDataOffsets/{name}", [at])
        cells = [self._cells, 0, 0, 0]
        step = {"PartOffsets": self._parts - 1, "NumberOfParts": 1, "PointOffsets": at, "CellOffsets": cells}
        for name, value in (step | {"ConnectivityIdOffsets": cells, "Values": frame.time}).items():
            steps = self._append(f"VTKHDF/Steps/{name}", [value])
        self._file["VTKHDF/Steps"].attrs.modify("NSteps", np.int64(steps + 1))
        self._append("pyverlet/state_hash", np.array([frame.state_hash], "S16"))
        self._file.flush()
        self._disk.commit()

    def _begin_part(self, count: int) -> None:
        """Begin a part with a vertex for each of `count` circles, which later steps share until the number changes."""
        self._parts, self._count = self._parts + 1, count
        self._append("VTKHDF/NumberOfPoints", [count])
        for kind in KINDS:
            own, rows = np.arange(count + 1 if kind == "Vertices" else 1), self._rows if kind == "Vertices" else STEPS
            self._append(f"VTKHDF/{kind}/NumberOfCells", [len(own) - 1])
            self._append(f"VTKHDF/{kind}/NumberOfConnectivityIds", [len(own) - 1])
            begin = self._append(f"VTKHDF/{kind}/Connectivity", own[:-1], rows=rows)
            self._append(f"VTKHDF/{kind}/Offsets", own, rows=rows)
            if kind == "Vertices":
                self._cells = begin

    def _append(self, name: str, added: Any, *, rows: int = STEPS) -> int:
        """Append to an array, created on first use with so many rows per chunk; returns the offset of the new rows."""
        values = np.asarray(added)
        if name not in self._file:
            tail = values.shape[1:]
            self._file.create_dataset(name, (0, *tail), values.dtype, maxshape=(None, *tail), chunks=(rows, *tail))
        dataset = self._file[name]
        at = int(dataset.shape[0])
        dataset.resize(at + len(values), axis=0)
        dataset[at:] = values
        return at

    def close(self) -> None:
        self._file.close()
        self._disk.close()


class VtkHdfReader(Reader):
    """Reads files of `VtkHdfWriter`."""

    def __init__(self, path: Path) -> None:
        import h5py

        self._file: Any = h5py.File(path, "r")
        if "VTKHDF/Steps/Values" not in self._file or "pyverlet/state_hash" not in self._file:
            self._file.close()
            raise ValueError("it was not written by pyverlet")
        self._root = self._file["VTKHDF"]

    def __len__(self) -> int:
        return int(self._root["Steps"].attrs["NSteps"])

    def frame(self, k: int) -> Frame:
        root, steps = self._root, self._root["Steps"]
        start, count = int(steps["PointOffsets"][k]), int(root["NumberOfPoints"][steps["PartOffsets"][k]])
        here = slice(start, start + count)
        columns = {name: root["PointData"][name][here] for name in COLUMNS}
        columns["velocity"] = columns["velocity"][:, :2]
        time, state_hash = float(steps["Values"][k]), self._file["pyverlet/state_hash"][k].decode()
        return Frame(time, root["Points"][here][:, :2], state_hash=state_hash, **columns)
