"""The options `run` and `bench` share, and how their strings become a scene's settings."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import typer

from pyverlet.ground.errors import InputError
from pyverlet.laws import integrators
from pyverlet.laws.collisions import BruteForce, Fast
from pyverlet.viewers import DEFAULT_PORT

DType = Literal["float32", "float64"]
Method = Literal["fast", "brute", "none"]
ColourName = Literal["origin", "speed", "mass", "group", "energy"]
ThemeName = Literal["dark", "light"]


def whole(text: str) -> int:
    """A whole number, or the sentence that says what was given instead."""
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
    """A number or a fraction such as 1/60, or the sentence that says what was given instead."""
    try:
        above, _, below = str(text).partition("/")
        return float(above) / float(below or 1)
    except (ValueError, ZeroDivisionError):
        raise typer.BadParameter(f"{text!r} is not a number") from None


SceneName = Annotated[
    str, typer.Argument(metavar="SCENE", help="Name of a scene, see `pyverlet list`, or a file: a sketch, .py, or .toml, .json.")
]
Particles = Annotated[int | None, typer.Option(parser=whole, help="Number of circles.", metavar="N", show_default=False)]
Substeps = Annotated[int | None, typer.Option(parser=whole, help="Substeps a frame.", metavar="N", show_default=False)]
IntegratorName = Annotated[
    str | None,
    typer.Option(
        "--integrator",
        "--integrators",
        help=", ".join(integrators.BY_NAME) + ", or your own as module:Class. Several, with commas, run side by side.",
        metavar="NAME",
        show_default=False,
    ),
]
Restitution = Annotated[
    float | None, typer.Option(parser=real, help="Of circles and bounds, 0 to 1.", metavar="E", show_default=False)
]
Friction = Annotated[
    float | None, typer.Option(parser=real, help="Coulomb friction of circles and bounds.", metavar="MU", show_default=False)
]
RadiusSpread = Annotated[
    float | None, typer.Option(parser=real, help="Largest / smallest radius.", metavar="X", show_default=False)
]
Seed = Annotated[int | None, typer.Option(parser=whole, help="Seed of the random start.", metavar="N", show_default=False)]
Threads = Annotated[int | None, typer.Option(parser=whole, help="Threads to use.", metavar="N", show_default=False)]
Precision = Annotated[DType | None, typer.Option("--dtype", help="Precision of the state.", show_default=False)]
CollisionMethod = Annotated[
    Method | None,
    typer.Option("--collisions", help="How contacts are found; none: they are not.", show_default=False),
]
Dt = Annotated[float, typer.Option(parser=real, help="Simulated seconds a frame.", metavar="S", show_default="1/60")]
Seconds = Annotated[float | None, typer.Option(parser=real, help="Simulated seconds to run.", metavar="S", show_default=False)]
Frames = Annotated[
    int | None, typer.Option(parser=whole, help="Frames to run, in place of --seconds.", metavar="N", show_default=False)
]
ThemeOption = Annotated[ThemeName, typer.Option("--theme", help="Behind the circles.")]
Size = Annotated[str | None, typer.Option(help="Width and height in pixels.", metavar="WxH", show_default="1280x720")]
Picture = Annotated[
    Path | None,
    typer.Option(help="What the circles form (scene image).", metavar="FILE", show_default=False),
]
Trajectory = Annotated[
    Path | None,
    typer.Option(help="Keep the frames in a .gsd, .xyz or .vtkhdf file, without the page.", metavar="FILE", show_default=False),
]
Every = Annotated[
    int | None, typer.Option(parser=whole, help="Frames from one in the trajectory to the next.", metavar="N", show_default="1")
]
Ledger = Annotated[bool, typer.Option("--ledger", help="Say where the energy goes, on the page and in the report. Costs time.")]
NoOpen = Annotated[bool, typer.Option("--no-open", help="Do not open a browser tab.")]
Port = Annotated[
    int | None, typer.Option(parser=whole, help="Port of the live page.", metavar="N", show_default=str(DEFAULT_PORT))
]


def simulated(shown: str) -> Any:
    """The option `--seconds` of commands that have a usual length."""
    return typer.Option(parser=real, help="Simulated seconds.", metavar="S", show_default=shown)


Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]

METHODS: dict[Method, Any] = {"fast": Fast(), "brute": BruteForce(), "none": False}


SETTINGS: dict[str, Any] = {
    "particles": Particles,
    "substeps": Substeps,
    "integrator": IntegratorName,
    "restitution": Restitution,
    "friction": Friction,
    "radius_spread": RadiusSpread,
    "seed": Seed,
    "threads": Threads,
    "dtype": Precision,
    "collisions": CollisionMethod,
    "picture": Picture,
    "ledger": Ledger,
}
"""Options of commands that build a scene: what the user gives in place of the scene's defaults."""


def with_settings(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator: the command has these of SETTINGS as options, and gets them as its argument `overrides`.

    That is a dictionary as `Scene.settings` takes it, None where nothing was given, but for `integrator`: as it was typed.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        parameters: list[inspect.Parameter] = []
        for own in inspect.signature(command, eval_str=True).parameters.values():
            shared = [
                own.replace(name=name, annotation=SETTINGS[name], default=False if name == "ledger" else None) for name in names
            ]
            parameters += shared if own.name == "overrides" else [own]

        def called(**given: Any) -> None:
            overrides = {name: given.pop(name) for name in names}
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
