"""What several checks build or measure: lattices, rooms, the share of energy that moves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pyverlet.ground.arrays import Array
from pyverlet.world.world import World

G = 9.81  # gravity, m/s^2
DT = 1 / 60  # a frame, s
RADIUS = 0.5  # of a circle, m, unless a check is about sizes


def frames(world: World, seconds: float) -> Iterator[int]:
    """Step the world through `seconds`, yielding the number of each frame after it."""
    for number in range(1, round(seconds / DT) + 1):
        world.step(DT)
        yield number


def columns(count: int, width: float, pitch: float) -> Array:
    """(count, 2) points of a square lattice of `pitch` (m), row by row from y = 0 up, centred on x = 0."""
    across = max(1, int(width / pitch))
    row, column = np.divmod(np.arange(count), across)
    return np.column_stack(((column - (across - 1) / 2) * pitch, (row + 0.5) * pitch))


def in_disc(count: int, radius: float, pitch: float) -> Array:
    """(count, 2) points of a square lattice of `pitch` (m), those nearest to the centre of a disc of this radius (m)."""
    axis = np.arange(-np.ceil(radius / pitch), np.ceil(radius / pitch) + 1) * pitch
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    nearest = np.argsort(np.hypot(*points.T), kind="stable")[:count]
    return np.asarray(points[nearest])


def agitation(world: World) -> float:
    """Kinetic energy per particle over m g R: 1 is what a fall through one radius gives."""
    free = np.isfinite(world.mass)
    return world.energy().kinetic / float((world.mass[free].astype(float) * G * world.radius[free]).sum())


def fastest(world: World) -> float:
    """The largest speed, m/s."""
    return float(np.hypot(*world.velocity.T).max())
