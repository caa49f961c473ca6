# mypy: ignore-errors
"""The motion unit: moves of integrators, forces, and other passes over all particles once per substep or frame."""

from __future__ import annotations

from pyverlet.core.energy_limiting import raise_of
from pyverlet.core.energy_removal import remove_energy
from pyverlet.core.fluid import energy_of_fluid, flow_of_fluid
from pyverlet.core.forces import add_drag, add_values, attract, function_arguments, soften, thermalize
from pyverlet.core.function_calls import add_compiled, compiled_values
from pyverlet.core.gravity_sums import gravitate
from pyverlet.core.islands import join_near_pairs, join_rows, settle
from pyverlet.core.moves import advance, advance_by_two, all_finite, first_non_finite, mean_of_step, newton
from pyverlet.core.near_pairs import add_along, measure_near, moved_beyond
from pyverlet.core.own_walls import confine_to_box, confine_to_circle
from pyverlet.core.resting import find_islands, time_at_rest
from pyverlet.core.velocity_solving import next_velocity

__all__ = [
    "add_along",
    "add_compiled",
    "add_drag",
    "add_values",
    "advance",
    "advance_by_two",
    "all_finite",
    "attract",
    "compiled_values",
    "confine_to_box",
    "confine_to_circle",
    "energy_of_fluid",
    "find_islands",
    "first_non_finite",
    "flow_of_fluid",
    "function_arguments",
    "gravitate",
    "join_near_pairs",
    "join_rows",
    "mean_of_step",
    "measure_near",
    "moved_beyond",
    "newton",
    "next_velocity",
    "raise_of",
    "remove_energy",
    "settle",
    "soften",
    "thermalize",
    "time_at_rest",
]
