"""Scenes: a name, a summary, settings, and a function that builds the world from them."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common import checks
from pyverlet.common.arrays import Floats
from pyverlet.common.errors import InputError
from pyverlet.common.guess import did_you_mean
from pyverlet.common.progress import OnProgress
from pyverlet.common.shown import Shown, line
from pyverlet.laws.collisions import BruteForce, Collisions, Fast
from pyverlet.laws.integrators import Integrator, TimeCorrectedVerlet
from pyverlet.scenes import _start
from pyverlet.world.panels import Pace, Panel, Panels, every_frame
from pyverlet.world.world import World

if TYPE_CHECKING:
    from pyverlet.scenes.sketch import Sketch


MOST_PARTICLES = 2**31 - 1  # the engine counts particles with 32 bits


@dataclass(frozen=True)
class Graph:
    """A graph beside a world."""

    title: str  # line above it
    axis: str  # label of the x axis, from 0 to `most`
    most: float  # value of x at the right end
    bars: tuple[float, ...]  # heights of bars of equal width, from x = 0 on, on the scale of the curve
    curve: tuple[float, ...]  # heights at evenly spaced places from x = 0 to `most`
    note: str  # line below it


GraphReader = Callable[[World], Graph]  # called with the world for each picture; may have state


@dataclass(frozen=True, repr=False)
class Settings:
    """Settings of a scene that users may change.

    Attributes:
        particles: number of circles, at least 1.
        substeps: substeps per frame.
        integrator: how circles move between contacts.
        restitution: of circles and walls, 0 to 1.
        friction: Coulomb coefficient of circles and walls, >= 0.
        radius_spread: bound on largest radius / smallest radius, >= 1; 1 makes all equal.
        seed: of the random numbers of the start, >= 0. The same seed gives the same start.
        dtype: numpy.float32 or numpy.float64.
        collisions: how contacts are found; None switches collisions off.
        threads: threads to use; None leaves the choice to the engine.
        gravity: (x, y) in m/s^2.
        picture: a file, for scenes made of a picture; None for the scene's own.
        ledger: keep energy accounts.
    """

    particles: int = 5_000
    substeps: int = 8
    integrator: Integrator = field(default_factory=TimeCorrectedVerlet)
    restitution: float = 0.0
    friction: float = 0.0
    radius_spread: float = 1.0
    seed: int = 0
    dtype: type[np.float32] | type[np.float64] = np.float32
    collisions: Fast | BruteForce | None = field(default_factory=Fast)
    threads: int | None = None
    gravity: tuple[float, float] = (0.0, -9.81)
    picture: Path | None = None
    ledger: bool = False

    def __post_init__(self) -> None:
        """Check values that the engine does not check, or that are unused without bounds and collisions."""
        checks.integer("particles", self.particles, most=MOST_PARTICLES)
        checks.number("radius_spread", self.radius_spread, least=1.0)
        checks.integer("seed", self.seed, least=0)
        checks.fraction("restitution", self.restitution)
        checks.number("friction", self.friction, least=0.0)

    def __repr__(self) -> str:
        return line("Settings", **vars(self))

    @property
    def surface(self) -> dict[str, Any]:
        """Restitution and friction, as arguments of bounds and obstacles."""
        return {"restitution": self.restitution, "friction": self.friction}

    def require(self, least: int, scene: str) -> None:
        """Refuse fewer particles than this scene needs."""
        if self.particles < least:
            raise InputError(f"particles is {self.particles}; allowed is at least {least} in the scene {scene!r}")

    def draw_radii(self, rms: float, count: int | None = None) -> tuple[np.random.Generator, Floats]:
        """A random generator with the seed, and (count,) radii drawn from it, m, with this root mean square; all by default."""
        rng = np.random.default_rng(self.seed)
        return rng, _start.draw_radii(rng, self.particles if count is None else count, self.radius_spread, rms)

    def empty_world(self, boundary: Any, **more: Any) -> World:
        """A world with these settings inside `boundary`, without circles; `more`: other arguments of `World`."""
        collisions = None if self.collisions is None else Collisions(**self.surface, method=self.collisions)
        own = {name: getattr(self, name) for name in ("gravity", "integrator", "substeps", "dtype", "threads", "ledger")}
        return World(**own | {"boundary": boundary, "collisions": collisions} | more)


def set_on_world(world: World, name: str, value: Any) -> None:
    """Set substeps, integrator, gravity, threads, restitution, friction or collisions of an existing world.

    Restitution and friction are set on its circles and walls, as far as it has any; `collisions` is the method, or None.
    """
    if name not in ("restitution", "friction", "collisions"):
        setattr(world, name, value)
        return
    if world.collisions is not None:
        changes = {"method" if name == "collisions" else name: value}
        world.collisions = None if value is None else dataclasses.replace(world.collisions, **changes)
    if name != "collisions" and hasattr(world.boundary, name):
        setattr(getattr(world.boundary, "room", world.boundary), name, value)  # the textbook boundaries contain theirs


@dataclass(frozen=True, repr=False)
class Show(Shown):
    """How a scene is shown, where that differs from the default. Viewers may ignore it.

    Attributes:
        colours: of (settings, dt, progress): (n, 3) bytes R, G, B of the circles in a run with frames of dt seconds;
            progress(done, total) is called during long computations. Such a scene takes a picture.
        view: the visible part of the plane, (x0, y0, x1, y1) in metres.
        seconds: how long it is worth watching, s.
        graph: of (settings): measures the running world, for a graph beside it.
    """

    _shows = ("colours", "view", "seconds", "graph")

    colours: Callable[[Settings, float, OnProgress | None], NDArray[np.uint8]] | None = None
    view: Callable[[Settings], tuple[float, float, float, float]] | None = None
    seconds: Callable[[Settings], float] | None = None
    graph: Callable[[Settings], GraphReader] | None = None


@dataclass(frozen=True, repr=False)
class Variant(Shown):
    """One of the worlds of a scene that are shown side by side.

    Attributes:
        name: shown above it.
        changes: settings that differ from the scene's.
        build: makes its world, if settings alone are not enough.
        pace: how it follows the frames of the screen.
    """

    _shows = ("name", "changes")

    name: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    build: Callable[[Settings], World] | None = None
    pace: Pace = every_frame


@dataclass(frozen=True, repr=False)
class Scene(Shown):
    """A named recipe for a world, used for demonstrations, tests, benchmarks and recordings.

    Attributes:
        name: on the command line.
        summary: one line.
        defaults: the default settings.
        build: makes the world, ready at time 0.
        closed_form: of (settings, t (m,) in seconds): the exact height y (m, n) in metres of every circle, for scenes
            with an exact solution.
        show: how it is shown.
        variants: the worlds shown side by side; empty for one world.
        line: height in metres of a line drawn across the scene.
        document: the contents of the file that the scene was read from; None for scenes with a name.
        sketch: the Python file that it was read from; None for all others.
    """

    _shows = ("name", "summary")

    name: str
    summary: str
    build: Callable[[Settings], World]
    defaults: Settings = field(default_factory=Settings)
    closed_form: Callable[[Settings, Floats], Floats] | None = None
    show: Show = Show()
    variants: tuple[Variant, ...] = ()
    line: float | None = None
    document: dict[str, Any] | None = None
    sketch: Sketch | None = None

    @property
    def description(self) -> str:
        """The docstring of the scene's build function."""
        return inspect.getdoc(self.build) or self.summary

    def settings(self, **overrides: Any) -> Settings:
        """The defaults with `overrides`; None is ignored, and collisions=False switches collisions off.

        Raises:
            InputError: there is no such setting, or a value is outside what is allowed.
        """
        known = {f.name for f in dataclasses.fields(Settings)}
        if unknown := sorted(set(overrides) - known):
            hint = did_you_mean(unknown[0], known)
            raise InputError(f"a scene has no setting {unknown[0]!r}{hint}; known: {', '.join(sorted(known))}")
        changes = {name: value for name, value in overrides.items() if value is not None}
        if changes.get("collisions") is False:
            changes["collisions"] = None
        if "picture" in changes and self.show.colours is None:
            raise InputError(f"picture is '{changes['picture']}'; allowed is none, since the scene {self.name!r} shows none")
        return dataclasses.replace(self.defaults, **changes)

    def world(self, **overrides: Any) -> World:
        """Build the scene's world at time 0, without variants; `overrides` as for `settings`."""
        return self.build(self.settings(**overrides))

    def panels(self, *, integrators: Sequence[Integrator] = (), **overrides: Any) -> Panels:
        """Build the worlds that the scene shows: its variants side by side, or its single world; `overrides` as for `settings`.

        Args:
            integrators: several are shown side by side instead of the variants, a single one is an override.
            overrides: one of a setting in which the variants differ leaves a single world with it.
        """
        variants = self.variants
        if len(integrators) > 1:
            variants = tuple(Variant(integrator.label, {"integrator": integrator}) for integrator in integrators)
        elif integrators:
            overrides["integrator"] = integrators[0]
        given = {name for name, value in overrides.items() if value is not None}
        if any(given & variant.changes.keys() for variant in variants):
            variants = ()
        if not variants:
            return Panels([Panel(self.name, self.world(**overrides))], line=self.line)
        panels = []
        for variant in variants:
            settings = self.settings(**{**overrides, **variant.changes})
            panels.append(Panel(variant.name, (variant.build or self.build)(settings), variant.pace))
        return Panels(panels, line=self.line)

    def write(self, path: str | Path) -> None:
        """Write the scene to a file, .toml or .json, from which `pyverlet.scenes.read` reads the same scene.

        A named scene is written as its name and settings, one from a file as it was read; `freeze` writes any scene, with numbers
        instead of random draws.

        Raises:
            InputError: the file cannot be written, or it is a scene of your own.
        """
        from pyverlet.data import scene_file

        scene_file.write(self, path)

    def freeze(self, path: str | Path, **overrides: Any) -> None:
        """Write the initial world of the scene to a file, .toml or .json, with its arrays in a .npz beside it.

        Reading it gives the same start, bit for bit, even if a later version draws other random numbers.

        Args:
            path: of the file; old ones are replaced.
            overrides: as for `settings`.

        Raises:
            InputError: the files cannot be written, or the world contains objects of your own classes.
        """
        from pyverlet.data import scene_file

        scene_file.write_frozen(self, path, self.settings(**overrides))
