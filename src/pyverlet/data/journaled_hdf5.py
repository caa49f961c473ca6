"""A file that is whole after every commit, whatever ends the program between two of them: HDF5 alone leaves half-written ones."""

from __future__ import annotations

import os
from pathlib import Path


class JournaledFile:
    """A binary file for h5py to write to. What lay in it at the last commit stays as it was until the next.

    New bytes behind the end of then are written at once: nothing refers to them yet. Changes before it, some 27 kB of
    tables a frame, wait in memory for `commit`.
    """

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
        """Write behind the end of the last commit, or remember for the next."""
        content, start = bytes(data), self._at
        inside = min(max(self._committed - start, 0), len(content))
        if inside:
            self._changes.append((start, content[:inside]))
        self._put(start + inside, content[inside:])
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
            self._file.truncate(self._end)
        return self._end

    def flush(self) -> None:
        """Nothing: only a commit counts."""

    def commit(self) -> None:
        """From now on the file is as it has been written."""
        for start, content in self._changes:
            self._put(start, content)
        self._changes.clear()
        self._committed = self._end

    def close(self) -> None:
        self.commit()
        self._file.close()

    def _put(self, start: int, content: bytes) -> None:
        self._file.seek(start)
        left = memoryview(content)
        while left:
            left = left[self._file.write(left) or 0 :]
