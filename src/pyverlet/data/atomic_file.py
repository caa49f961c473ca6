"""Files that are whole whatever happens: the old one or the new one, never a part of either."""

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Self

from pyverlet.ground.errors import InputError


class Closing:
    """What is closed at the end of a with statement."""

    def close(self) -> None:
        """End it; what was written stays."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write, which takes the place of `path` when all of it is on the disk; if anything is raised, it never was.

    A process that is killed meanwhile leaves the old file, and a hidden one beside it that ends in `.tmp`.

    Raises:
        InputError: nothing can be written there.
    """
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        file = beside.open("xb")
    except OSError as error:
        raise InputError(f"'{path}' cannot be written ({error.strerror}); allowed is a file in a folder of yours") from None
    try:
        with file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except BaseException as error:
        with contextlib.suppress(OSError):
            beside.unlink()
        if isinstance(error, OSError):
            raise InputError(f"'{path}' cannot be written ({error.strerror}); allowed is a disk with room for it") from error
        raise
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Have the disk know the names in a folder, too, where the system can be told."""
    with contextlib.suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)
