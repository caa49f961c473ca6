"""Presentations: worlds with a title, colours and view; and the scenes that a viewer may choose instead."""

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
    """A program's functions draw(world, pen), keys(world, key), click(world, point, button), and its sliders, as in a sketch."""

    def __init__(self, **functions: Callable[..., Any] | None) -> None:
        self.sliders = on_board()
        self._functions = {name: given for name, given in functions.items() if given is not None}
        for name, given in self._functions.items():
            if not callable(given):
                raise InputError(f"{name} is {given!r}; allowed is a function")

    def has(self, hook: str) -> bool:
        """Whether there is a function for this hook."""
        return hook in self._functions

    def call(self, hook: str, *arguments: Any) -> None:
        """Call the function; after an InputError, which describes the problem, it is no longer called."""
        if hook not in self._functions:
            return
        try:
            self._functions[hook](*arguments)
        except Exception as error:
            del self._functions[hook]
            raise InputError(f"{hook} has failed, and is not called any more: {type(error).__name__}: {error}") from error


CARRIED = ("seed", "threads", "dtype", "ledger")  # computational settings, which are kept when another scene is chosen


@dataclass(frozen=True)
class Presentation:
    """Worlds with everything needed to show them."""

    title: str  # heading of the page
    panels: Panels  # the worlds
    scene: str = ""  # name of the scene, or "" for the user's worlds
    colours: NDArray[np.uint8] | None = None  # (n, 3) bytes R, G, B; None leaves colours to the viewer
    part: Rect | None = None  # visible part of the plane, metres; None for the bounds, or where the circles are
    graph: GraphReader | None = None  # measures a single world for a graph; None: no graph
    callbacks: Sketch | CallbackFunctions | None = None  # draws over the picture, handles keys and clicks
    countable: bool = True  # whether the scene can be built with another number of circles
    repertoire: Repertoire | None = None  # scenes to choose from; None: no choice

    @classmethod
    def of(cls, shown: World | Panels | Presentation, title: str) -> Presentation:
        """A presentation of worlds under a title; presentations are returned unchanged."""
        return shown if isinstance(shown, Presentation) else cls(title, Panels.of(shown))


class Repertoire:
    """The scenes to choose from. `integrators` and `overrides` are for the first one, as in `Scene.panels`."""

    def __init__(
        self, scene: Scene, *, dt: float, integrators: Sequence[Integrator] = (), overrides: Mapping[str, Any] | None = None
    ) -> None:
        self._scene, self._dt, self._integrators = scene, dt, tuple(integrators)
        self._overrides = dict(overrides or {})

    @property
    def summaries(self) -> tuple[tuple[str, str], ...]:
        """Name and summary of every scene, and of the first one if it is not among them."""
        return tuple({scene.name: scene.summary for scene in (*scenes.SCENES.values(), self._scene)}.items())

    def open(self, progress: OnProgress | None = None) -> Presentation:
        """Build the first scene."""
        return self.build(self._scene.name, None, progress)

    def build(self, name: str, particles: int | None, progress: OnProgress | None = None) -> Presentation:
        """Build a scene with this many particles, None for its default; progress(done, total) while it computes colours.

        Raises:
            InputError: there is no such scene, or it does not allow this number of particles.
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
