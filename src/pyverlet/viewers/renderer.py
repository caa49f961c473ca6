"""A world to pixels, everything chosen: what part of the plane, which colours, dark or light. For recordings and windows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.errors import InputError
from pyverlet.picture import DARK, ByOrigin, Colouring, Pen, Raster, Theme, View
from pyverlet.picture.pen import Draw, Drawing
from pyverlet.picture.view import Rect
from pyverlet.viewers.frames import Camera, outline

if TYPE_CHECKING:
    from pyverlet.world.world import World


def check_look(colour: Any, theme: Any) -> None:
    """Raise InputError unless these are a colouring or None, and a theme."""
    if colour is not None and not isinstance(colour, Colouring):
        raise InputError(f"colour is {colour!r}; allowed is an object such as pyverlet.picture.BySpeed()")
    if not isinstance(theme, Theme):
        raise InputError(f"theme is {theme!r}; allowed are pyverlet.picture.DARK and LIGHT")


class Renderer:
    """Paints one world, as it is now, whenever asked. Arguments as for `pyverlet.record.to_image`.

    Attributes:
        view: the part of the plane on the last picture; before the first, that of the world as it is.
    """

    def __init__(
        self,
        world: World,
        *,
        size: tuple[int, int] = (1280, 720),
        colour: Colouring | None = None,
        theme: Theme = DARK,
        part: Rect | None = None,
        draw: Draw | None = None,
    ) -> None:
        check_look(colour, theme)
        if draw is not None and not callable(draw):
            raise InputError(f"draw is {draw!r}; allowed is a function of (world, pen)")
        self._world = world
        self._draw = draw
        self._raster = Raster(size, theme=theme)
        self._colour = ByOrigin() if colour is None else colour
        self._camera = Camera(world)
        self._part = part
        self._boundary: Any = None
        self.view = self._look()

    @property
    def size(self) -> tuple[int, int]:
        """(width, height), pixels."""
        return self._raster.size

    def paint(self, view: View | None = None) -> NDArray[np.uint8]:
        """(height, width, 4) bytes R, G, B, A of a view, by default the renderer's own; good until the next call."""
        if self._boundary is not self._world.boundary:
            self._boundary = self._world.boundary
            self._outlines = outline(self._boundary)
        self.view = self._look() if view is None else view
        colours = self._colour.colours(self._world, self._raster.theme)
        drawing: Drawing = ()
        if self._draw:
            pen = Pen()
            self._draw(self._world, pen)
            drawing = pen.drawing
        return self._raster.draw(self._world, self.view, outlines=self._outlines, colours=colours, drawing=drawing)

    def _look(self) -> View:
        part = self._camera.view(self._world.position) if self._part is None else self._part
        return View.fit(part, self._raster.size)
