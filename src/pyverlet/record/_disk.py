"""A file that a full disk cannot break: what does not fit any more is left out, and the rest stays whole."""

from __future__ import annotations

import os
from pathlib import Path

from pyverlet.ground.outside import file_errors


class Disk:
    """A binary file for an encoder to write to. It never raises: `error` says why nothing is written any more.

    The encoder goes on as if nothing had happened, so that it can be closed in peace; at the end the file is cut to where
    `whole` was last called.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.error: OSError | None = None
        with file_errors("path", path, "written"):
            self._file = path.open("w+b", buffering=0)
        self._at = self.end = self._whole = 0

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self.end}[whence]
        return self._at

    def write(self, data: bytes) -> int:
        """Write as much as fits, and say that all did."""
        left = memoryview(data)
        while self.error is None and len(left):
            try:
                self._file.seek(self._at + len(data) - len(left))
                left = left[self._file.write(left) or 0 :]
            except OSError as error:
                self.error = error
        self._at += len(data)
        self.end = max(self.end, self._at)
        return len(data)

    def read(self, count: int = -1) -> bytes:
        """What is there: encoders look back when they finish."""
        self._file.seek(self._at)
        data = self._file.read(count)
        self._at += len(data)
        return data

    def whole(self) -> None:
        """So far the file is complete."""
        if self.error is None:
            self._whole = self.end

    def close(self, *, mend: bytes = b"") -> None:
        """Close; a file cut short ends with `mend`."""
        if self.error is not None:
            self._file.truncate(self._whole)
            self._file.seek(self._whole)
            self._file.write(mend)  # cutting has made room for it
        self._file.close()
