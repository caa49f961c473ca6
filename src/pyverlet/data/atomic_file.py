"""Files that are whole whatever happens: the old one or the new one, never a part of either."""

import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Self

from pyverlet.common.errors import InputError


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

    A process that is killed meanwhile leaves the old file, and a hidden one beside it that ends in `.tmp`. The new file has the
    permissions of the old one; where a symbolic link stands, it is the file that it leads to.

    Raises:
        InputError: nothing can be written there, or what is there is no plain file.
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
    """Have the disk know the names in a folder, too, where the system can be told."""
    with contextlib.suppress(OSError):
        number = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(number)
        finally:
            os.close(number)
