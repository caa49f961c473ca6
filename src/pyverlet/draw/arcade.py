"""Draws a world in an arcade window: one call of the graphics card for all circles."""

from __future__ import annotations

from typing import Any

import arcade
from arcade.gl import BufferDescription
from pyglet import gl  # arcade has no name for points sized by the program

from pyverlet.draw._shaders import FRAGMENT, VERTEX, ShaderCircles
from pyverlet.picture import DARK, Colouring, Theme, View
from pyverlet.world.world import World

__all__ = ["Circles"]


class Circles(ShaderCircles):
    """The circles of a world in arcade's window; arguments as for `ShaderCircles`."""

    def __init__(self, world: World, *, colour: Colouring | None = None, theme: Theme = DARK) -> None:
        super().__init__(world, colour=colour, theme=theme)
        self._context: Any = arcade.get_window().ctx
        self._program = self._context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
        self._room = 0

    def _reserve(self, count: int) -> None:
        """Allocate buffers for `count` circles, as they cannot grow."""
        self._room = count
        formats = (("2f", "place", 8), ("1f", "radius", 4), ("1f", "angle", 4), ("4f1", "tint", 4))
        self._buffers = [self._context.buffer(reserve=count * size) for _, _, size in formats]
        content = [
            BufferDescription(buffer, kind, [name], normalized=["tint"] if name == "tint" else [])
            for buffer, (kind, name, _) in zip(self._buffers, formats, strict=True)
        ]
        self._geometry = self._context.geometry(content, mode=self._context.POINTS)

    def draw(self, view: View, *, pixel_ratio: float = 1.0) -> None:
        """Draw the circles in their current state.

        Args:
            view: with `y_up=True`; see `pyverlet.draw.fit`.
            pixel_ratio: of the window, `window.get_pixel_ratio()`.
        """
        arrays = self._now()
        count = len(arrays[1])
        if count == 0:
            return
        if count > self._room:
            self._reserve(2 * count)
        for buffer, array in zip(self._buffers, arrays, strict=True):
            buffer.write(array.data.cast("B"))
        self._set_uniforms(view, pixel_ratio)
        with self._context.enabled(gl.GL_PROGRAM_POINT_SIZE, self._context.BLEND):
            self._context.blend_func = self._context.BLEND_DEFAULT
            self._geometry.render(self._program, vertices=count)
