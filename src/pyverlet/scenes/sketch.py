"""Sketches: user-written Python files as scenes.

A sketch has `build()`, which returns a world, or a `SCENE`. It may have `update(world, dt)`, called before each frame;
`draw(world, pen)`, which draws over the picture; `keys(world, key)` and `click(world, point, button)`, which handle input.
"""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
import importlib.util
import inspect
import linecache
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from pyverlet.common.errors import InputError, Interrupted
from pyverlet.common.guess import did_you_mean
from pyverlet.common.outside import file_errors
from pyverlet.common.shown import Shown
from pyverlet.common.time_limit import TimeLimit, TooLong
from pyverlet.scenes._scene import Scene, Settings, set_on_world
from pyverlet.scenes.sliders import Board, board
from pyverlet.world.actors import Actor
from pyverlet.world.world import World

SUFFIX = ".py"

HOOKS = ("update", "draw", "keys", "click")  # optional functions of a sketch besides `build`
LARGEST = 4_000_000  # bytes
HOOK_S = 3.0  # longest time for one of them, as the screen waits for it

_AFTERWARDS = ("substeps", "integrator", "gravity", "threads", "restitution", "friction", "collisions")
"""Settings that can be set on an existing world."""


class SketchError(InputError):
    """An error in a sketch; the message has the place."""


class Sketch(Shown):
    """The code of a sketch file, run when first needed.

    Args:
        path: of the file.
        source: its contents.
        before: the file as it was last run, whose slider values are kept.

    Attributes:
        name: of the file, without its folder.
        files: of the sketch and of the modules beside it that it has imported.
        settings: of the last build.
    """

    _shows = ("name",)

    def __init__(self, path: Path, source: bytes, before: Sketch | None = None) -> None:
        self.path, self.source, self.name = Path(path), source, Path(path).name
        self.sliders: Board = {}
        self.time_limit: TimeLimit | None = None
        self.settings = Settings()
        self._left: Board = dict(before.sliders) if before else {}
        self._brought: dict[str, Path] = dict(before._brought) if before else {}
        self._module: ModuleType | None = None
        self._built = False
        self._off: set[str] = set()

    @classmethod
    def read(cls, path: str | Path, before: Sketch | None = None) -> Sketch:
        """Read the sketch in a file; InputError if that fails."""
        path = Path(path)
        with file_errors("path", path, "read"):
            source = path.read_bytes()
        if len(source) > LARGEST:
            raise InputError(f"'{path}' has {len(source):,} bytes; allowed are {LARGEST:,}")
        return cls(path, source, before)

    def __reduce__(self) -> tuple[type[Sketch], tuple[Path, bytes]]:
        return Sketch, (self.path.resolve(), self.source)  # another process runs it again

    @property
    def digest(self) -> str:
        """Hash of the contents, 32 hex digits."""
        return hashlib.blake2b(self.source, digest_size=16).hexdigest()

    @property
    def module(self) -> ModuleType:
        """The module of the sketch, run on first use."""
        if self._module is None:
            self._module = self._run()
        return self._module

    @property
    def files(self) -> list[Path]:
        """The files on which the sketch depends."""
        return [self.path, *self._brought.values()]

    def has(self, hook: str) -> bool:
        """Whether the sketch has this function, and it has not failed."""
        return hook not in self._off and callable(getattr(self.module, hook, None))

    @property
    def has_callbacks(self) -> bool:
        """Whether the sketch handles user input, so that its worlds depend on more than their start."""
        return bool(self.sliders) or any(self.has(hook) for hook in ("update", "keys", "click"))

    def call(self, hook: str, *arguments: Any, of: ModuleType | None = None) -> None:
        """Call one of HOOKS, by default of the last world's module.

        Raises:
            SketchError: it raised an exception, or ran too long; it is not called again.
        """
        if not self.has(hook):
            return
        function = getattr(of or self.module, hook)
        try:
            with self.at_work(), self.time_limit.within(HOOK_S) if self.time_limit else nullcontext():
                function(*arguments)
        except SketchError as error:
            self._off.add(hook)
            raise SketchError(f"{error} ({hook} is not called any more)") from None

    def build(self, settings: Settings) -> World:
        """Build the sketch's world. Settings that it does not take are set on its world, where possible.

        Raises:
            SketchError: it raised an exception, or returned something else.
            InputError: neither the sketch nor a world takes a given setting.
        """
        if self._built:  # the whole file is run again, so that every build is the same
            self._left, self._module = self.sliders, None
        scene = getattr(self.module, "SCENE", None)
        self._built, self.settings = True, settings
        with self.at_work():
            world = scene.build(settings) if isinstance(scene, Scene) else self._made(settings)
        if self.has("update"):
            world.actors.append(Updates(self, self.module))
        return world

    def scene(self) -> Scene:
        """The sketch as a scene; runs the file without building a world.

        Raises:
            SketchError: it cannot be run, or has neither `build` nor `SCENE`.
        """
        module = self.module
        for hook in HOOKS:
            if getattr(module, hook, None) is not None and not callable(getattr(module, hook)):
                raise SketchError(f"{self.name}: {hook} is {getattr(module, hook)!r}; allowed is a function")
        scene = getattr(module, "SCENE", None)
        if scene is not None:
            if not isinstance(scene, Scene):
                raise SketchError(f"{self.name}: SCENE is {scene!r}; allowed is a pyverlet.scenes.Scene")
            return dataclasses.replace(scene, build=self.build, sketch=self)
        if not callable(getattr(module, "build", None)):
            hint = did_you_mean("build", [name for name in vars(module) if callable(getattr(module, name))])
            raise SketchError(
                f"{self.name} has no build(){hint}; allowed is a function `def build():` that returns a pyverlet.World"
            )
        summary = next(iter((inspect.getdoc(module) or f"from {self.name}").splitlines()), "")
        return SketchScene(self.path.stem, summary, self.build, self._defaults(), sketch=self)

    def _run(self) -> ModuleType:
        folder = self.path.resolve().parent
        if str(folder) not in sys.path:
            sys.path.insert(0, str(folder))  # as for a script, so that files beside it can be imported
        for name in self._brought:
            sys.modules.pop(name, None)  # it may have changed, too
        known = set(sys.modules)
        name = self.path.stem if self.path.stem not in sys.modules else f"pyverlet_sketch_{self.path.stem}"
        spec = importlib.util.spec_from_loader(name, None, origin=str(self.path))
        assert spec
        module = importlib.util.module_from_spec(spec)
        module.__file__ = str(self.path.resolve())
        before, sys.modules[name] = sys.modules.get(name), module  # for classes that look up their module
        linecache.checkcache(module.__file__)
        importlib.invalidate_caches()
        self.sliders = {}
        try:
            with self.at_work():
                exec(compile(self.source, module.__file__, "exec"), module.__dict__)
        finally:
            if before is not None:
                sys.modules[name] = before
            for new in set(sys.modules) - known - {name}:
                file = getattr(sys.modules[new], "__file__", None)
                if file and Path(file).is_relative_to(folder):
                    self._brought[new] = Path(file)
        for kept in self.sliders.values():
            if (left := self._left.get(kept.name)) is not None and left.made_as == kept.made_as:
                kept.value = left.value
        return module

    def _defaults(self) -> Given:
        """The defaults of `build` that are settings."""
        build = self.module.build
        known = {field.name for field in dataclasses.fields(Settings)}
        values: dict[str, Any] = {}
        for name, parameter in inspect.signature(build).parameters.items():
            asked = parameter.default is parameter.empty and parameter.kind not in (
                parameter.VAR_POSITIONAL,
                parameter.VAR_KEYWORD,
            )
            if name not in known | {"settings"} and asked:
                allowed = f"`settings`, a Settings, and some of {', '.join(sorted(known))}"
                raise SketchError(f"{self.name}: build takes {name!r}; allowed are {allowed}")
            if name in known and parameter.default is not parameter.empty:
                values[name] = parameter.default
        with self.at_work():
            return Given(**values)

    def _made(self, settings: Settings) -> World:
        taken = inspect.signature(self.module.build).parameters
        given = settings.given if isinstance(settings, Given) else frozenset(_AFTERWARDS)
        left = frozenset() if "settings" in taken else given - set(taken)
        for name in sorted(left - set(_AFTERWARDS)):
            said = getattr(getattr(settings, name), "__name__", getattr(settings, name))
            raise InputError(f"{name} is {said}, which build() of {self.name} does not take; allowed is `def build({name}=...):`")
        has = {"settings": settings, **{name: getattr(settings, name) for name in taken if hasattr(settings, name)}}
        world = self.module.build(**{name: has[name] for name in taken if name in has})
        if not isinstance(world, World):
            what = "nothing" if world is None else repr(world)
            raise SketchError(f"{self.name}: build() returned {what}; allowed is a pyverlet.World: `return world`")
        for name in sorted(left):
            set_on_world(world, name, getattr(settings, name))
        return world

    @contextmanager
    def at_work(self) -> Iterator[None]:
        """Context for running code of the sketch: sliders belong to it, and its exceptions get a place."""
        try:
            with board(self.sliders):
                yield
        except (SketchError, Interrupted):
            raise
        except SyntaxError as error:
            own = error.lineno and error.filename and Path(error.filename).name == self.name
            raise SketchError(f"{self.name}{f', line {error.lineno}' if own else ''}: {error.msg}") from error
        except Exception as error:
            said = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
            raise SketchError(f"{self.name}{self._line(error)}: {said}") from error
        except SystemExit as error:
            where = f"{self.name}{self._line(error)}"
            raise SketchError(f"{where} ends the program; allowed is build(), which returns a world") from None
        except TooLong as error:
            raise SketchError(f"{self.name}{self._line(error)} does not come back; does it loop for ever?") from None

    def _line(self, error: BaseException) -> str:
        """The line of an error in the sketch, or in a module beside it."""
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if Path(frame.filename).resolve() == self.path.resolve()]
        return f", line {own[-1].lineno}" if own else ""


@dataclass(frozen=True)
class Given(Settings):
    """Settings that know which of them were explicitly given."""

    given: frozenset[str] = frozenset()


@dataclass(frozen=True)
class SketchScene(Scene):
    """A scene made by `build()`."""

    def settings(self, **overrides: Any) -> Settings:
        named = frozenset(name for name, value in overrides.items() if value is not None and (name, value) != ("ledger", False))
        settings = super().settings(**overrides)
        assert isinstance(settings, Given)
        return dataclasses.replace(settings, given=settings.given | named)

    def takes(self, name: str) -> bool:
        """Whether the sketch's build uses a setting."""
        assert self.sketch
        taken = inspect.signature(self.sketch.module.build).parameters
        return name in taken or "settings" in taken


class Updates(Actor):
    """Calls `update(world, dt)` of a sketch before each frame."""

    def __init__(self, sketch: Sketch, module: ModuleType) -> None:
        self._sketch, self._module = sketch, module

    def act(self, world: World, dt: float) -> None:
        self._sketch.call("update", world, dt, of=self._module)
