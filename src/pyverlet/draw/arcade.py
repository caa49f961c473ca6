"""A world in an arcade window: one call of the graphics card for all circles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import arcade
from arcade.gl import BufferDescription
from pyglet import gl  # arcade has no name of its own for points sized by the program

from pyverlet.draw._shaders import FRAGMENT, VERTEX, Arrays, window
from pyverlet.picture import DARK, Colouring, Theme, View

if TYPE_CHECKING:
    from pyverlet.world.world import World

__all__ = ["Circles"]


class Circles:
    """The circles of a world. Make it once the window is there; call `draw` in `on_draw`.

    The card draws circles up to a largest size, 255 pixels across at least on today's cards.

    Args:
        world: only read.
        colour: what the colours say; by default where each circle started.
        theme: whether the colours are for a dark or a light background.
    """

    def __init__(self, world: World, *, colour: Colouring | None = None, theme: Theme = DARK) -> None:
        self._arrays = Arrays(world, colour, theme)
        self._context: Any = arcade.get_window().ctx
        self._program = self._context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self._room = 0

    def _make_room(self, count: int) -> None:
        """Buffers for `count` circles: they cannot grow."""
        self._room = count
        formats = (("2f", "place", 8), ("1f", "radius", 4), ("1f", "angle", 4), ("4f1", "tint", 4))
        self._buffers = [self._context.buffer(reserve=count * size) for _, _, size in formats]
        content = [
            BufferDescription(buffer, kind, [name], normalized=["tint"] if name == "tint" else [])
            for buffer, (kind, name, _) in zip(self._buffers, formats, strict=True)
        ]
        self._geometry = self._context.geometry(content, mode=self._context.POINTS)

    def draw(self, view: View, *, pixel_ratio: float = 1.0) -> None:
        """Draw them as they are now.

        Args:
            view: with `y_up=True`; see `pyverlet.draw.fit`.
            pixel_ratio: of the window, `window.get_pixel_ratio()`.
        """
        arrays = self._arrays.now()
        count = len(arrays[1])
        if count == 0:
            return
        if count > self._room:
            self._make_room(2 * count)
        for buffer, array in zip(self._buffers, arrays, strict=True):
            buffer.write(array.data.cast("B"))
        self._program["window"] = window(view)
        self._program["scale"] = view.scale * pixel_ratio
        self._program["marked"] = self._arrays.marked
        with self._context.enabled(gl.GL_PROGRAM_POINT_SIZE, self._context.BLEND):
            self._context.blend_func = self._context.BLEND_DEFAULT
            self._geometry.render(self._program, vertices=count)
