# mypy: ignore-errors
"""The unit of the engine: what steps a world, and what is measured of it."""

from __future__ import annotations

from pyverlet.core.engine_object import Engine
from pyverlet.core.measure import energies, momenta, pinned_move
from pyverlet.core.overlap import overlaps, touching
from pyverlet.core.plain_object import PlainFrames

__all__ = [
    "Engine",
    "PlainFrames",
    "energies",
    "momenta",
    "overlaps",
    "pinned_move",
    "touching",
]
