"""Turns that processes take: what one of them does, others wait for or leave alone.

A turn is a lock on one byte of a file. It ends with the process that has it, however that ends, and nothing is left to tidy up.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import sys
import time
from collections.abc import Iterator
from functools import cache
from pathlib import Path

_LOOK_AGAIN_S = 0.005

PATIENCE_S = 60.0
"""After so long somebody who still has a turn is taken to be stuck: what is read or written in a turn takes far less."""

_TAKEN = (errno.EAGAIN, errno.EACCES, errno.EDEADLK)

if sys.platform == "win32":
    import msvcrt

    def _lock(file: int, byte: int) -> None:
        os.lseek(file, byte, os.SEEK_SET)
        msvcrt.locking(file, msvcrt.LK_NBLCK, 1)

    def _unlock(file: int, byte: int) -> None:
        os.lseek(file, byte, os.SEEK_SET)
        msvcrt.locking(file, msvcrt.LK_UNLCK, 1)

else:
    import fcntl

    def _lock(file: int, byte: int) -> None:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, byte)

    def _unlock(file: int, byte: int) -> None:
        fcntl.lockf(file, fcntl.LOCK_UN, 1, byte)


@cache
def _opened(path: Path) -> int:
    """Never closed: closing any handle of a file gives away all the locks that a process has on it."""
    return os.open(path, os.O_RDWR | os.O_CREAT, 0o666)


def _locks(path: Path, byte: int) -> bool | None:
    """Whether the byte is ours now; None where files cannot be locked."""
    try:
        file = _opened(path)
    except OSError:
        return None
    try:
        _lock(file, byte)
    except OSError as error:
        return False if error.errno in _TAKEN else None
    return True


@contextlib.contextmanager
def turn(path: Path, name: str, *, patience: float = PATIENCE_S) -> Iterator[bool]:
    """Have the turn of this name among all processes that use the file at `path`; False if another has kept it for `patience` s.

    Where files cannot be locked, everybody has every turn: work may be done twice, and is done.
    """
    byte = int.from_bytes(hashlib.blake2b(name.encode(), digest_size=4).digest()) >> 1
    until = time.monotonic() + patience
    while (locked := _locks(path, byte)) is False and time.monotonic() < until:
        time.sleep(_LOOK_AGAIN_S)
    try:
        yield locked is not False
    finally:
        if locked:
            with contextlib.suppress(OSError):
                _unlock(_opened(path), byte)
