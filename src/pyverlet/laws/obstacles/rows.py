"""An obstacle as rows of the arrays of all: its body, its segments with their surface, and flags.

Columns are those of rounded segments in the core, see `core.obstacles`, and of bodies.
"""

from __future__ import annotations

import math

import numpy as np

from pyverlet.common.arrays import Array
from pyverlet.laws.obstacles._base import Obstacle

OF, FIRST, FACES, AROUND = 0, 1, 2, 3
START, ALONG, LENGTH, ROUNDING, INNER = slice(4, 6), slice(6, 8), 8, 9, 10
BEFORE, AFTER = slice(11, 13), slice(13, 15)
RESTITUTION, FRICTION, BELT, CATEGORY, MASK, WAY, SENSOR, ROLLING = 15, 16, 17, 18, 19, slice(20, 22), 22, 36
MATERIAL = 37  # number of its name in `Collisions`, written by `world.obstacle_rows`
WIDTH = 40

X, Y, ANGLE, VX, VY, SPIN = range(6)
"""Columns of bodies: pivot at the start of a frame, m and rad, and velocities, m/s and rad/s."""

MOVES, SENSES, DRIVES, SENSOR_MOVES, ROUGH, ROLLS, ONE_WAY, NAMED = (1 << k for k in range(8))
"""Flags of an obstacle, see the attributes of `ObstacleArrays`."""


def body_of(obstacle: Obstacle) -> tuple[float, ...]:
    """Pivot, m, angle, rad, and their velocities."""
    return (*obstacle.pivot, obstacle.angle, *obstacle.velocity, obstacle.angular_velocity)


def doing_of(obstacle: Obstacle) -> int:
    """The flags of an obstacle as bits."""
    moves, named = obstacle.moves, NAMED * bool(obstacle.material)
    if obstacle.sensor:
        return named | SENSES | (MOVES | SENSOR_MOVES) * moves
    does = named | MOVES * moves | DRIVES * (moves or obstacle.surface_speed != 0.0) | ROUGH * (obstacle.friction > 0.0)
    return does | ROLLS * (obstacle.rolling_resistance > 0.0) | ONE_WAY * (obstacle.one_way is not None)


def set_surface(rows: Array, obstacle: Obstacle) -> None:
    """Write what all segments of an obstacle have in common, and the passable direction in the frame of each."""
    rows[:, RESTITUTION : SENSOR + 1] = (
        obstacle.restitution, obstacle.friction, obstacle.surface_speed, obstacle.category, obstacle.mask, 0.0, 0.0,
        obstacle.sensor,
    )  # fmt: skip
    rows[:, ROLLING] = obstacle.rolling_resistance
    if obstacle.one_way is not None:
        (x, y), (c, d) = obstacle.one_way, rows[:, ALONG].T
        rows[:, WAY] = np.column_stack((c * x + d * y, c * y - d * x)) / math.hypot(x, y)


def segments_of(obstacle: Obstacle) -> Array:
    """The segments of an obstacle, without surface and place."""
    points, closed, rounding, convex, around = obstacle._parts()
    table = np.zeros((max(len(points) - (not closed), 1), WIDTH))
    starts = table[:, START] = points[: len(table)]
    table[:, ROUNDING], table[:, AROUND], table[:, ALONG] = rounding, around, (1.0, 0.0)
    if len(points) == 1:
        return table
    ends = np.roll(points, -1, axis=0)[: len(table)]
    side = ends - starts
    length = np.hypot(*side.T)
    along = side / np.where(length > 0, length, 1.0)[:, None]
    along[length == 0, 0] = 1.0
    table[:, ALONG], table[:, LENGTH] = along, length
    if convex:
        # Twice the area over the perimeter bounds the distance of any inner point from its nearest face.
        area = 0.5 * abs(np.sum(starts[:, 0] * ends[:, 1] - starts[:, 1] * ends[:, 0]))
        table[:, FACES], table[:, INNER] = len(starts), 2 * area / length.sum()
    if len(side) == 1:
        return table
    for to, neighbour in ((BEFORE, -np.roll(side, 1, axis=0)), (AFTER, np.roll(side, -1, axis=0))):
        ahead = (neighbour * along).sum(axis=1)
        table[:, to] = np.column_stack((ahead, along[:, 0] * neighbour[:, 1] - along[:, 1] * neighbour[:, 0]))
    if not closed:
        table[0, BEFORE] = table[-1, AFTER] = 0.0
    return table
