# mypy: ignore-errors
"""The unit of the engine: what steps a world, and what is measured of it."""

from __future__ import annotations

from pyverlet.core.engine_object import Engine
from pyverlet.core.measure import energies, momenta, pinned_move
from pyverlet.core.plain_object import PlainFrames
from pyverlet.core.plain_worlds import PlainWorlds

__all__ = [
    "Engine",
    "PlainFrames",
    "PlainWorlds",
    "energies",
    "momenta",
    "pinned_move",
]
