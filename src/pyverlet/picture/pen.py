"""The pen of a user's `draw(world, pen)`: it draws over a picture, in metres, alike on the page, in films and in pictures."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.shown import Shown
from pyverlet.world.world import World

MOST_POINTS = 50_000  # in a drawing, which is sent with each picture
CORNERS = 64  # of a circle: off by 0.1 % of its radius
WIDTH_PX, SIZE_PX = 2.0, 14.0  # default width of lines and size of texts
Colour = str | Sequence[float] | None  # `"#rrggbb"`, (R, G, B) from 0 to 255, or None for a contrasting colour


@dataclass(frozen=True)
class Stroke:
    """A line through points, metres; if closed, it may be filled."""

    points: tuple[tuple[float, float], ...]
    closed: bool
    filled: bool
    colour: int | None  # 0xRRGGBB; None for the theme's
    width: float  # pixels


@dataclass(frozen=True)
class Lettering:
    """A text that begins at a point, metres, vertically centred on it."""

    x: float
    y: float
    text: str
    colour: int | None
    size: float  # height in pixels


Drawing = tuple[Stroke | Lettering, ...]

Draw = Callable[["World", "Pen"], None]  # a user's function


class Pen(Shown):
    """Draws over a picture: the argument of `draw(world, pen)`, a new one for each. Points in metres; widths and sizes in pixels.

    A `colour` is "#rrggbb", (R, G, B) from 0 to 255, or None for one that contrasts with the background.

    Args:
        offset: added to points, m: the place of a world beside others.
    """

    def __init__(self, offset: tuple[float, float] = (0.0, 0.0)) -> None:
        self._offset = np.array(offset)
        self._marks: list[Stroke | Lettering] = []
        self._points = 0

    @property
    def drawing(self) -> Drawing:
        """The drawing so far."""
        return tuple(self._marks)

    def line(self, start: ArrayLike, end: ArrayLike, *, colour: Colour = None, width: float = WIDTH_PX) -> None:
        """Draw a line from one point to another."""
        self._stroke([_point("start", start), _point("end", end)], colour, width)

    def polyline(self, points: ArrayLike, *, colour: Colour = None, width: float = WIDTH_PX) -> None:
        """Draw a line through points (n, 2)."""
        self._stroke(checks.rows("points", points, np.dtype(float)), colour, width)

    def polygon(self, points: ArrayLike, *, colour: Colour = None, width: float = WIDTH_PX, fill: bool = False) -> None:
        """Draw a closed line through points (n, 2), or with `fill` its inside."""
        self._stroke(checks.rows("points", points, np.dtype(float)), colour, width, closed=True, filled=fill)

    def circle(
        self, center: ArrayLike, radius: float, *, colour: Colour = None, width: float = WIDTH_PX, fill: bool = False
    ) -> None:
        """Draw a circle of this radius, m, or with `fill` a disc."""
        angle = np.linspace(0.0, 2 * np.pi, CORNERS, endpoint=False)
        ring = checks.number("radius", radius, least=0.0) * np.column_stack((np.cos(angle), np.sin(angle)))
        self._stroke(_point("center", center) + ring, colour, width, closed=True, filled=fill)

    def text(self, point: ArrayLike, text: Any, *, colour: Colour = None, size: float = SIZE_PX) -> None:
        """Draw a text that begins at a point, `size` pixels high."""
        x, y = (_point("point", point) + self._offset).tolist()
        self._count(1)
        self._marks.append(Lettering(x, y, str(text)[:1000], _rgb(colour), checks.number("size", size, above=0.0)))

    def _stroke(self, points: Any, colour: Colour, width: float, *, closed: bool = False, filled: bool = False) -> None:
        self._count(len(points))
        where = tuple(map(tuple, np.asarray(points + self._offset, float).tolist()))
        self._marks.append(Stroke(where, closed, bool(filled), _rgb(colour), checks.number("width", width, above=0.0)))

    def _count(self, points: int) -> None:
        self._points += points
        if self._points > MOST_POINTS:
            raise InputError(f"the drawing has {self._points:,} points; allowed are {MOST_POINTS:,} over one picture")


def _point(name: str, value: ArrayLike) -> Any:
    return np.array(checks.vector(name, np.asarray(value)))


def _rgb(colour: Colour) -> int | None:
    if colour is None:
        return None
    if isinstance(colour, str) and re.fullmatch("#[0-9a-fA-F]{6}", colour):
        return int(colour[1:], 16)
    if not isinstance(colour, str):
        parts: Any = np.asarray(colour)
        if parts.shape == (3,) and parts.dtype.kind in "iuf" and ((parts >= 0) & (parts <= 255)).all():
            red, green, blue = (int(part) for part in parts)
            return red << 16 | green << 8 | blue
    raise InputError(f"colour is {colour!r}; allowed are '#rrggbb' and (R, G, B) from 0 to 255")
