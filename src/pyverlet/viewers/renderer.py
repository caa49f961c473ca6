"""Renders worlds and frames to pixels with chosen part of the plane, colours and theme.

For recordings and windows, and for pages: for very many circles a picture is smaller to send and faster to draw than circles.
"""

import importlib.util
import io
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import InputError
from pyverlet.laws.obstacles import Outline
from pyverlet.picture import DARK, LIGHT, ByOrigin, Colouring, Fixed, Pen, Raster, Theme, View
from pyverlet.picture.colour import COLOURINGS, Packed
from pyverlet.picture.pen import Draw, Drawing
from pyverlet.picture.view import Rect
from pyverlet.viewers.commands import MOST_PIXELS, ViewOptions
from pyverlet.viewers.frames import Camera, Frame, Shape, outline
from pyverlet.world.world import World


@dataclass(frozen=True)
class PictureStyle:
    """Options of pictures of a world; InputError if an attribute is invalid."""

    colour: Colouring | None = None  # colouring; None: by initial position
    theme: Theme = DARK  # or LIGHT
    part: Rect | None = None  # of the plane; None: the bounds, or where the particles are
    draw: Draw | None = None  # a function of (world, pen) that draws over each picture

    def __post_init__(self) -> None:
        if self.colour is not None and not isinstance(self.colour, Colouring):
            raise InputError(f"colour is {self.colour!r}; allowed is an object such as pyverlet.picture.BySpeed()")
        if not isinstance(self.theme, Theme):
            raise InputError(f"theme is {self.theme!r}; allowed are pyverlet.picture.DARK and LIGHT")
        if self.draw is not None and not callable(self.draw):
            raise InputError(f"draw is {self.draw!r}; allowed is a function of (world, pen)")

    def drawing(self, world: World) -> Drawing:
        """The result of `draw` for the current world."""
        pen = Pen()
        if self.draw is not None:
            self.draw(world, pen)
        return pen.drawing


class Renderer:
    """Renders the current state of one world on demand.

    Attributes:
        view: the part of the plane in the last picture; before the first, that for the current world.
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
        """(height, width, 4) bytes R, G, B, A of a view, by default the renderer's own; valid until the next call."""
        if self._boundary is not self._world.boundary:
            self._boundary = self._world.boundary
            self._outlines = outline(self._boundary)
        self.view = self._look() if view is None else view
        colours = self._colour.colours(self._world, self._raster.theme)
        drawing = self._style.drawing(self._world)
        return self._raster.draw(self._world, self.view, outlines=self._outlines, colours=colours, drawing=drawing)

    def _look(self) -> View:
        return View.fit(self._camera.view(self._world.position), self._raster.size)


PICTURES_FROM = 150_000  # circles: a browser takes 50 ms to receive 2 MB, and as long to draw so many; a picture is smaller
QUALITY = 85  # JPEG quality without visible blocks at rims; 900 x 900 pixels take about 400 kB

ADVICE = "a world of this size is shown faster as pictures: pip install 'pyverlet[page]'"


def draws_here(shape: Shape) -> bool:
    """Whether pages are sent pictures of this world instead of circles."""
    return len(shape.radius) >= PICTURES_FROM and _can_draw()


def advice(shape: Shape) -> str | None:
    """A note for pages that could be sent pictures, if Pillow is missing."""
    return ADVICE if len(shape.radius) >= PICTURES_FROM and not _can_draw() else None


def _can_draw() -> bool:
    return importlib.util.find_spec("PIL") is not None


@dataclass
class _Seen:
    """World attributes for colourings, from a frame."""

    velocity: NDArray[Any]
    mass: NDArray[Any]
    group_number: NDArray[Any]
    time: float

    def __len__(self) -> int:
        return len(self.mass)


class JpegRenderer:
    """Makes JPEGs of frames in its own thread: drawing and encoding hold no lock that the physics needs."""

    def __init__(self) -> None:
        self.thread = ThreadPoolExecutor(1, thread_name_prefix="pyverlet-renderer")
        self._raster: Raster | None = None
        self._colouring: Colouring = ByOrigin()
        self._colouring_of: tuple[str, Shape | None] = ("", None)
        self._still: tuple[Any, Packed] | None = None
        self._sorted: tuple[Any, Any, NDArray[np.float32]] = (None, None, np.empty(0, np.float32))
        self._still_sorted: tuple[Any, Packed] = (None, np.empty(0, np.uint32))
        self._outlines: tuple[Any, Any, tuple[Outline, ...]] = (None, None, ())

    def jpeg(self, frame: Frame, options: ViewOptions) -> bytes:
        """The frame with these options. Runs in the renderer's thread."""
        from PIL import Image

        pixels, file = self._paint(frame, options), io.BytesIO()
        height, width = pixels.shape[:2]
        Image.frombuffer("RGB", (width, height), pixels, "raw", "RGBX", 0, 1).save(file, "JPEG", quality=QUALITY)
        return file.getvalue()

    def _paint(self, frame: Frame, options: ViewOptions) -> NDArray[np.uint8]:
        part = frame.view if options.part is None else options.part
        theme = DARK if options.dark else LIGHT
        size = fit(part, (options.width, options.height))
        if self._raster is None or (self._raster.size, self._raster.theme) != (size, theme):
            self._raster = Raster(size, theme=theme)
        own = self._colours(frame, options.colour, theme)
        (colours, radius), (owner, place) = self._in_rows(frame, own), frame.copies
        view = View(part[0], part[3], size[0] / (part[2] - part[0]), *size)
        standing, moving = frame.shape.obstacles, frame.obstacles
        if self._outlines[0] is not standing or self._outlines[1] is not moving:  # otherwise the raster need not draw them again
            self._outlines = (standing, moving, standing + moving)
        angle = None  # no circle has turned yet
        if len(frame.turned):
            turned = frame.turned if frame.order is None else frame.turned[frame.order]
            angle = np.asarray(np.concatenate((turned, frame.turned[owner])) * (np.pi / 128), float)
        return self._raster.discs(
            np.concatenate((frame.rows, place)) if len(owner) else frame.rows,
            np.concatenate((radius, frame.shape.radius[owner])) if len(owner) else radius,
            view,
            outlines=frame.shape.outlines,
            obstacles=self._outlines[2],
            colours=np.concatenate((colours, own[owner])) if len(owner) else colours,
            links=frame.segments if len(frame.joined) else None,
            angle=angle,
        )

    def _in_rows(self, frame: Frame, colours: Packed) -> tuple[Packed, NDArray[np.float32]]:
        """Colours and radii in the order of the frame's rows, cached because it rarely changes."""
        radius, order = frame.shape.radius, frame.order
        if order is None:
            return colours, radius
        if self._sorted[0] is not order or self._sorted[1] is not radius:
            self._sorted = (order, radius, radius[order])
            self._still_sorted = (None, colours)
        if self._still_sorted[0] is not colours:
            self._still_sorted = (colours, colours[order])
        return self._still_sorted[1], self._sorted[2]

    def _colours(self, frame: Frame, name: str, theme: Theme) -> Packed:
        shape = frame.shape
        if name == "picture" and shape.colours is None:
            name = "order"
        if self._colouring_of != (name, shape):
            self._colouring_of = (name, shape)
            own = shape.colours if name == "picture" else None
            # Forces are not computed for so many circles.
            self._colouring = COLOURINGS.get(name, ByOrigin)() if own is None else Fixed(own)
            self._still = None
        # Most colourings rarely change. Velocities must be sorted, which takes as long as drawing.
        if name in ("speed", "energy") or self._still is None or self._still[0] is not theme:
            seen = _Seen(frame.velocity, shape.mass, shape.group, frame.status.time)
            self._still = (theme, self._colouring.colours(cast(Any, seen), theme))
        return self._still[1]


def fit(part: tuple[float, float, float, float], room: tuple[int, int]) -> tuple[int, int]:
    """Size in pixels of a picture of `part`, as large as fits into `room`, within a sensible limit."""
    width, height = part[2] - part[0], part[3] - part[1]
    scale = min(room[0] / width, room[1] / height, (MOST_PIXELS / (width * height)) ** 0.5)
    return max(1, round(width * scale)), max(1, round(height * scale))
