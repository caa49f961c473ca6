"""A world to pixels, everything chosen: what part of the plane, which colours, dark or light. For recordings and windows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.errors import InputError
from pyverlet.picture import DARK, ByOrigin, Colouring, Pen, Raster, Theme, View
from pyverlet.picture.pen import Draw, Drawing
from pyverlet.picture.view import Rect
from pyverlet.viewers.frames import Camera, outline
from pyverlet.world.world import World


@dataclass(frozen=True)
class PictureStyle:
    """What pictures of a world show, and how; InputError if an attribute is something else."""

    colour: Colouring | None = None  # what the colours say; None is where each circle started
    theme: Theme = DARK  # or LIGHT
    part: Rect | None = None  # of the plane; None is the bounds, or where the particles are
    draw: Draw | None = None  # a function of (world, pen) that draws over each picture

    def __post_init__(self) -> None:
        if self.colour is not None and not isinstance(self.colour, Colouring):
            raise InputError(f"colour is {self.colour!r}; allowed is an object such as pyverlet.picture.BySpeed()")
        if not isinstance(self.theme, Theme):
            raise InputError(f"theme is {self.theme!r}; allowed are pyverlet.picture.DARK and LIGHT")
        if self.draw is not None and not callable(self.draw):
            raise InputError(f"draw is {self.draw!r}; allowed is a function of (world, pen)")

    def drawing(self, world: World) -> Drawing:
        """What `draw` draws over a picture of the world as it is."""
        pen = Pen()
        if self.draw is not None:
            self.draw(world, pen)
        return pen.drawing


class Renderer:
    """Paints one world, as it is now, whenever asked.

    Attributes:
        view: the part of the plane on the last picture; before the first, that of the world as it is.
    """

    def __init__(self, world: World, size: tuple[int, int], style: PictureStyle | None = None) -> None:
        self._world = world
        self._style = PictureStyle() if style is None else style
        self._raster = Raster(size, theme=self._style.theme)
        self._colour = self._style.colour or ByOrigin()
        self._camera = Camera(world, part=self._style.part)
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
        drawing = self._style.drawing(self._world)
        return self._raster.draw(self._world, self.view, outlines=self._outlines, colours=colours, drawing=drawing)

    def _look(self) -> View:
        return View.fit(self._camera.view(self._world.position), self._raster.size)
