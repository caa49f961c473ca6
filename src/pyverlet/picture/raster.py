"""Rasteriser: draws circles, walls and the drawing of a `Pen` to an array of pixels, on the processor."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.outside import require
from pyverlet.common.shown import Shown
from pyverlet.core import unit
from pyverlet.laws.obstacles import Outline
from pyverlet.picture import periodic_images
from pyverlet.picture.colour import DARK, Packed, Theme, by_force, swapped
from pyverlet.picture.pen import Drawing, Lettering
from pyverlet.picture.view import View
from pyverlet.world.world import World

Lines = Sequence[Sequence[tuple[float, float]]]  # closed, metres
Links = tuple[NDArray[Any], NDArray[Any]]  # ends (m, 2, 2) in metres, and tensions (m,) in N
WALL_PX = 2.0  # width of a wall's line outside the room
LINE_PX = 4.0  # width of the line of an obstacle without thickness
LINK_PX = 1.6  # width of a link's line
MARKED_PX = 4.0  # radius from which on a disc has a mark; in a smaller one it could not be distinguished from the rim
MARK_PX = 1.4  # width of its line
GRID_PX = 60.0  # least spacing of grid lines
MOST_PIXELS = 1 << 26  # 8,192 x 8,192, 256 MB: more is almost surely a typing error


class Raster(Shown):
    """Draws worlds into one reusable buffer of pixels.

    Args:
        size: (width, height) in pixels.
        theme: DARK or LIGHT.
    """

    def __init__(self, size: tuple[int, int] = (1280, 720), *, theme: Theme = DARK) -> None:
        self.size = check_size(size)
        self.theme = theme
        width, height = self.size
        self._pixels: Packed = np.empty((height, width), dtype=np.uint32)
        self._floor: Packed = np.empty_like(self._pixels)
        self._floor_is: Any = None
        self._background: Packed = np.empty_like(self._pixels)
        self._obstacles: Any = None

    def draw(
        self, world: World, view: View, *, outlines: Lines = (), colours: Packed, drawing: Drawing = ()
    ) -> NDArray[np.uint8]:
        """Draw a picture of `world`.

        Args:
            world: only read.
            view: of this raster's size.
            outlines: closed lines of the bounds, metres.
            colours: (n,) R + G << 8 + B << 16, from a `Colouring`.
            drawing: of a `Pen`, on top.

        Returns:
            (height, width, 4) bytes R, G, B, A: a view of the buffer, valid until the next call. A is the part of a pixel that
            circles cover; R, G, B are complete without it.
        """
        obstacles, periodic = world.obstacles.outlines(), world.boundary.periodic
        if periodic:
            obstacles = periodic_images.outlines(obstacles, periodic)
        position, radius, angle, colours = periodic_images.circles(world, colours)
        picture = self.discs(
            position, radius, view,
            outlines=outlines, obstacles=obstacles, colours=colours, links=periodic_images.links(world), angle=angle,
        )  # fmt: skip
        if drawing:
            draw_drawing(self._pixels, drawing, view, self.theme)
        return picture

    def discs(
        self, position: NDArray[Any], radius: NDArray[Any], view: View, *,
        outlines: Lines = (), obstacles: Sequence[Outline] = (), colours: Packed, links: Links | None = None,
        angle: NDArray[np.float64] | None = None,
    ) -> NDArray[np.uint8]:  # fmt: skip
        """`draw` from arrays: centres (n, 2) and radii (n,) in metres, links as `world.links.segments` has them, (n,) in rad.

        For pictures made in another thread than that of the physics.
        """
        if (view.width, view.height) != self.size:
            raise InputError(f"view is {view.width} x {view.height} pixels; allowed is this raster's {self.size}")
        key = (view.left, view.top, view.scale, outlines)
        if self._floor_is != key:
            self._lay_floor(view, outlines)
            self._floor_is, self._obstacles = key, None
        if self._obstacles is not obstacles:
            np.copyto(self._background, self._floor)
            self._place(obstacles, view)
            self._obstacles = obstacles
        np.copyto(self._pixels, self._background)
        colours = np.ascontiguousarray(colours, dtype=np.uint32)
        lines = links and (links[0], by_force(links[1], self.theme))
        paint(self._pixels, self._background, position, radius, angle, colours, lines, view)
        return self._pixels.view(np.uint8).reshape(*self._pixels.shape, 4)

    def _lay_floor(self, view: View, outlines: Lines) -> None:
        """Draw what is constant for a view: the background, the floor of the room, its walls."""
        self._floor[:] = swapped(self.theme.ground)
        if not outlines:
            self._rule(view)
            return
        lines = [np.asarray(outline, dtype=np.float64) for outline in outlines]
        pixels = [np.column_stack(((x - view.left), (view.top - y))) * view.scale for x, y in (line.T for line in lines)]
        edges = np.concatenate([np.column_stack((line, np.roll(line, -1, axis=0))) for line in pixels])
        cover, tools = np.zeros(self._floor.shape, dtype=np.float32), unit("tools")
        for x0, y0, x1, y1 in edges:
            tools.stroke(cover, x0, y0, x1, y1, WALL_PX)
        tools.tint(self._floor, cover, np.uint32(swapped(self.theme.wall)))
        cover[:] = 0.0
        tools.fill(cover, edges, SLICES)
        tools.tint(self._floor, cover, np.uint32(swapped(self.theme.inside)))

    def _rule(self, view: View) -> None:
        """Without walls: draw lines at round distances, so that motion is visible."""
        apart = 10.0 ** np.floor(np.log10(GRID_PX / view.scale))
        apart *= next(multiple for multiple in (1, 2, 5, 10) if multiple * apart * view.scale >= GRID_PX)
        width, height = self.size
        right, bottom = view.left + width / view.scale, view.top - height / view.scale
        line = swapped(self.theme.grid)
        for x in np.arange(np.ceil(view.left / apart), right / apart) * apart:
            self._floor[:, int((x - view.left) * view.scale)] = line
        for y in np.arange(np.floor(bottom / apart) + 1, np.floor(view.top / apart) + 1) * apart:
            self._floor[int((view.top - y) * view.scale), :] = line

    def _place(self, obstacles: Sequence[Outline], view: View) -> None:
        """Draw the obstacles on the background, below the circles."""
        shapes = [shape for outline in obstacles for shape in _convex(outline, 0.5 * LINE_PX / view.scale)]
        if shapes:
            points = (np.concatenate(shapes) - (view.left, view.top)) * (view.scale, -view.scale)
            first = np.concatenate(([0], np.cumsum([len(shape) for shape in shapes])))
            unit("tools").draw_convex(self._background, points, first, np.uint32(swapped(self.theme.obstacle)))


def draw_marks(
    pixels: Packed, position: NDArray[Any], radius: NDArray[Any], angle: NDArray[np.float64], colours: Packed, view: View
) -> None:
    """Mark discs (n, 2) and (n,) in m, turned by (n,) rad, in half of their own brightness, once one has turned."""
    if not angle.any():
        return
    shown = np.flatnonzero(radius * view.scale >= MARKED_PX)
    if not len(shown):
        return
    centre, turned = position[shown].astype(np.float64), angle[shown]
    reach = radius[shown].astype(np.float64)[:, None]
    rim = centre + reach * np.column_stack((np.cos(turned), np.sin(turned)))
    half = np.asarray((colours[shown] >> np.uint32(1)) & np.uint32(0x7F7F7F), dtype=np.uint32)
    ends = np.stack((centre, rim), axis=1)
    unit("tools", np.float64).draw_lines(pixels, ends, half, view.left, view.top, view.scale, MARK_PX / 2)


def paint(
    pixels: Packed, ground: Packed, position: NDArray[Any], radius: NDArray[Any], angle: NDArray[np.float64] | None,
    colours: Packed, links: tuple[NDArray[Any], Packed] | None, view: View,
) -> None:  # fmt: skip
    """Draw discs over the background in `pixels`, their marks, and links: ends (m, 2, 2) in m, and (m,) colours."""
    unit("tools", position.dtype).draw_discs(pixels, ground, position, radius, colours, view.left, view.top, view.scale)
    if angle is not None:
        draw_marks(pixels, position, radius, angle, colours, view)
    if links is not None:
        ends, pulls = links
        unit("tools", ends.dtype).draw_lines(pixels, ends, pulls, view.left, view.top, view.scale, LINK_PX / 2)


def _convex(outline: Outline, half: float) -> list[NDArray[np.float64]]:
    """Convex polygons of an outline: itself, or a bar for each part of a line `2 half` metres wide."""
    if outline.filled:
        return [outline.points]
    bars = []
    for a, b in pairwise(outline.points):
        along = (b - a) * (half / max(float(np.hypot(*(b - a))), 1e-30))
        across = np.array([-along[1], along[0]])
        bars.append(np.array([a - along - across, b + along - across, b + along + across, a - along + across]))
    return bars


def check_size(size: tuple[int, int]) -> tuple[int, int]:
    """Check (width, height) in pixels, which must not be absurdly large."""
    try:
        width, height = size
    except (TypeError, ValueError):
        raise InputError(f"size is {size!r}; allowed are two whole numbers (width, height)") from None
    result = (checks.integer("width", width), checks.integer("height", height))
    if result[0] * result[1] > MOST_PIXELS:
        raise InputError(f"size is {width} x {height}; allowed are at most {MOST_PIXELS:,} pixels")
    return result


SLICES = 8  # lines per row of pixels in fills, so that flat rims have steps of an eighth


def draw_drawing(pixels: Packed, drawing: Drawing, view: View, theme: Theme) -> None:
    """Draw on (h, w) pixels of the view, in the order of drawing. Text needs Pillow."""
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
    """(h, w) coverage of each pixel by a text."""
    require("text in a picture", "PIL", extra="record")
    from PIL import Image, ImageDraw, ImageFont

    font: Any = ImageFont.load_default(size)
    left, top, right, bottom = ImageDraw.Draw(Image.new("L", (1, 1))).multiline_textbbox((0, 0), text, font=font)
    picture = Image.new("L", (max(1, int(right - left) + 2), max(1, int(bottom - top) + 2)))
    ImageDraw.Draw(picture).multiline_text((1 - left, 1 - top), text, fill=255, font=font)
    return np.asarray(np.asarray(picture) / 255, np.float32)
