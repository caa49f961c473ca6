"""The layout of several panels in one picture: equal cells on one plane, with a strip above each for its name and curve.

A picture of several worlds is one plane with the worlds moved apart, so that everything that draws one world draws them all.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pyverlet.picture.view import Rect

SCREEN_ASPECT = 1.3  # width / height of the free space beside the page's controls in a typical window
STRIP = 0.28  # height of the strip above a panel, as a fraction of the panel's shorter side


@dataclass(frozen=True)
class Layout:
    """Cells for `count` panels that all show the part `room` of their own plane, metres. A single panel has no strip."""

    room: Rect
    count: int
    bounded: bool = True

    @property
    def size(self) -> float:
        """The longer side of the visible part of each world, m."""
        x0, y0, x1, y1 = self.room
        return max(x1 - x0, y1 - y0)

    @property
    def _cell(self) -> tuple[float, float, float]:
        """Width and height of a cell, and height of its strip, m."""
        x0, y0, x1, y1 = self.room
        width, height = x1 - x0, y1 - y0
        return width, height, 0.0 if self.count == 1 else STRIP * min(width, height)

    @cached_property
    def _grid(self) -> tuple[int, int]:
        """Columns and rows that make panels as large as possible; a single row without bounds, so that heights match."""
        if not self.bounded:
            return self.count, 1
        width, height, strip = self._cell

        def scale(columns: int) -> float:
            return min(SCREEN_ASPECT / (columns * width), 1.0 / (-(-self.count // columns) * (height + strip)))

        columns = max(range(1, self.count + 1), key=scale)
        return columns, -(-self.count // columns)

    def offset(self, panel: int) -> tuple[float, float]:
        """Offset of a panel's coordinates in the picture, m."""
        width, height, strip = self._cell
        row, column = divmod(panel, self._grid[0])
        return column * width, -row * (height + strip)

    @property
    def view(self) -> Rect:
        """The bounds of the whole picture."""
        width, height, strip = self._cell
        columns, rows = self._grid
        x0, y0, _, y1 = self.room
        return (x0, y0 - (rows - 1) * (height + strip), x0 + columns * width, y1 + strip)

    def strip(self, panel: int) -> Rect:
        """(left, top, width, height) of a panel's strip as fractions of the picture, from its upper left corner."""
        width, _, strip = self._cell
        (x0, y0, x1, y1), (dx, dy) = self.view, self.offset(panel)
        return dx / (x1 - x0), -dy / (y1 - y0), width / (x1 - x0), strip / (y1 - y0)

    def at(self, x: float, y: float) -> int:
        """The panel nearest to a point of the picture."""
        width, height, strip = self._cell
        x0, _, _, y1 = self.view
        columns, rows = self._grid
        column = min(max(int((x - x0) // width), 0), columns - 1)
        row = min(max(int((y1 - y) // (height + strip)), 0), rows - 1)
        return min(row * columns + column, self.count - 1)

    def place(self, panel: int, position: NDArray[np.float32]) -> NDArray[np.float32]:
        """(n, 2) positions of a panel moved to its cell; NaN outside of it, so that neighbours stay clear."""
        if self.count == 1:
            return position
        x0, y0, x1, y1 = self.room
        inside = (position >= (x0, y0)) & (position <= (x1, y1))
        moved = position + np.array(self.offset(panel), dtype=np.float32)
        moved[~inside.all(axis=1)] = np.nan
        return moved
