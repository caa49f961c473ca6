"""The same ball on a fast and on a slow screen, stepped by frame time and by a fixed clock."""

from __future__ import annotations

from dataclasses import dataclass

from pyverlet.laws.integrators import SemiImplicitEuler
from pyverlet.scenes import _drop
from pyverlet.scenes._scene import Scene, Settings, Variant
from pyverlet.world.clock import Clock
from pyverlet.world.world import World

SLOW = 6
"""Frames of the fast screen for one of the slow: 60 and 10 a second at the usual dt."""


@dataclass(frozen=True)
class RawFrameTime:
    """Draw every so many frames, and advance the world by the whole time since the last drawing in one step."""

    every: int

    def __call__(self, world: World, frame: int, dt: float) -> None:
        """A frame of the fast screen has passed."""
        if frame % self.every == 0:
            world.step(self.every * dt)


@dataclass(frozen=True)
class FixedClock:
    """Draw every so many frames, and make as many frames of fixed length as a `Clock` says are due."""

    every: int

    def __call__(self, world: World, frame: int, dt: float) -> None:
        """A frame of the fast screen has passed."""
        if frame % self.every == 0:
            for _ in range(Clock(dt=dt, max_catch_up=self.every).advance(self.every * dt)):
                world.step(dt)


def build(settings: Settings) -> World:
    """One ball at 60 and at 10 frames a second: by raw frame time it moves differently, by the fixed clock the same.

    The articles: multiply by the frame time, and speed no longer depends on the frame rate. The speed does not, the motion
    does: a longer step is another error. With a fixed step behind an accumulator the two screens see the same bits.
    """
    return _drop.drop(settings)


SCENE = Scene(
    "frame-rate",
    "one ball at 60 and 10 frames a second, by raw frame time and by a fixed clock",
    build,
    _drop.settings(SemiImplicitEuler()),
    variants=(
        Variant("raw, 60 a second", pace=RawFrameTime(1)),
        Variant("raw, 10 a second", pace=RawFrameTime(SLOW)),
        Variant("clock, 60 a second", pace=FixedClock(1)),
        Variant("clock, 10 a second", pace=FixedClock(SLOW)),
    ),
    line=_drop.HEIGHT,
)
