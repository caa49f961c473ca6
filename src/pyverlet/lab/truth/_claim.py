"""An experiment on a claim: the claim, what is true, how it is tried, the numbers that come out, and the verdict.

And the one bouncing ball that the experiments share: 1 kg, in float64, one step a frame of 1/60 s.
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
    """One measured number, and what it must be for the verdict to hold."""

    what: str  # was measured
    value: float  # as measured
    unit: str = ""  # SI, empty for a pure number
    expected: float | None = None  # the same on paper, where there is one
    within: float = 1e-9  # how close to `expected` it must come, relative to it
    below: float | None = None  # the value must be smaller: it is rounding, differs between machines, and is printed as "below"
    above: float | None = None  # the value must be larger
    digits: int = 4  # significant ones that are printed

    @property
    def holds(self) -> bool:
        """Whether the number is what the verdict needs it to be."""
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
    claim: str  # what is said
    mathematics: str  # what is true, in two or three lines
    setting: str  # what is tried
    verdict: str  # on the claim, as long as the numbers hold
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
        """Whether all numbers are what the verdict says."""
        return all(number.holds for number in self.numbers)

    @property
    def verdict(self) -> str:
        """The verdict, or that this run does not bear it out."""
        return self.experiment.verdict if self.holds else "not borne out by these numbers"

    def as_dict(self) -> dict[str, Any]:
        """Plain values, ready for JSON."""
        numbers = [
            {"what": n.what, "value": n.value, "unit": n.unit, "expected": n.expected, "below": n.below, "holds": n.holds}
            for n in self.numbers
        ]
        about = {name: getattr(self.experiment, name) for name in ("code", "claim", "mathematics", "setting")}
        return {**about, "numbers": numbers, "verdict": self.verdict, "holds": self.holds}


EXPERIMENTS: dict[str, Experiment] = {}
"""By code, in the order they were declared; `pyverlet.lab.truth.EXPERIMENTS` has them in that of their codes."""


def experiment(
    code: str, *, claim: str, mathematics: str, setting: str, verdict: str
) -> Callable[[Callable[[], Sequence[Number]]], Callable[[], Sequence[Number]]]:
    """Register a function that makes the numbers as the experiment on a claim. Line breaks in the texts do not count."""
    claim, mathematics, setting, verdict = (" ".join(text.split()) for text in (claim, mathematics, setting, verdict))

    def register(measure: Callable[[], Sequence[Number]]) -> Callable[[], Sequence[Number]]:
        EXPERIMENTS[code] = Experiment(code, claim, mathematics, setting, verdict, measure)
        return measure

    return register


G = 9.81
H = 1 / 60
RADIUS = 0.25
HEIGHT = 3.0  # of the centre at the start, m

ROOM = Box((-5, 0), (5, 50), restitution=1.0)
FLIP = ClampAndFlip(ROOM)
OPEN = Open()
MINUTE = 3600  # frames


def path(
    integrator: Integrator, boundary: Boundary, frames: int, *, speed: float = 0.0, gravity: float = G
) -> tuple[Floats, Floats, Floats]:
    """Height, velocity and energy of a ball thrown upward at `speed`, m/s: (frames + 1,) each, the start included."""
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
    """Largest heights between bounces, as they were reached at the end of steps."""
    inner = y[1:-1]
    return inner[(inner > y[:-2]) & (inner >= y[2:])]
