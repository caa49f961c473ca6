# mypy: ignore-errors
"""The unit of motion: the moves of integrators, forces, and what else goes through all particles once in a substep or a frame."""

from __future__ import annotations

from pyverlet.core.energy_limiting import raise_of
from pyverlet.core.energy_taking import take_energy
from pyverlet.core.forces import add_constant, add_drag, add_drag_in_field, add_point_spring, attract, soften
from pyverlet.core.free_places import mark_free_places
from pyverlet.core.function_values import add_values, function_arguments
from pyverlet.core.gravitation import gravitate, gravitational_potential
from pyverlet.core.islands import join_near_pairs, join_rows, settle
from pyverlet.core.moves import (
    advance,
    all_finite,
    clear_pinned,
    first_non_finite,
    kick_free,
    newton,
    newton_kick_drift,
)
from pyverlet.core.own_walls import confine_to_box, confine_to_circle
from pyverlet.core.periodic import follow, wrap
from pyverlet.core.resting import find_edited, find_islands, time_at_rest, touch
from pyverlet.core.rows import any_differs, differs, put_motion, take_motion
from pyverlet.core.textbook_walls import clamp_to_box, clamp_to_circle
from pyverlet.core.total_energy import energy_gained, total_energy
from pyverlet.core.touching import touching

__all__ = [
    "add_constant",
    "add_drag",
    "add_drag_in_field",
    "add_point_spring",
    "add_values",
    "advance",
    "all_finite",
    "any_differs",
    "attract",
    "clamp_to_box",
    "clamp_to_circle",
    "clear_pinned",
    "confine_to_box",
    "confine_to_circle",
    "differs",
    "energy_gained",
    "find_edited",
    "find_islands",
    "first_non_finite",
    "follow",
    "function_arguments",
    "gravitate",
    "gravitational_potential",
    "join_near_pairs",
    "join_rows",
    "kick_free",
    "mark_free_places",
    "newton",
    "newton_kick_drift",
    "put_motion",
    "raise_of",
    "settle",
    "soften",
    "take_energy",
    "take_motion",
    "time_at_rest",
    "total_energy",
    "touch",
    "touching",
    "wrap",
]
