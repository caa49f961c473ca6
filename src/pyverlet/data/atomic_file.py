"""Atomic replacement of files: a reader sees the old file or the new one, never a part of either."""

import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Self

from pyverlet.common.errors import InputError


class Closing:
    """Base class of context managers that close themselves."""

    def close(self) -> None:
        """Close; what was written stays."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write, which replaces `path` once all of it is on the disk; after an exception `path` is unchanged.

    A process killed meanwhile leaves the old file, and a hidden one beside it that ends in `.tmp`. The new file has the
    permissions of the old one; a symbolic link is followed.

    Raises:
        InputError: nothing can be written there, or `path` is not a plain file.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}.tmp")
    try:
        old = target.stat().st_mode if os.path.lexists(target) else None
        if old is not None and not stat.S_ISREG(old):
            raise InputError(f"'{path}' is no plain file; allowed is a new name, or a plain file to be replaced")
        file = temporary.open("xb")
    except OSError as error:
        raise InputError(f"'{path}' cannot be written ({error.strerror}); allowed is a file in a folder of yours") from None
    try:
        with file:
            if old is not None:
                temporary.chmod(stat.S_IMODE(old))
            yield file
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError):
            raise InputError(f"'{path}' cannot be written ({error.strerror}); allowed is a disk with room for it") from error
        raise
    sync_folder(target.parent)


def sync_folder(folder: Path) -> None:
    """Flush the names in a folder to the disk, if the system supports it."""
    with contextlib.suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)
