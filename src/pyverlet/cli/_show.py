"""Where `pyverlet run` shows a scene: the live page, or a window."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pyverlet.cli import _print as out
from pyverlet.ground.progress import Progress
from pyverlet.laws.integrators import Integrator
from pyverlet.picture import DARK, Colouring, Fixed, Theme
from pyverlet.scenes import SCENES, Scene, Settings
from pyverlet.scenes.sketch import Sketch
from pyverlet.viewers.renderer import PictureStyle

if TYPE_CHECKING:
    from contextlib import AbstractContextManager

    from pyverlet.viewers.session import Session


def page(
    scene: Scene,
    *,
    integrators: Sequence[Integrator],
    overrides: Mapping[str, Any],
    dt: float,
    journal: Path | None,
    options: Mapping[str, Any],
) -> None:
    """Show the scene on the live page until Ctrl-C, and keep what happens there in a journal if one is asked for."""
    from pyverlet.viewers.journal import Journal
    from pyverlet.viewers.launch import serve
    from pyverlet.viewers.presentation import Presentation, Repertoire

    SCENES.setdefault(scene.name, scene)  # one from a file may be picked on the page like the others
    repertoire = Repertoire(scene, dt=dt, integrators=integrators, overrides=overrides)

    def build() -> Presentation:
        with Progress("where each circle ends") as progress:
            return repertoire.open(progress)

    if journal is None:
        serve(build, title=scene.name, repertoire=repertoire, dt=dt, **options)
        return
    with Journal(journal, dt=dt) as kept:
        serve(build, title=scene.name, repertoire=repertoire, dt=dt, view_state=kept.view_state, **options)
    out.note(f"'{journal}' holds {kept.frame:,} frames: pyverlet replay '{journal}'")


def watched(path: Path, *, dt: float, options: Mapping[str, Any], **build: Any) -> None:
    """Show a sketch on the live page until Ctrl-C, and build it anew whenever it is saved; `build`: as for `SketchBuilder`."""
    from pyverlet.viewers.launch import serve
    from pyverlet.viewers.watching import SketchBuilder, Watcher

    builder = SketchBuilder(path, dt=dt, **build)
    Sketch.read(path)  # a missing one is an error here, not on a page

    def while_running(session: Session) -> AbstractContextManager[None]:
        return Watcher(builder, session).at_work()

    serve(builder.first, title=path.stem, dt=dt, while_running=while_running, **options)


def window(scene: Scene, settings: Settings, *, dt: float) -> None:
    """Show the scene's world, the first of several, in a window until it is closed."""
    from pyverlet.viewers import window as viewer

    viewer.check_extra()
    if scene.variants:
        out.note(f"a window shows one of the {len(scene.variants)} worlds of {scene.name}; the page shows them side by side")
    style = picture_style(scene, settings, dt)
    out.note(viewer.KEYS)
    viewer.show(partial(scene.build, settings), title=scene.name, dt=dt, style=style)


def picture_style(
    scene: Scene, settings: Settings, dt: float, colour: Colouring | None = None, theme: Theme = DARK
) -> PictureStyle:
    """Pictures as the scene asks for them, in its colours unless others are given."""
    show = scene.show
    if colour is None and show.colours:
        with Progress("where each circle ends") as progress:
            colour = Fixed(show.colours(settings, dt, progress))
    part = show.view(settings) if show.view else None
    return PictureStyle(colour, theme, part, scene.sketch.drawn if scene.sketch and scene.sketch.has("draw") else None)
