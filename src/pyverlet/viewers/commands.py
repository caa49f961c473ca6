"""Everything a viewer may ask of the world: a closed set of small values, checked when they are made."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pyverlet import checks
from pyverlet.errors import InputError

MAX_SUBSTEPS = 64
"""More substeps than this a frame help no scene and would let a slip of the mouse freeze it."""

MAX_GRAVITY = 1000.0
"""m/s^2 in either direction. A hundred times the Earth's is play; beyond it is a typing error."""

MAX_STEPS = 600
"""Frames one Step may ask for: ten seconds at 60 a second."""


def _finite(name: str, value: float, limit: float = math.inf) -> None:
    checks.number(name, value)
    if abs(value) > limit:
        raise InputError(f"{name} is {value:g}; allowed is a number from {-limit:g} to {limit:g}")


@dataclass(frozen=True, slots=True)
class Pause:
    """Hold the world still (`on`) or let it run."""

    on: bool


@dataclass(frozen=True, slots=True)
class Step:
    """Pause, then advance by this many frames."""

    frames: int = 1

    def __post_init__(self) -> None:
        checks.whole("frames", self.frames, most=MAX_STEPS)


@dataclass(frozen=True, slots=True)
class Reset:
    """Go back to the state the session started with; gravity and substeps keep what the sliders say."""


@dataclass(frozen=True, slots=True)
class SetGravity:
    """Set the gravity vector, m/s^2, y up."""

    x: float
    y: float

    def __post_init__(self) -> None:
        _finite("gravity x", self.x, MAX_GRAVITY)
        _finite("gravity y", self.y, MAX_GRAVITY)


@dataclass(frozen=True, slots=True)
class SetSubsteps:
    """Set the substeps of a frame."""

    value: int

    def __post_init__(self) -> None:
        checks.whole("substeps", self.value, most=MAX_SUBSTEPS)


@dataclass(frozen=True, slots=True)
class Drag:
    """Pull a particle towards (x, y), metres. The first one of a hand picks the nearest particle whose rim is
    within `reach` metres; if there is none, the hand stays empty until it is released.
    """

    hand: int
    x: float
    y: float
    reach: float = 0.0

    def __post_init__(self) -> None:
        _finite("x", self.x)
        _finite("y", self.y)
        _finite("reach", self.reach)


@dataclass(frozen=True, slots=True)
class Poke:
    """Push everything near (x, y), metres, away from it until the hand is released."""

    hand: int
    x: float
    y: float

    def __post_init__(self) -> None:
        _finite("x", self.x)
        _finite("y", self.y)


@dataclass(frozen=True, slots=True)
class Release:
    """Let go of whatever this hand drags or pokes."""

    hand: int


Command = Pause | Step | Reset | SetGravity | SetSubsteps | Drag | Poke | Release
