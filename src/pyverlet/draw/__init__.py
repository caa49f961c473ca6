"""Worlds in your own game loops: `pyverlet.draw.pygame`, `.pyglet` and `.arcade`. Importing one loads its library.

`fit` makes the view that maps metres to pixels; `View` has `to_screen`, `to_world`, `zoomed`, `moved`, `pick`.
"""

from pyverlet.common.submodules import lazily
from pyverlet.picture import View
from pyverlet.viewers.frames import Camera
from pyverlet.world.world import World

__all__ = ["View", "fit"]

__getattr__, __dir__ = lazily(__name__)


def fit(world: World, size: tuple[int, int], *, y_up: bool = False) -> View:
    """The view of all of a world's bounds or, if it is unbounded, of its particles.

    Args:
        world: only read.
        size: (width, height) of the window, pixels.
        y_up: True if pixels count upward: pyglet and arcade.
    """
    return View.fit(Camera(world).view(world.position), size, y_up=y_up)
