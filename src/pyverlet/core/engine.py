# mypy: ignore-errors
"""The unit of the engine: what steps a world, and what is measured of it."""

from __future__ import annotations

from pyverlet.core.engine_object import Engine
from pyverlet.core.measure import energies, energy_gained, momenta, pinned_move
from pyverlet.core.overlap import overlaps, touching
from pyverlet.core.rows import any_differs, differs, put_motion, take_motion

__all__ = [
    "Engine",
    "any_differs",
    "differs",
    "energies",
    "energy_gained",
    "momenta",
    "overlaps",
    "pinned_move",
    "put_motion",
    "take_motion",
    "touching",
]
