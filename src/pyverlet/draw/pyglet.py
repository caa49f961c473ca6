"""Draws a world in a pyglet window: one call of the graphics card for all circles."""

from __future__ import annotations

import ctypes

from pyglet import gl
from pyglet.graphics.shader import Shader, ShaderProgram

from pyverlet.draw._shaders import FRAGMENT, VERTEX, ShaderCircles
from pyverlet.picture import DARK, Colouring, Theme, View
from pyverlet.world.world import World

__all__ = ["Circles"]

ATTRIBUTES = (
    ("place", 2, gl.GL_FLOAT, False),
    ("radius", 1, gl.GL_FLOAT, False),
    ("angle", 1, gl.GL_FLOAT, False),
    ("tint", 4, gl.GL_UNSIGNED_BYTE, True),
)


class Circles(ShaderCircles):
    """The circles of a world in pyglet's window; arguments as for `ShaderCircles`."""

    def __init__(self, world: World, *, colour: Colouring | None = None, theme: Theme = DARK) -> None:
        super().__init__(world, colour=colour, theme=theme)
        self._program = ShaderProgram(Shader(VERTEX, "vertex"), Shader(FRAGMENT, "fragment"))
        self._vertices = gl.GLuint()
        gl.glGenVertexArrays(1, self._vertices)
        gl.glBindVertexArray(self._vertices)
        self._buffers = (gl.GLuint * len(ATTRIBUTES))()
        gl.glGenBuffers(len(ATTRIBUTES), self._buffers)
        for buffer, (name, count, kind, normalised) in zip(self._buffers, ATTRIBUTES, strict=True):
            where = self._program.attributes[name]["location"]
            gl.glBindBuffer(gl.GL_ARRAY_BUFFER, buffer)
            gl.glEnableVertexAttribArray(where)
            gl.glVertexAttribPointer(where, count, kind, normalised, 0, None)
        gl.glBindVertexArray(0)

    def draw(self, view: View, *, pixel_ratio: float = 1.0) -> None:
        """Draw the circles in their current state.

        Args:
            view: with `y_up=True`; see `pyverlet.draw.fit`.
            pixel_ratio: of the window, `window.get_pixel_ratio()`.
        """
        arrays = self._now()
        gl.glBindVertexArray(self._vertices)
        for buffer, array in zip(self._buffers, arrays, strict=True):
            gl.glBindBuffer(gl.GL_ARRAY_BUFFER, buffer)
            gl.glBufferData(gl.GL_ARRAY_BUFFER, array.nbytes, ctypes.c_void_p(array.ctypes.data), gl.GL_STREAM_DRAW)
        self._program.use()
        self._set_uniforms(view, pixel_ratio)
        gl.glEnable(gl.GL_PROGRAM_POINT_SIZE)
        gl.glEnable(gl.GL_BLEND)
        gl.glBlendFunc(gl.GL_SRC_ALPHA, gl.GL_ONE_MINUS_SRC_ALPHA)
        gl.glDrawArrays(gl.GL_POINTS, 0, len(arrays[1]))
        gl.glBindVertexArray(0)
        self._program.stop()
