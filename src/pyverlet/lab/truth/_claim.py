"""An experiment on a claim: the claim, the mathematics, the experiment, its numbers, and the verdict.

Also the bouncing ball that experiments share: 1 kg, in float64, one step per frame of 1/60 s.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pyverlet.common.arrays import Floats
from pyverlet.laws.boundaries import Boundary, Box, Open
from pyverlet.laws.integrators import Integrator
from pyverlet.laws.textbook import ClampAndFlip
from pyverlet.world.world import World


@dataclass(frozen=True)
class Number:
    """A measured number, and the condition on it for the verdict."""

    what: str  # description
    value: float  # measured
    unit: str = ""  # SI, empty for a pure number
    expected: float | None = None  # exact value, if any
    within: float = 1e-9  # largest relative difference from `expected`
    below: float | None = None  # upper limit, for rounding that differs between machines; printed as "below"
    above: float | None = None  # lower limit
    digits: int = 4  # significant digits printed

    @property
    def holds(self) -> bool:
        """Whether the number meets its condition."""
        return (
            (self.expected is None or abs(self.value - self.expected) <= self.within * abs(self.expected))
            and (self.below is None or abs(self.value) < self.below)
            and (self.above is None or self.value > self.above)
        )

    @property
    def text(self) -> str:
        """The number as printed, the same on every machine as long as it holds."""
        unit = f" {self.unit}" if self.unit else ""
        if self.below is not None and self.holds:
            return f"below {self.below:g}{unit}"
        if isinstance(self.value, int):
            return f"{self.value}{unit}"
        measured = f"{self.value:#.{self.digits}g}{unit}"
        return measured if self.expected is None else f"{measured} (on paper {self.expected:#.{self.digits}g}{unit})"


@dataclass(frozen=True)
class Experiment:
    """A claim of the articles and the experiment on it."""

    code: str  # J1 to J9
    claim: str  # in words
    mathematics: str  # the truth, in two or three lines
    setting: str  # the experiment
    verdict: str  # on the claim, if the numbers hold
    measure: Callable[[], Sequence[Number]]  # makes the numbers

    def run(self) -> Finding:
        """Make the numbers."""
        return Finding(self, tuple(self.measure()))


@dataclass(frozen=True)
class Finding:
    """An experiment and its numbers."""

    experiment: Experiment
    numbers: tuple[Number, ...]

    @property
    def holds(self) -> bool:
        """Whether all numbers meet their conditions."""
        return all(number.holds for number in self.numbers)

    @property
    def verdict(self) -> str:
        """The verdict, or that this run does not support it."""
        return self.experiment.verdict if self.holds else "not borne out by these numbers"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, for JSON."""
        numbers = [
            {"what": n.what, "value": n.value, "unit": n.unit, "expected": n.expected, "below": n.below, "holds": n.holds}
            for n in self.numbers
        ]
        about = {name: getattr(self.experiment, name) for name in ("code", "claim", "mathematics", "setting")}
        return {**about, "numbers": numbers, "verdict": self.verdict, "holds": self.holds}


EXPERIMENTS: dict[str, Experiment] = {}
"""By code, in order of declaration; `pyverlet.lab.truth.EXPERIMENTS` is sorted by code."""


def experiment(
    code: str, *, claim: str, mathematics: str, setting: str, verdict: str
) -> Callable[[Callable[[], Sequence[Number]]], Callable[[], Sequence[Number]]]:
    """Register a function that makes the numbers as the experiment on a claim. Line breaks in the texts are ignored."""
    claim, mathematics, setting, verdict = (" ".join(text.split()) for text in (claim, mathematics, setting, verdict))

    def register(measure: Callable[[], Sequence[Number]]) -> Callable[[], Sequence[Number]]:
        EXPERIMENTS[code] = Experiment(code, claim, mathematics, setting, verdict, measure)
        return measure

    return register


G = 9.81
H = 1 / 60
RADIUS = 0.25
HEIGHT = 3.0  # initial height of the centre, m

ROOM = Box((-5, 0), (5, 50), restitution=1.0)
FLIP = ClampAndFlip(ROOM)
OPEN = Open()
MINUTE = 3600  # frames


def path(
    integrator: Integrator, boundary: Boundary, frames: int, *, speed: float = 0.0, gravity: float = G
) -> tuple[Floats, Floats, Floats]:
    """Height, velocity and energy of a ball thrown upward at `speed`, m/s: (frames + 1,) each, start included."""
    world = World(gravity=(0, -gravity), integrator=integrator, boundary=boundary, collisions=None, substeps=1, dtype=np.float64)
    world.add(position=(0, HEIGHT), velocity=(0, speed), radius=RADIUS, mass=1.0)
    rows = np.empty((frames + 1, 3))
    for frame in range(frames + 1):
        if frame:
            world.step(H)
        rows[frame] = world.position[0, 1], world.velocity[0, 1], world.energy().total
    y, v, energy = rows.T
    return y, v, energy


def tops(y: Floats) -> Floats:
    """Largest heights between bounces, at the ends of steps."""
    inner = y[1:-1]
    return inner[(inner > y[:-2]) & (inner >= y[2:])]
