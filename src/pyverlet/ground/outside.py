"""What is outside of the library and may be missing: optional packages, and files that cannot be read or written."""

import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pyverlet.ground.errors import InputError


def require(what: str, *modules: str, extra: str) -> None:
    """Refuse what needs optional modules that are not installed.

    Raises:
        InputError: one is missing; the sentence has the command that installs it: the extra `extra` of pyverlet.
    """
    for module in modules:
        if importlib.util.find_spec(module) is None:
            raise InputError(f"{what} needs {module!r}, which is not installed: pip install 'pyverlet[{extra}]'")


@contextmanager
def file_errors(name: str, path: str | Path, done: str) -> Iterator[None]:
    """Raise InputError in place of OSError: the argument `name` is a path that cannot be `done`, "read" or "written"."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{name} is '{path}', which cannot be {done}: {error.strerror or error}") from None
