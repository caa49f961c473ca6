# mypy: ignore-errors
"""What was heard of contacts, as Python takes it."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import reals_in, small_integers_in

from pyverlet.core import engine_numpy
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import HEARD, HEARD_BOUNCES, HEARD_SPEED


@cython.cfunc
def make_hearing_arrays(w: cython.pointer(Step), a, dtype):
    """One a lane, if somebody listens."""
    lanes = w.lists.lanes_room if w.listening else 0
    if "met" not in a or len(a["met"]) < lanes:
        a["met"], a["touched"], a["bounces"] = np.zeros(lanes, dtype), np.zeros(lanes, np.int32), np.zeros(lanes, np.int32)
        w.met, w.touched, w.bounces = reals_in(a, "met"), small_integers_in(a, "touched"), small_integers_in(a, "bounces")


@cython.cfunc
def hear(w: cython.pointer(Step), a):
    """((i, j, speed, bounces), (slot, surface, speed, bounces)) of those that touch, by slot; they are then forgotten."""
    if "depth" in a:
        make_hearing_arrays(w, a, a["depth"].dtype)
    pairs = engine_numpy.heard_pairs(a, w.groups)
    if w.count <= 0 or not w.surfaces_good:
        return pairs, engine_numpy.NOTHING_HEARD
    return pairs, engine_numpy.heard_surfaces(a, w.side, HEARD_SPEED, HEARD_BOUNCES, HEARD)
