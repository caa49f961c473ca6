"""Where `pyverlet run` shows a scene: the live page, or a window."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from pyverlet.cli import _print as out
from pyverlet.panels import Panels
from pyverlet.progress import Progress
from pyverlet.scenes import Scene, Settings


def page(scene: Scene, build: Callable[[], Panels], *, dt: float, port: int, open_browser: bool) -> None:
    """Show what `build` makes on the live page until Ctrl-C."""
    from pyverlet.viewers import serve

    if scene.show.colours:
        out.note("the page does not show this picture yet; with --window, or recorded by `pyverlet record`, it can be seen")
    serve(build, scene_name=scene.name, port=port, open_browser=open_browser, dt=dt)


def window(scene: Scene, settings: Settings, *, dt: float) -> None:
    """Show the scene's world, the first of several, in a window until it is closed."""
    from pyverlet.picture import Fixed
    from pyverlet.viewers import window as viewer

    viewer.check_extra()
    if scene.variants:
        out.note(f"a window shows one of the {len(scene.variants)} worlds of {scene.name}; the page shows them side by side")
    colour = None
    if scene.show.colours:
        with Progress("where each circle ends") as progress:
            colour = Fixed(scene.show.colours(settings, dt, progress))
    out.note(viewer.KEYS)
    part = scene.show.view(settings) if scene.show.view else None
    viewer.show(partial(scene.build, settings), title=scene.name, dt=dt, colour=colour, part=part)
