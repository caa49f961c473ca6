"""Handles what may be missing outside of the library: optional packages, readable files, pictures."""

import importlib.util
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import InputError

LARGEST = 1024  # pixels: larger pictures are reduced; no heap has as many circles side by side


def require(what: str, *modules: str, extra: str) -> None:
    """Refuse a feature whose optional modules are not installed.

    Raises:
        InputError: one is missing; the message has the command that installs the extra `extra` of pyverlet.
    """
    for module in modules:
        if importlib.util.find_spec(module) is None:
            raise InputError(f"{what} needs {module!r}, which is not installed: pip install 'pyverlet[{extra}]'")


@contextmanager
def file_errors(name: str, path: str | Path, done: str) -> Iterator[None]:
    """Raise InputError instead of OSError: the argument `name` is a path that cannot be `done`, "read" or "written"."""
    try:
        yield
    except OSError as error:
        raise InputError(f"{name} is '{path}', which cannot be {done}: {error.strerror or error}") from None


def read_picture(path: str | Path) -> NDArray[np.uint8]:
    """(h, w, 4) bytes R, G, B, A of a picture file, at most LARGEST per side; InputError on failure."""
    require("picture", "PIL", extra="record")
    from PIL import Image, ImageOps

    try:
        with warnings.catch_warnings(), Image.open(path) as file:
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            file.draft("RGB", (LARGEST, LARGEST))  # decodes a large JPEG at reduced size
            picture = ImageOps.exif_transpose(file).convert("RGBA")
    except FileNotFoundError:
        raise InputError(f"picture is '{path}', which does not exist; allowed is a file such as photo.png") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "not a picture that can be read"
        raise InputError(f"picture is '{path}': {reason}; allowed is a file such as photo.png") from None
    picture.thumbnail((LARGEST, LARGEST))
    return np.asarray(picture)
