"""A lock between processes, on the first byte of a file. The system releases it when the process ends, in any way."""

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

_TAKEN = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)

if sys.platform == "win32":
    import msvcrt

    def _set(file: int, *, lock: bool) -> None:
        os.lseek(file, 0, os.SEEK_SET)
        msvcrt.locking(file, msvcrt.LK_NBLCK if lock else msvcrt.LK_UNLCK, 1)

else:
    import fcntl

    def _set(file: int, *, lock: bool) -> None:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB if lock else fcntl.LOCK_UN, 1, 0)


@cache
def _opened(path: Path) -> int:
    """Open without ever closing: closing any handle of a file releases all of the process's locks on it."""
    return os.open(path, os.O_RDWR | os.O_CREAT, 0o666)


@contextlib.contextmanager
def locked(path: Path) -> Iterator[bool]:
    """Context in which this process holds the lock; yields False if another one has it. Does not wait.

    Where files cannot be locked, every process gets the lock, so work may be done twice.
    """
    file, taken = None, False
    with contextlib.suppress(OSError):
        file = _opened(path)
    try:
        if file is not None:
            _set(file, lock=True)
    except OSError as error:
        file, taken = None, error.errno in _TAKEN
    try:
        yield not taken
    finally:
        if file is not None:
            with contextlib.suppress(OSError):
                _set(file, lock=False)
