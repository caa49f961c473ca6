"""Columns of the arrays of all obstacles: rounded segments as the core has them, see `core.obstacles`, and bodies."""

from __future__ import annotations

OF, FIRST, FACES, AROUND = 0, 1, 2, 3
START, ALONG, LENGTH, ROUNDING, INNER = slice(4, 6), slice(6, 8), 8, 9, 10
BEFORE, AFTER = slice(11, 13), slice(13, 15)
RESTITUTION, FRICTION, BELT, CATEGORY, MASK, WAY, SENSOR, ROLLING = 15, 16, 17, 18, 19, slice(20, 22), 22, 36
MATERIAL = 37  # the number of its name among those of `Collisions`, which `world.obstacle_rows` writes
WIDTH = 40

X, Y, ANGLE, VX, VY, SPIN = range(6)
"""Of bodies: where a pivot is at the beginning of a frame, m and rad, and how it moves, m/s and rad/s."""
