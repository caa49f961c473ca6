# mypy: ignore-errors
"""The engine unit: stepping a world, passing rows in and out, and measurements."""

from __future__ import annotations

from pyverlet.core.engine_object import Engine
from pyverlet.core.engine_records import given_by
from pyverlet.core.measure import energies, momenta, pinned_move
from pyverlet.core.periodic import wrap
from pyverlet.core.plain_object import PlainFrames
from pyverlet.core.plain_worlds import PlainWorlds
from pyverlet.core.rows import any_differs, put_motion, take_motion
from pyverlet.core.total_energy import energy_gained, total_energy

__all__ = [
    "Engine",
    "PlainFrames",
    "PlainWorlds",
    "any_differs",
    "energies",
    "energy_gained",
    "given_by",
    "momenta",
    "pinned_move",
    "put_motion",
    "take_motion",
    "total_energy",
    "wrap",
]
