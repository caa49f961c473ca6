# mypy: ignore-errors
"""Passes links (`world/core_links.py`) from Python to the engine."""

from __future__ import annotations

import cython
from cython.cimports.arrays import doubles_in, indices_in, integers_in, small_integers_in

from pyverlet.core import engine_numpy
from pyverlet.core.engine_rebounds import make_rebound_arrays
from pyverlet.core.link_arrays import MOTOR, Links
from pyverlet.core.step import Step


@cython.cfunc
def fill_links(
    w: cython.pointer(Step), engine, a, passes: cython.int, substeps: cython.int, period_x: cython.double, period_y: cython.double
):
    """Set pointers to the arrays of `CoreLinks`, and allocate those that only the core uses."""
    k: cython.pointer(Links) = w.link_table
    k.count, k.rows, k.pins, k.colours = len(a["sorted_index"]), len(a["kind"]), len(a["pin_node"]), len(a["colour"]) - 1
    k.passes, k.substeps, k.period_x, k.period_y = passes, substeps, period_x, period_y
    if "x" not in a:
        engine_numpy.have_link_arrays(a, MOTOR)
    k.loose, k.motors = bool(a["alone"].all()), bool(a["powered"].any())
    k.gives = k.motors or not (np.isinf(a["stiffness"]).all() and np.isinf(a["pin_stiffness"]).all())
    k.sorted_index, k.x, k.u, k.own = indices_in(a, "sorted_index"), doubles_in(a, "x"), doubles_in(a, "u"), doubles_in(a, "own")
    k.weight, k.warmed, k.driven = doubles_in(a, "weight"), doubles_in(a, "warmed"), doubles_in(a, "driven")
    k.react, k.stiff, k.struck = doubles_in(a, "react"), small_integers_in(a, "stiff"), doubles_in(a, "struck")
    k.has_friction, k.rim, k.spun = small_integers_in(a, "has_friction"), doubles_in(a, "rim"), doubles_in(a, "spun")
    k.powered, k.ease, k.begun = small_integers_in(a, "powered"), doubles_in(a, "ease"), doubles_in(a, "begun")
    k.had, k.held = doubles_in(a, "had"), small_integers_in(a, "held")
    k.pin_node, k.pin_point = integers_in(a, "pin_node"), doubles_in(a, "pin_point")
    k.pin_stiffness, k.pin_damping = doubles_in(a, "pin_stiffness"), doubles_in(a, "pin_damping")
    k.pin_strength, k.pin_intact = doubles_in(a, "pin_strength"), small_integers_in(a, "pin_intact")
    k.pin_soft, k.pin_impulse, k.pin_load = doubles_in(a, "pin_soft"), doubles_in(a, "pin_impulse"), doubles_in(a, "pin_load")
    k.pin_pull, k.pin_value, k.pin_next = doubles_in(a, "pin_pull"), doubles_in(a, "pin_value"), doubles_in(a, "pin_next")
    k.pin_target = doubles_in(a, "pin_target")
    k.first, k.node, k.gradient = integers_in(a, "first"), integers_in(a, "node"), doubles_in(a, "gradient")
    k.slope, k.kind, k.rest = doubles_in(a, "slope"), small_integers_in(a, "kind"), doubles_in(a, "rest")
    k.stiffness, k.damping, k.upper = doubles_in(a, "stiffness"), doubles_in(a, "damping"), doubles_in(a, "upper")
    k.slack, k.strength, k.intact = doubles_in(a, "slack"), doubles_in(a, "strength"), small_integers_in(a, "intact")
    k.impulse, k.load, k.impact = doubles_in(a, "impulse"), doubles_in(a, "load"), doubles_in(a, "impact")
    k.saved, k.ahead, k.pull = doubles_in(a, "saved"), doubles_in(a, "ahead"), doubles_in(a, "pull")
    k.value, k.next, k.soft = doubles_in(a, "value"), doubles_in(a, "next"), doubles_in(a, "soft")
    k.target, k.keeps, k.acts = doubles_in(a, "target"), doubles_in(a, "keeps"), small_integers_in(a, "acts")
    k.way, k.end_way, k.chord_speed = doubles_in(a, "way"), doubles_in(a, "end_way"), doubles_in(a, "chord_speed")
    k.given, k.along, k.wanted = doubles_in(a, "given"), doubles_in(a, "along"), doubles_in(a, "wanted")
    k.turning, k.turned, k.answer = doubles_in(a, "turning"), doubles_in(a, "turned"), doubles_in(a, "answer")
    k.inverse = doubles_in(a, "inverse")
    k.block, k.alone, k.chunk = integers_in(a, "block"), small_integers_in(a, "alone"), integers_in(a, "chunk")
    k.colour = integers_in(a, "colour")
    make_rebound_arrays(w, engine)
