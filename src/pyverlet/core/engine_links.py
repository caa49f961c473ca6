# mypy: ignore-errors
"""Links as Python gives them to the engine (`world/link_rows.py`)."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import doubles, indices, integers, small_integers

from pyverlet.core.engine_rebounds import make_rebound_arrays
from pyverlet.core.link_arrays import MOTOR, Links
from pyverlet.core.step import Step

MOST_TOGETHER = cython.declare(cython.int, 12)
"""Particles, that rigid links join, on which blows act as a whole. Sweeps over larger nets hand them on no farther."""


@cython.cfunc
def fill_links(w: cython.pointer(Step), engine, a, passes: cython.int, period_x: cython.double, period_y: cython.double):
    """Take the addresses of what `LinkRows` has, and make what only the core looks at."""
    k: cython.pointer(Links) = w.link_table
    particles, rows, pins = len(a["slot"]), len(a["kind"]), len(a["pin_node"])
    k.count, k.rows, k.pins, k.colours, k.passes = particles, rows, pins, len(a["colour"]) - 1, passes
    k.period_x, k.period_y = period_x, period_y
    if "x" not in a:
        a |= {name: np.zeros((particles, 2)) for name in ("x", "u", "loaned", "driven", "react")}
        a |= {name: np.zeros(particles) for name in ("own", "weight", "rim", "ease", "spun", "struck")}
        a["begun"] = np.zeros((particles, 3))
        a |= {name: np.zeros((len(a["node"]), 2)) for name in ("gradient", "slope")}
        a |= {name: np.zeros(rows) for name in ("soft", "target", "turned", "turning", "keeps", "chord_speed", "blow", "saved")}
        a |= {name: np.zeros((rows, 2)) for name in ("way", "end_way", "given", "along", "wanted", "answer", "had")}
        a |= {"inverse": np.zeros((rows, 3)), "ahead": np.zeros((rows, 3)), "acts": np.zeros(rows, np.int32)}
        a["rubs"] = np.ones(particles, np.int32)
        a["held"] = np.full(particles, -1, np.int32)
        driven = a["node"][a["first"][:-1][a["kind"] == MOTOR]]
        a["powered"] = np.bincount(driven, minlength=particles).astype(np.int32)
        a["stiff"] = stiff_ones(a)
        a |= {"pin_soft": np.zeros(pins), "pin_target": np.zeros((pins, 2))}
    k.slot, k.x, k.u, k.react = (
        indices(a["slot"]),
        doubles(a["x"]),
        doubles(a["u"]),
        doubles(a["react"]),
    )
    k.own, k.weight = doubles(a["own"]), doubles(a["weight"])
    k.first, k.node, k.gradient, k.slope = integers(a["first"]), integers(a["node"]), doubles(a["gradient"]), doubles(a["slope"])
    k.kind, k.rest, k.stiffness, k.damping = (
        small_integers(a["kind"]),
        doubles(a["rest"]),
        doubles(a["stiffness"]),
        doubles(a["damping"]),
    )
    k.upper, k.strength, k.intact = doubles(a["upper"]), doubles(a["strength"]), small_integers(a["intact"])
    k.impulse, k.load, k.pull, k.value = doubles(a["impulse"]), doubles(a["load"]), doubles(a["pull"]), doubles(a["value"])
    k.next, k.soft, k.target, k.turned = doubles(a["next"]), doubles(a["soft"]), doubles(a["target"]), doubles(a["turned"])
    k.chord_speed = doubles(a["chord_speed"])
    k.begun, k.had = doubles(a["begun"]), doubles(a["had"])
    k.rubs, k.rim, k.ease = small_integers(a["rubs"]), doubles(a["rim"]), doubles(a["ease"])
    k.held = small_integers(a["held"])
    k.struck, k.ahead, k.blow = doubles(a["struck"]), doubles(a["ahead"]), doubles(a["blow"])
    k.saved, k.stiff = doubles(a["saved"]), small_integers(a["stiff"])
    k.loose = bool(a["alone"].all())
    k.spun, k.powered, k.slack = doubles(a["spun"]), small_integers(a["powered"]), doubles(a["slack"])
    k.motors = bool(a["powered"].any())
    k.gives = not (np.isinf(a["stiffness"]).all() and np.isinf(a["pin_stiffness"]).all()) or k.motors
    k.driven = doubles(a["driven"])
    k.loaned, k.keeps = doubles(a["loaned"]), doubles(a["keeps"])
    k.turning = doubles(a["turning"])
    k.acts, k.way, k.end_way, k.given = small_integers(a["acts"]), doubles(a["way"]), doubles(a["end_way"]), doubles(a["given"])
    k.along, k.wanted, k.answer, k.inverse = (
        doubles(a["along"]),
        doubles(a["wanted"]),
        doubles(a["answer"]),
        doubles(a["inverse"]),
    )
    k.alone = small_integers(a["alone"])
    k.block, k.chunk, k.colour = integers(a["block"]), integers(a["chunk"]), integers(a["colour"])
    k.pin_node, k.pin_point, k.pin_intact = integers(a["pin_node"]), doubles(a["pin_point"]), small_integers(a["pin_intact"])
    k.pin_stiffness, k.pin_damping, k.pin_strength = (
        doubles(a["pin_stiffness"]),
        doubles(a["pin_damping"]),
        doubles(a["pin_strength"]),
    )
    k.pin_impulse, k.pin_load, k.pin_pull = doubles(a["pin_impulse"]), doubles(a["pin_load"]), doubles(a["pin_pull"])
    k.pin_value, k.pin_next = doubles(a["pin_value"]), doubles(a["pin_next"])
    k.pin_soft, k.pin_target = doubles(a["pin_soft"]), doubles(a["pin_target"])
    make_rebound_arrays(w, engine)


@cython.cfunc
def stiff_ones(a):
    """Of each linked particle, whether a rigid row or pin holds it, of few that hang together: on all of these its blows act."""
    count, entries = len(a["slot"]), np.diff(a["first"])
    rigid = np.repeat(np.isinf(a["stiffness"]) & (a["kind"] != MOTOR), entries)
    node, row = a["node"][rigid], np.repeat(np.arange(len(entries)), entries)[rigid]
    lowest, held = np.arange(count), np.bincount(node, minlength=count)
    held += np.bincount(a["pin_node"][np.isinf(a["pin_stiffness"])], minlength=count)
    before = None
    while before is None or (lowest != before).any():
        before, least = lowest.copy(), np.full(len(entries), count)
        np.minimum.at(least, row, lowest[node])
        np.minimum.at(lowest, node, least[row])
        lowest = lowest[lowest]
    return ((held > 0) & (np.bincount(lowest, minlength=count)[lowest] <= MOST_TOGETHER)).astype(np.int32)
