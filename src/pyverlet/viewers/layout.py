"""Where several panels stand in one picture: equal cells on one plane, each with a strip above it for its name and curve.

A picture of several worlds is one plane with the worlds moved apart, so that everything that draws one world draws them all.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pyverlet.picture.view import Rect

SCREEN_ASPECT = 1.3  # width / height of what is left of a usual window beside the page's controls
STRIP = 0.28  # height of the strip above a panel, as a fraction of the panel's shorter side


@dataclass(frozen=True)
class Layout:
    """Cells for `count` panels that all show the part `room` of their own plane, metres. One panel has no strip."""

    room: Rect
    count: int
    bounded: bool = True

    @property
    def size(self) -> float:
        """The longer side of what is shown of each world, m."""
        x0, y0, x1, y1 = self.room
        return max(x1 - x0, y1 - y0)

    @property
    def _cell(self) -> tuple[float, float, float]:
        """Width, height without strip, height of the strip, m."""
        x0, y0, x1, y1 = self.room
        width, height = x1 - x0, y1 - y0
        return width, height, 0.0 if self.count == 1 else STRIP * min(width, height)

    @cached_property
    def _grid(self) -> tuple[int, int]:
        """Columns and rows: as large as the screen allows; a single row without bounds, with the same heights in all panels."""
        if not self.bounded:
            return self.count, 1
        width, height, strip = self._cell

        def scale(columns: int) -> float:
            return min(SCREEN_ASPECT / (columns * width), 1.0 / (-(-self.count // columns) * (height + strip)))

        columns = max(range(1, self.count + 1), key=scale)
        return columns, -(-self.count // columns)

    def offset(self, panel: int) -> tuple[float, float]:
        """What to add to a panel's own coordinates, m."""
        width, height, strip = self._cell
        row, column = divmod(panel, self._grid[0])
        return column * width, -row * (height + strip)

    @property
    def view(self) -> Rect:
        """The whole picture."""
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
        """(n, 2) positions of a panel moved to its cell; NaN where they are outside of it, so that no neighbour gets them."""
        if self.count == 1:
            return position
        x0, y0, x1, y1 = self.room
        inside = (position >= (x0, y0)) & (position <= (x1, y1))
        moved = position + np.array(self.offset(panel), dtype=np.float32)
        moved[~inside.all(axis=1)] = np.nan
        return moved
