"""Obstacles as lines to draw: those that stand still go along once, those that move with every frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pyverlet.laws.obstacles import Outline
from pyverlet.picture import periodic_images
from pyverlet.viewers.layout import Layout
from pyverlet.world.world import World


@dataclass(frozen=True, eq=False)
class ObstacleOutlines:
    """Outlines of obstacles in the picture's coordinates."""

    outlines: tuple[Outline, ...] = ()

    @cached_property
    def lines(self) -> list[tuple[list[list[float]], bool]]:
        """For each outline its points in metres, and whether what it encloses is solid; ready for JSON."""
        return [(np.round(points, 6).tolist(), filled) for points, filled in self.outlines]


NO_OUTLINES = ObstacleOutlines()


class OutlineCache:
    """Outlines of the obstacles that move, or do not, in worlds side by side; the same object until an obstacle moves."""

    def __init__(self, worlds: Sequence[World], *, moving: bool) -> None:
        self._worlds, self._moving = worlds, moving
        self._drawn: list[list[Outline]] = []
        self._sketch = NO_OUTLINES

    def draw(self, layout: Layout) -> ObstacleOutlines:
        """As they are now."""
        found = [
            (layout.offset(k), obstacle.drawn(), world.boundary.seam)
            for k, world in enumerate(self._worlds)
            for obstacle in world.obstacles
            if obstacle.moves == self._moving
        ]
        drawn = [outlines for _, outlines, _ in found]
        if len(drawn) != len(self._drawn) or any(a is not b for a, b in zip(drawn, self._drawn, strict=True)):
            self._drawn = drawn
            images = [(offset, periodic_images.outlines(outlines, seam)) for offset, outlines, seam in found]
            moved = (Outline(points + offset, filled) for offset, outlines in images for points, filled in outlines)
            self._sketch = ObstacleOutlines(tuple(moved)) if drawn else NO_OUTLINES
        return self._sketch
