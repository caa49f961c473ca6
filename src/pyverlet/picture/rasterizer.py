"""The drawing of a `Pen` onto pixels."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.core import unit
from pyverlet.ground.outside import require
from pyverlet.picture.palette import Packed, Theme, swapped
from pyverlet.picture.pen import Drawing, Lettering
from pyverlet.picture.view import View

SLICES = 8  # lines a row of pixels is cut into where something is filled: steps of an eighth at rims that lie flat


def draw(pixels: Packed, drawing: Drawing, view: View, theme: Theme) -> None:
    """Draw on (h, w) pixels of the view, in the order in which it was drawn. Text needs Pillow."""
    for mark in drawing:
        colour = swapped(theme.text if mark.colour is None else mark.colour)
        if isinstance(mark, Lettering):
            _write(pixels, mark, view, colour)
            continue
        points = np.array(mark.points)
        if mark.filled:
            points = (points - (view.left, view.top)) * (view.scale, -view.scale)
            cover = np.zeros(pixels.shape, dtype=np.float32)
            unit("tools").fill(cover, np.column_stack((points, np.roll(points, -1, axis=0))), SLICES)
            unit("tools").tint(pixels, cover, np.uint32(colour))
            continue
        ends = np.stack((points, np.roll(points, -1, axis=0)), axis=1)[: None if mark.closed else -1]
        colours = np.full(len(ends), colour, np.uint32)
        unit("tools", ends.dtype).draw_lines(pixels, ends, colours, view.left, view.top, view.scale, mark.width / 2)


def _write(pixels: Packed, mark: Lettering, view: View, colour: int) -> None:
    letters = _letters(mark.text, mark.size)
    (height, width), (rows, columns) = letters.shape, pixels.shape
    left = round((mark.x - view.left) * view.scale)
    top = round((view.top - mark.y) * view.scale - height / 2)
    x0, y0, x1, y1 = max(left, 0), max(top, 0), min(left + width, columns), min(top + height, rows)
    if x0 >= x1 or y0 >= y1:
        return
    part = np.ascontiguousarray(pixels[y0:y1, x0:x1])
    unit("tools").tint(part, np.ascontiguousarray(letters[y0 - top : y1 - top, x0 - left : x1 - left]), np.uint32(colour))
    pixels[y0:y1, x0:x1] = part


@lru_cache(256)
def _letters(text: str, size: float) -> NDArray[np.float32]:
    """(h, w) what part of each pixel a text covers."""
    require("text in a picture", "PIL", extra="record")
    from PIL import Image, ImageDraw, ImageFont

    font: Any = ImageFont.load_default(size)
    left, top, right, bottom = ImageDraw.Draw(Image.new("L", (1, 1))).multiline_textbbox((0, 0), text, font=font)
    picture = Image.new("L", (max(1, int(right - left) + 2), max(1, int(bottom - top) + 2)))
    ImageDraw.Draw(picture).multiline_text((1 - left, 1 - top), text, fill=255, font=font)
    return np.asarray(np.asarray(picture) / 255, np.float32)
