"""A histogram beside a curve, live: what a scene measures, and what theory says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pyverlet.world.world import World


@dataclass(frozen=True)
class Graph:
    """What is on show."""

    title: str  # one line above it
    axis: str  # what is along x, from 0 to `most`
    most: float  # value of x at the right end
    bars: tuple[float, ...]  # heights of bars as wide as each other, from x = 0 on; of the same scale as the curve
    curve: tuple[float, ...]  # heights at as many places, evenly spaced from x = 0 to `most`
    note: str  # one line below it


GraphReader = Callable[[World], Graph]
"""Called with the world for each picture; it may remember what it has seen."""
