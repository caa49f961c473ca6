"""Obstacles: fixed or moving shapes that particles bounce off, roll over and rest on.

To add a shape: a class with `_parts`, the rounded segments that it consists of, and `outlines`, to draw it.
"""

from __future__ import annotations

from pyverlet.laws.obstacles._arrays import ObstacleArrays
from pyverlet.laws.obstacles._base import Obstacle, Obstacles, Outline, journal
from pyverlet.laws.obstacles.shapes import Capsule, Chain, Disc, Polygon, Segment

__all__ = ["Capsule", "Chain", "Disc", "Obstacle", "ObstacleArrays", "Obstacles", "Outline", "Polygon", "Segment", "journal"]
