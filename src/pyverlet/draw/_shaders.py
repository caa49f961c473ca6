"""Draws circles on a graphics card: one point each, with positions directly from the world's array, in metres."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.picture import DARK, ByOrigin, Colouring, Theme, View, periodic_images
from pyverlet.picture.raster import MARKED_PX
from pyverlet.world.world import World

VERTEX = """#version 330
in vec2 place;
in float radius;
in float angle;  // rad
in vec4 tint;
uniform vec4 window;  // metres at its left and top; from metres to its half widths, its half heights
uniform float scale;  // pixels a metre
out vec3 colour;
out float reach;
out vec2 way;
void main() {
    gl_Position = vec4((place - window.xy) * window.zw + vec2(-1.0, 1.0), 0.0, 1.0);
    reach = max(radius * scale, 0.5);
    gl_PointSize = 2.0 * reach + 2.0;
    colour = tint.rgb;
    way = vec2(cos(angle), -sin(angle));  // points have their y down
}
"""

FRAGMENT = """#version 330
in vec3 colour;
in float reach;
in vec2 way;
uniform float marked;  // pixels of the radius from which on there is a mark
out vec4 pixel;
void main() {
    vec2 from = (gl_PointCoord - 0.5) * (2.0 * reach + 2.0);
    float distance = length(from);
    float cover = clamp(reach + 0.5 - distance, 0.0, 1.0);
    if (cover <= 0.0) discard;
    float aside = abs(from.x * way.y - from.y * way.x);
    float mark = reach >= marked && dot(from, way) >= 0.0 ? 0.5 * clamp(1.2 - aside, 0.0, 1.0) : 0.0;
    pixel = vec4(colour * (1.0 - mark), cover);
}
"""


class ShaderCircles:
    """The circles of a world. Create it after the window; call `draw` in `on_draw`.

    The card limits the size of circles, to at least 255 pixels on current cards. Arrays of float32 are not copied.

    Args:
        world: only read.
        colour: the colouring; by default the initial position of each circle.
        theme: whether the colours are for a dark or a light background.
    """

    _program: Any

    def __init__(self, world: World, *, colour: Colouring | None = None, theme: Theme = DARK) -> None:
        self._world = world
        self._colour = ByOrigin() if colour is None else colour
        self._theme = theme

    def _set_uniforms(self, view: View, pixel_ratio: float) -> None:
        """Set the uniforms; circles have a mark from a radius of MARKED_PX on, once one has turned."""
        self._program["window"] = (view.left, view.top, 2.0 * view.scale / view.width, 2.0 * view.scale / view.height)
        self._program["scale"] = view.scale * pixel_ratio
        self._program["marked"] = MARKED_PX if self._world.angle.any() else float("inf")

    def _now(self) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
        """Positions (n, 2), radii, angles, colours (n,): contiguous, and writable, as ctypes requires."""
        colours = self._colour.colours(self._world, self._theme)
        position, radius, angle, colours = periodic_images.circles(self._world, colours)
        return (
            np.ascontiguousarray(position, dtype=np.float32),
            np.ascontiguousarray(radius, dtype=np.float32),
            np.remainder(angle, 2 * np.pi, dtype=np.float64).astype(np.float32),
            np.require(colours, requirements=["C", "W"]),
        )
