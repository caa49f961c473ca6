"""Options that commands share, and their conversion to settings, integrators and objects of the user's modules."""

import importlib
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

from pyverlet.common.errors import InputError
from pyverlet.common.guess import did_you_mean
from pyverlet.laws.collisions import BruteForce, Fast
from pyverlet.laws.integrators import BY_NAME, Integrator
from pyverlet.viewers import DEFAULT_PORT

DType = Literal["float32", "float64"]
Method = Literal["fast", "brute", "none"]
ColourName = Literal["origin", "speed", "mass", "group", "energy"]
ThemeName = Literal["dark", "light"]


def whole(text: str) -> int:
    """Parse an integer, or report what was given instead."""
    try:
        return int(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is not a whole number") from None


def pixels(text: str) -> tuple[int, int]:
    """A size in pixels from 1280x720."""
    width, _, height = text.lower().partition("x")
    try:
        return int(width), int(height)
    except ValueError:
        raise InputError(f"size is {text!r}; allowed is a width and a height in pixels, such as 1280x720") from None


def real(text: str) -> float:
    """Parse a number or a fraction such as 1/60, or report what was given instead."""
    try:
        above, _, below = str(text).partition("/")
        return float(above) / float(below or 1)
    except (ValueError, ZeroDivisionError):
        raise typer.BadParameter(f"{text!r} is not a number") from None


def count(text: str, shown: Any = False) -> Any:
    """An option that takes an integer; `shown`: its default in the help, if any."""
    return typer.Option(parser=whole, help=text, metavar="N", show_default=shown)


def number(text: str, metavar: str = "S", shown: Any = False) -> Any:
    """An option that takes a number, by default seconds."""
    return typer.Option(parser=real, help=text, metavar=metavar, show_default=shown)


def simulated(shown: str) -> Any:
    """The option `--seconds` of commands with a default length."""
    return number("Simulated seconds.", shown=shown)


def file(text: str) -> Any:
    """An option that takes the name of a file."""
    return typer.Option(help=text, metavar="FILE", show_default=False)


def names(text: str) -> Any:
    """An option that takes a name, and may be repeated."""
    return typer.Option(help=text, metavar="NAME", show_default=False)


SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a scene, see `pyverlet list`, or a file: a sketch, .py, or .toml, .json.")
]
Particles = Annotated[int | None, count("Number of circles.")]
IntegratorName = Annotated[
    str | None,
    typer.Option(
        "--integrator",
        "--integrators",
        help=", ".join(BY_NAME) + ", or your own as module:Class. Several, with commas, run side by side.",
        metavar="NAME",
        show_default=False,
    ),
]
Dt = Annotated[float, number("Simulated seconds a frame.", shown="1/60")]
Seconds = Annotated[float | None, number("Simulated seconds to run.")]
Frames = Annotated[int | None, count("Frames to run, in place of --seconds.")]
ThemeOption = Annotated[ThemeName, typer.Option("--theme", help="Behind the circles.")]
Size = Annotated[str | None, typer.Option(help="Width and height in pixels.", metavar="WxH", show_default="1280x720")]
Trajectory = Annotated[Path | None, file("Keep the frames in a .gsd, .xyz or .vtkhdf file, without the page.")]
Every = Annotated[int | None, count("Frames from one in the trajectory to the next.", "1")]
NoOpen = Annotated[bool, typer.Option("--no-open", help="Do not open a browser tab.")]
Port = Annotated[int | None, count("Port of the live page.", str(DEFAULT_PORT))]
Markdown = Annotated[bool, typer.Option("--markdown", help="As a table for a page.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]

METHODS: dict[Method, Any] = {"fast": Fast(), "brute": BruteForce(), "none": False}

SETTINGS: dict[str, Any] = {
    "particles": Particles,
    "substeps": Annotated[int | None, count("Substeps a frame.")],
    "integrator": IntegratorName,
    "restitution": Annotated[float | None, number("Of circles and bounds, 0 to 1.", "E")],
    "friction": Annotated[float | None, number("Coulomb friction of circles and bounds.", "MU")],
    "radius_spread": Annotated[float | None, number("Largest / smallest radius.", "X")],
    "seed": Annotated[int | None, count("Seed of the random start.")],
    "threads": Annotated[int | None, count("Threads to use.")],
    "dtype": Annotated[DType | None, typer.Option("--dtype", help="Precision of the state.", show_default=False)],
    "collisions": Annotated[
        Method | None, typer.Option("--collisions", help="How contacts are found; none: they are not.", show_default=False)
    ],
    "picture": Annotated[Path | None, file("What the circles form (scene image).")],
    "ledger": Annotated[
        bool, typer.Option("--ledger", help="Say where the energy goes, on the page and in the report. Costs time.")
    ],
}
"""Options of commands that build a scene; they override the scene's defaults."""


def with_settings(*chosen: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator: the command has these of SETTINGS as options, and receives them as its argument `overrides`.

    That is a dictionary as for `Scene.settings`, with None for missing options, except that `integrator` stays as typed.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        parameters: list[inspect.Parameter] = []
        for own in inspect.signature(command, eval_str=True).parameters.values():
            usual = {"ledger": False}
            shared = [own.replace(name=name, annotation=SETTINGS[name], default=usual.get(name)) for name in chosen]
            parameters += shared if own.name == "overrides" else [own]

        def called(**given: Any) -> None:
            overrides = {name: given.pop(name) for name in chosen}
            if overrides.get("dtype") is not None:
                overrides["dtype"] = np.dtype(overrides["dtype"]).type
            if overrides.get("collisions") is not None:
                overrides["collisions"] = METHODS[overrides["collisions"]]
            command(**given, overrides=overrides)

        called.__name__, called.__doc__ = command.__name__, command.__doc__
        setattr(called, "__signature__", inspect.Signature(parameters))  # noqa: B010  (typer reads it)
        called.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return called

    return decorate


def integrators(names: str | None) -> tuple[Integrator, ...]:
    """The integrators in a list with commas; none for None. InputError if one is unknown, or repeated."""
    if names is None:
        return ()
    found = tuple(integrator(name.strip()) for name in names.split(","))
    labels = [each.label for each in found]
    if twice := [label for label in labels if labels.count(label) > 1]:
        raise InputError(f"integrators names {twice[0]!r} twice; allowed is each once")
    return found


def single(name: str | None) -> Integrator | None:
    """The integrator of this name; None for None. InputError if it is unknown, or there are several."""
    found = integrators(name)
    if len(found) > 1:
        raise InputError(f"integrator is {name!r}; allowed is one")
    return found[0] if found else None


def integrator(name: str) -> Integrator:
    """The integrator of this name, or the one at the import path `module:Class`; the working folder is searched, too.

    Raises:
        InputError: there is none; the message suggests the nearest and lists the known ones, or says what the path lacks.
    """
    if ":" in name:
        return _imported(name)
    if name in BY_NAME:
        return BY_NAME[name]()
    hint = did_you_mean(name.lower().replace("_", "-"), BY_NAME, alike=0.5)
    raise InputError(f"unknown integrator {name!r}{hint}; known: {', '.join(BY_NAME)}, or your own as module:Class")


def _imported(path: str) -> Integrator:
    allowed = "allowed is module:Class, a class deriving from pyverlet.Integrator"
    found = imported("integrator", path, allowed)
    try:
        made = found() if isinstance(found, type) else found
    except Exception as error:
        raise InputError(f"integrator is {path!r}, which cannot be made without arguments ({what(error)}); {allowed}") from error
    if not isinstance(made, Integrator):
        raise InputError(f"integrator is {path!r}, which is no Integrator; {allowed}")
    if lacks := [name for name in ("order", "symplectic") if inspect.getattr_static(type(made), name, None) is None]:
        raise InputError(f"integrator is {path!r}, which does not state {lacks[0]!r}; {allowed}, with order and symplectic")
    return made


def imported(option: str, path: str, allowed: str) -> Any:
    """The object at the path; `option` and `allowed` are used in the InputError if there is none."""
    module_name, _, attribute = path.partition(":")
    if not all(part.isidentifier() for part in (*module_name.split("."), attribute)):
        raise InputError(f"{option} is {path!r}; {allowed}")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = importlib.import_module(module_name)
    except Exception as error:  # any error in the user's module
        raise InputError(f"{option} is {path!r}, whose module cannot be imported ({what(error)}); {allowed}") from error
    found = getattr(module, attribute, None)
    if found is None:
        raise InputError(f"{option} is {path!r}, but {module_name} has no {attribute}; {allowed}")
    return found


def what(error: Exception) -> str:
    """A short text of an error."""
    return f"{type(error).__name__}: {error}"
