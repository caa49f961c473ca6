"""The adapters that draw by graphics card, each in a process of its own with an invisible window: what was drawn is read back."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
ARCADES = os.environ.get("PYVERLET_TEST_ARCADE", sys.executable)
"""The Python that has arcade: of an environment of its own, for it does not go together with the rest (pyproject.toml)."""
NO_CARD = 77

# 400 x 300 pixels of a world 8 m x 6 m, 50 pixels a metre, seen through each library; red, green and blue circles.
WORLD = """
import numpy as np, sys
import pyverlet as pv
from pyverlet.picture import Fixed, View
world = pv.World(boundary=pv.Box((0, 0), (8, 6)), dtype=np.dtype(sys.argv[1]))
discs = world.add(position=[(2, 3), (6, 4.5), (5, 1)], radius=[1.0, 0.5, 0.25])
view = View.fit((0, 0, 8, 6), (400, 300), y_up=True)
colour = Fixed([(255, 0, 0), (0, 255, 0), (0, 0, 255)])

def check(rows):  # (height, width, 3), the foot first
    red, green, blue = (rows[..., k].astype(float) / 255 for k in range(3))
    for channel, (x, y), r in ((red, (2, 3), 50), (green, (6, 4.5), 25), (blue, (5, 1), 12.5)):
        assert channel[int(50 * y), int(50 * x)] == 1.0, (x, y, channel[int(50 * y), int(50 * x)])
        middle = [(channel.sum(axis=a) * (np.arange(channel.shape[1 - a]) + 0.5)).sum() / channel.sum() for a in (0, 1)]
        assert np.allclose(middle, (50 * x, 50 * y), atol=0.1), middle
        # A rim that fades over a pixel, from r - 1/2 to r + 1/2, covers pi (r^2 + 1/12); sampled at centres, off by a little.
        assert abs(channel.sum() - np.pi * (r * r + 1 / 12)) < 0.02 * np.pi * r * r, channel.sum()
    print("seen")

def check_marks(rows):  # the red one has turned by a quarter, the others by nothing: a darker line up, no other
    red = rows[..., 0].astype(int)
    assert red[175, 100] < 190 and red[175, 90] == 255 and red[125, 100] == 255, (red[175, 90:110], red[125, 100])
    print("marked")
"""

PYGLET = """
import pyglet
pyglet.options["headless"] = True
try:
    window = pyglet.window.Window(400, 300)
except Exception as error:
    print(error); sys.exit(77)
from pyglet import gl
from pyverlet.draw.pyglet import Circles

def seen():
    buffer = (gl.GLubyte * (400 * 300 * 3))()
    gl.glPixelStorei(gl.GL_PACK_ALIGNMENT, 1)
    gl.glReadPixels(0, 0, 400, 300, gl.GL_RGB, gl.GL_UNSIGNED_BYTE, buffer)
    return np.frombuffer(buffer, np.uint8).reshape(300, 400, 3)
"""

ARCADE = """
import os
os.environ["ARCADE_HEADLESS"] = "True"
try:
    import arcade
    # Mesa's software draws points half a pixel off where it takes several samples a pixel; one sample says where they are.
    window = arcade.Window(400, 300, antialiasing=False)
except Exception as error:
    print(error); sys.exit(77)
from pyverlet.draw.arcade import Circles

def seen():
    return np.asarray(arcade.get_image(0, 0, 400, 300).convert("RGB"))[::-1]
"""

DRAWN = """
circles = Circles(world, colour=colour)
for _ in range(2):
    window.clear()
    circles.draw(view)
check(seen())
discs.angle[0] = np.pi / 2
window.clear()
circles.draw(view)
check_marks(seen())
world.add(position=[(1, 1)] * 9, radius=0.01)  # more than there was room for
Circles(world).draw(view)
"""


def seen_through(code: str, *arguments: str, library: str = "") -> str:
    """What the code prints, run by the Python that has this library; skipped where none has, or there is nothing to draw on."""
    python = ARCADES if library == "arcade" else sys.executable
    if library and not os.environ.get("CI") and python == sys.executable and importlib.util.find_spec(library) is None:
        pytest.skip(f"{library} is not installed")
    done = subprocess.run([python, "-W", "ignore", "-c", code, *arguments], capture_output=True, text=True, timeout=300)
    if done.returncode == NO_CARD:
        pytest.skip(f"no graphics card, nor software in its place: {done.stdout.strip()[:100]}")
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("dtype", ["float32", pytest.param("float64", marks=pytest.mark.slow)])
@pytest.mark.parametrize(("library", "code"), [("pyglet", PYGLET), ("arcade", ARCADE)])
def test_the_card_draws_the_circles(library: str, code: str, dtype: str) -> None:
    assert "marked" in seen_through(WORLD + code + DRAWN, dtype, library=library)


@pytest.mark.slow
@pytest.mark.parametrize(("library", "update"), [("pyglet", "update"), ("arcade", "on_update")])
def test_the_example_runs(library: str, update: str) -> None:
    code = f"""
import os, sys; os.environ["ARCADE_HEADLESS"] = "True"
import pyglet; pyglet.options["headless"] = True
sys.path.insert(0, {str(EXAMPLES)!r})
try:
    pyglet.window.Window(10, 10).close()
except Exception as error:
    print(error); sys.exit(77)
import with_{library} as example
window = example.Window()
window.{update}(0.05)
window.on_mouse_press(450, 300, 1, 0)
window.on_draw()
print(window.world.frames, len(window.world), *window.world.position[-1].round(2))
"""
    assert seen_through(code, library=library).split()[-4:] == ["3", "2001", "4.5", "3.0"]


@pytest.mark.slow
def test_the_moderngl_example_writes_a_picture(tmp_path: Path) -> None:
    if importlib.util.find_spec("moderngl") is None:
        pytest.skip("moderngl is not installed")
    code = (
        "import sys, moderngl\n"
        "try:\n"
        "    moderngl.create_context(standalone=True, backend='egl')\n"
        "except Exception as error:\n"
        "    print(error); sys.exit(77)\n"
        f"import runpy; sys.argv[0] = 'example'; runpy.run_path({str(EXAMPLES / 'with_moderngl.py')!r}, run_name='__main__')\n"
    )
    seen_through(code, str(tmp_path / "heap.png"), "--egl")
    from PIL import Image

    with Image.open(tmp_path / "heap.png") as picture:
        pixels = np.asarray(picture)
    assert pixels.shape == (600, 900, 3)
    covered = (pixels.max(axis=2) > 60).mean()
    # The cage, 0.94 of the picture's height across, is 60 % full: pi/4 (0.94 600)^2 0.6 of 900 x 600 pixels, less what rims lose.
    assert covered == pytest.approx(np.pi / 4 * (0.94 * 600) ** 2 * 0.6 / (900 * 600), rel=0.12)
