"""What is on show: worlds under a title, with colours and a part of the plane where a scene asks for it; and what could be."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet import scenes
from pyverlet.common.errors import InputError
from pyverlet.common.progress import OnProgress
from pyverlet.laws.integrators import Integrator
from pyverlet.picture.view import Rect
from pyverlet.scenes import Scene
from pyverlet.scenes._scene import GraphReader
from pyverlet.scenes.sketch import Sketch, SketchScene
from pyverlet.scenes.sliders import on_board
from pyverlet.world.panels import Panels
from pyverlet.world.world import World


class CallbackFunctions:
    """Functions draw(world, pen), keys(world, key), click(world, point, button) of a program, and its sliders, as in a sketch."""

    def __init__(self, **functions: Callable[..., Any] | None) -> None:
        self.sliders = on_board()
        self._functions = {name: given for name, given in functions.items() if given is not None}
        for name, given in self._functions.items():
            if not callable(given):
                raise InputError(f"{name} is {given!r}; allowed is a function")

    def has(self, hook: str) -> bool:
        """Whether there is such a function."""
        return hook in self._functions

    def call(self, hook: str, *arguments: Any) -> None:
        """Call it; an InputError says what is wrong, and it is not called any more."""
        if hook not in self._functions:
            return
        try:
            self._functions[hook](*arguments)
        except Exception as error:
            del self._functions[hook]
            raise InputError(f"{hook} has failed, and is not called any more: {type(error).__name__}: {error}") from error


CARRIED = ("seed", "threads", "dtype", "ledger")  # settings that say how to compute, and go along to another scene


@dataclass(frozen=True)
class Presentation:
    """Worlds, ready to be shown."""

    title: str  # heading of the page
    panels: Panels  # the worlds
    scene: str = ""  # the name of the scene they are, or "" for worlds of the user's own
    colours: NDArray[np.uint8] | None = None  # (n, 3) bytes R, G, B, the circles' own; None leaves colours to the viewer
    part: Rect | None = None  # of the plane to show, metres; None shows the bounds, or where the circles are
    graph: GraphReader | None = None  # what measures the one world for a graph beside it; None shows none
    callbacks: Sketch | CallbackFunctions | None = None  # what draws over the picture, and is called for keys and clicks
    countable: bool = True  # whether the scene can be built with another number of circles
    repertoire: Repertoire | None = None  # scenes a viewer may put in its place; None: the worlds are all there is

    @classmethod
    def of(cls, shown: World | Panels | Presentation, title: str) -> Presentation:
        """Worlds under a title; a presentation as it is."""
        return shown if isinstance(shown, Presentation) else cls(title, Panels.of(shown))


class Repertoire:
    """The scenes a viewer may pick from. `integrators` and `overrides` are of the first one, as for `Scene.panels`."""

    def __init__(
        self, scene: Scene, *, dt: float, integrators: Sequence[Integrator] = (), overrides: Mapping[str, Any] | None = None
    ) -> None:
        self._scene, self._dt, self._integrators = scene, dt, tuple(integrators)
        self._overrides = dict(overrides or {})

    @property
    def summaries(self) -> tuple[tuple[str, str], ...]:
        """Name and one line of every scene, and of the one to begin with if it is none of these."""
        return tuple({scene.name: scene.summary for scene in (*scenes.SCENES.values(), self._scene)}.items())

    def open(self, progress: OnProgress | None = None) -> Presentation:
        """The scene to begin with."""
        return self.build(self._scene.name, None, progress)

    def build(self, name: str, particles: int | None, progress: OnProgress | None = None) -> Presentation:
        """A scene with this many particles, None for its own number; progress(done, total) while it finds out its colours.

        Raises:
            InputError: there is no such scene, or it cannot have so many particles.
        """
        first = name == self._scene.name
        scene = self._scene if first else scenes.get(name)
        overrides = self._overrides if first else {key: self._overrides.get(key) for key in CARRIED}
        if particles is not None:
            overrides = {**overrides, "particles": particles}
        integrators = self._integrators if first else ()
        settings = scene.settings(**overrides, integrator=integrators[0] if integrators else None)
        panels = scene.panels(integrators=integrators, **overrides)
        colours = None
        if scene.show.colours and len(panels) == 1:
            colours = scene.show.colours(settings, self._dt, progress)
        part = scene.show.view(settings) if scene.show.view else None
        graph = scene.show.graph(settings) if scene.show.graph and len(panels) == 1 else None
        countable = not isinstance(scene, SketchScene) or scene.takes("particles")
        return Presentation(scene.name, panels, scene.name, colours, part, graph, scene.sketch, countable, self)
