"""A picture of a world by moderngl, without a window: positions go from the world's array to the graphics card as they are.

pip install "pyverlet[record]" moderngl
python examples/with_moderngl.py heap.png
"""

from __future__ import annotations

import sys
from typing import Any

import moderngl
import numpy as np
from PIL import Image

import pyverlet as pv
from pyverlet import draw, picture

SIZE = (900, 600)

VERTEX = """#version 330
in vec2 place; in float radius; in vec4 tint;
uniform vec4 window; uniform float scale;
out vec4 colour; out float reach;
void main() {
    gl_Position = vec4((place - window.xy) * window.zw + vec2(-1.0, 1.0), 0.0, 1.0);
    reach = radius * scale;
    gl_PointSize = 2.0 * reach + 2.0;
    colour = tint;
}"""

FRAGMENT = """#version 330
in vec4 colour; in float reach; out vec4 pixel;
void main() {
    float distance = length(gl_PointCoord - 0.5) * (2.0 * reach + 2.0);
    pixel = vec4(colour.rgb, clamp(reach + 0.5 - distance, 0.0, 1.0));
}"""


def render(world: pv.World, context: Any) -> np.ndarray:
    """(height, width, 3) bytes R, G, B."""
    view = draw.fit(world, SIZE)
    colours = picture.BySpeed().colours(world, picture.DARK)
    program = context.program(vertex_shader=VERTEX, fragment_shader=FRAGMENT)
    program["window"] = (view.left, view.top, 2 * view.scale / view.width, 2 * view.scale / view.height)
    program["scale"] = view.scale
    # In a loop, make the buffers once and call buffer.write(world.position): the array's memory is what the card wants.
    content = [
        (context.buffer(world.position), "2f", "place"),
        (context.buffer(world.radius), "1f", "radius"),
        (context.buffer(colours), "4f1", "tint"),
    ]
    target = context.simple_framebuffer(SIZE)
    target.use()
    target.clear(0.06, 0.07, 0.09)
    context.enable(moderngl.PROGRAM_POINT_SIZE | moderngl.BLEND)
    context.vertex_array(program, content).render(moderngl.POINTS)
    rows = np.frombuffer(target.read(components=3), dtype=np.uint8).reshape(SIZE[1], SIZE[0], 3)
    return rows[::-1]  # the card counts rows from the foot


def main() -> None:
    """Let 2,000 circles fall for a second and a half, and write the picture."""
    world = pv.scenes.get("cage").world(particles=2000)
    world.run(seconds=1.5)
    # On a machine without a screen: context = moderngl.create_context(standalone=True, backend="egl")
    context = moderngl.create_context(standalone=True, **({"backend": "egl"} if "--egl" in sys.argv else {}))
    Image.fromarray(render(world, context)).save(sys.argv[1])


if __name__ == "__main__":
    main()
