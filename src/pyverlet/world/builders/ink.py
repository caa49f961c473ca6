"""A picture laid over a shape: where it has ink, and of which colour."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.arrays import Floats
from pyverlet.ground.errors import InputError
from pyverlet.ground.outside import read_picture

PAPER = 245
"""Brightness from which on all of R, G and B are paper."""


class Ink:
    """A picture, as large as it fits into a rectangle, in its middle.

    Args:
        picture: a file, or (h, w, 3) or (h, w, 4) bytes R, G, B, A.
        extent: x0, y0, x1, y1, m.
    """

    def __init__(self, picture: Any, extent: tuple[float, float, float, float]) -> None:
        self._pixels = read_picture(picture) if isinstance(picture, str | Path) else _bytes(picture)
        height, width = self._pixels.shape[:2]
        x0, y0, x1, y1 = extent
        self._metres = min((x1 - x0) / width, (y1 - y0) / height)  # of a pixel
        self._left, self._top = 0.5 * (x0 + x1 - width * self._metres), 0.5 * (y0 + y1 + height * self._metres)
        opaque = self._pixels[..., 3] > 127
        self._inked = opaque & (self._pixels[..., :3] < PAPER).any(axis=2)
        if not self._inked.any():
            raise InputError("picture is white or transparent everywhere; allowed is one with something on it")

    def area(self) -> float:
        """Of the ink, m^2."""
        return float(self._inked.sum() * self._metres**2)

    def covers(self, points: Floats) -> NDArray[np.bool_]:
        """(k,) whether there is ink at each point (k, 2), m."""
        row, column, within = self._at(points)
        return np.asarray(within & self._inked[row, column])

    def colours(self, points: Floats) -> NDArray[np.uint8]:
        """(k, 3) bytes R, G, B."""
        row, column, _ = self._at(points)
        return np.ascontiguousarray(self._pixels[row, column, :3])

    def _at(self, points: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
        height, width = self._inked.shape
        column = np.floor((points[:, 0] - self._left) / self._metres).astype(np.int64)
        row = np.floor((self._top - points[:, 1]) / self._metres).astype(np.int64)
        within = (column >= 0) & (column < width) & (row >= 0) & (row < height)
        return row.clip(0, height - 1), column.clip(0, width - 1), within


def _bytes(picture: Any) -> NDArray[np.uint8]:
    pixels: NDArray[Any] = np.asarray(picture)
    if pixels.ndim != 3 or pixels.shape[2] not in (3, 4) or pixels.dtype != np.uint8 or not pixels.size:
        raise InputError(
            f"picture has shape {pixels.shape} and dtype {pixels.dtype}; allowed are a file, and (h, w, 3) or (h, w, 4) bytes"
        )
    if pixels.shape[2] == 3:
        pixels = np.concatenate((pixels, np.full((*pixels.shape[:2], 1), 255, np.uint8)), axis=2)
    return pixels
