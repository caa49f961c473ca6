"""What is outside of the library and may be missing: optional packages, files that cannot be read or written, pictures."""

import importlib.util
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import InputError

LARGEST = 1024  # pixels: larger pictures are read at this size. No heap has as many circles side by side.


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


def read_picture(path: str | Path) -> NDArray[np.uint8]:
    """(h, w, 4) bytes R, G, B, A of the picture in a file, at most LARGEST on a side; InputError if that cannot be."""
    require("picture", "PIL", extra="record")
    from PIL import Image, ImageOps

    try:
        with warnings.catch_warnings(), Image.open(path) as file:
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            file.draft("RGB", (LARGEST, LARGEST))  # a large JPEG is read small at once
            picture = ImageOps.exif_transpose(file).convert("RGBA")
    except FileNotFoundError:
        raise InputError(f"picture is '{path}', which does not exist; allowed is a file such as photo.png") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "not a picture that can be read"
        raise InputError(f"picture is '{path}': {reason}; allowed is a file such as photo.png") from None
    picture.thumbnail((LARGEST, LARGEST))
    return np.asarray(picture)
