"""Pictures for scenes: the user's, read with Pillow, or one of our own, drawn here."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.errors import InputError
from pyverlet.ground.outside import require

Pixels = NDArray[np.uint8]  # (height, width, 3) bytes R, G, B
LARGEST = 1024  # pixels: larger pictures are scaled to this when they are read. No heap has as many circles side by side.
MOST_ASPECT = 4.0  # width / height, or its inverse, of a picture that a heap can show


def read(path: Path) -> Pixels:
    """The picture in a file.

    Raises:
        InputError: there is no file, it is not a picture, it is too long and thin, or Pillow is missing.
    """
    require("picture", "PIL", extra="record")
    from PIL import Image, ImageOps

    try:
        with warnings.catch_warnings(), Image.open(path) as file:
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            width, height = file.size
            file.draft("RGB", (LARGEST, LARGEST))  # a large JPEG is read small at once
            picture = ImageOps.exif_transpose(file).convert("RGBA")
    except FileNotFoundError:
        raise InputError(f"picture is '{path}', which does not exist; allowed is a file such as photo.png") from None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else "not a picture that can be read"
        raise InputError(f"picture is '{path}': {reason}; allowed is a file such as photo.png") from None
    if max(width, height) > MOST_ASPECT * min(width, height):
        raise InputError(
            f"picture is '{path}' of {width} x {height} pixels; allowed is at most {MOST_ASPECT:g} times as long as wide"
        )
    picture.thumbnail((LARGEST, LARGEST))
    ground = Image.new("RGBA", picture.size, "white")  # where the picture is transparent
    return np.asarray(Image.alpha_composite(ground, picture).convert("RGB"))


def boat(width: int = 640, height: int = 480) -> Pixels:
    """A boat under sail before the evening sun."""
    x, y = np.meshgrid(np.linspace(-4 / 3, 4 / 3, width), np.linspace(1, -1, height))  # y up
    picture = np.empty((height, width, 3))

    def paint(where: NDArray[np.bool_], colour: int) -> None:
        picture[where] = [(colour >> shift) & 255 for shift in (16, 8, 0)]

    def blend(where: NDArray[np.bool_], low: int, high: int, share: NDArray[np.float64]) -> None:
        for k, shift in enumerate((16, 8, 0)):
            a, b = (low >> shift) & 255, (high >> shift) & 255
            picture[..., k][where] = (a + (b - a) * share)[where]

    horizon = -0.25
    sky, sea = y > horizon, y <= horizon
    blend(sky, 0xFFB35C, 0x3D2F7F, np.clip((y - horizon) / 1.1, 0, 1))
    blend(sea, 0x17406D, 0x0B2447, np.clip((horizon - y) / 0.75, 0, 1))
    paint(sky & (np.hypot(x - 0.45, y + 0.02) < 0.42), 0xFFE28A)
    glint = np.abs(x - 0.45) < 0.36 - 0.3 * (horizon - y)
    paint(sea & glint & (np.sin(34 * np.sqrt(np.maximum(horizon - y, 0)) + 0.5) > 0.1), 0xFFC46B)
    deck = -0.36
    hull = (y < deck) & (y > -0.58) & (np.abs(x + 0.35) < 0.58 + 0.9 * (y + 0.36))
    paint(hull, 0xB3312C)
    paint(hull & (y > deck - 0.05), 0xF5F1E6)
    paint((np.abs(x + 0.35) < 0.02) & (y > deck) & (y < 0.86), 0x3A2418)
    sail = (y > deck + 0.1) & (y < 0.8) & (x < -0.38) & (x > -0.38 - 0.52 * (0.8 - y) / 1.06)
    paint(sail, 0xFFFFFF)
    jib = (y > deck + 0.1) & (y < 0.66) & (x > -0.31) & (x < -0.31 + 0.45 * (0.66 - y) / 0.92)
    paint(jib, 0xE9573F)
    return np.asarray(picture.round(), dtype=np.uint8)
