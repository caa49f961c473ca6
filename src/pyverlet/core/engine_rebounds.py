# mypy: ignore-errors
"""Arrays for impacts of linked particles, in worlds that have such."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import doubles, integers, small_integers

from pyverlet.core.cells import BLOCK
from pyverlet.core.rebounds import BLOW, REBOUND
from pyverlet.core.step import Step


@cython.cfunc
def make_rebound_arrays(w: cython.pointer(Step), a):
    """As many as there are particles, groups, lanes, and places of surfaces."""
    if not w.linked or w.count < 0:
        return
    groups, lanes = len(a["bounced"]), w.lists.lanes_room
    for name, shape, dtype in (
        ("blow", (w.count, BLOW), np.float64),
        ("node", (w.count,), np.int32),
        ("rebounds", ((w.count + BLOCK - 1) // BLOCK,), np.int32),
        ("rebounded", (groups,), np.int32),
        ("rebounding", (groups,), np.int32),
        ("rebound_sum", (groups + (w.count + BLOCK - 1) // BLOCK, 2), np.float64),
        ("rebound_pair", (lanes,), np.int64),
        ("pair_rebound", (lanes, REBOUND), np.float64),
        ("surface_rebound", (w.contact_room + 8, REBOUND), np.float64),
    ):
        if name not in a or a[name].shape != shape:
            a[name] = np.zeros(shape, dtype)
    w.blow, w.node, w.rebounds = doubles(a["blow"]), small_integers(a["node"]), small_integers(a["rebounds"])
    w.rebounded, w.rebounding = small_integers(a["rebounded"]), small_integers(a["rebounding"])
    w.rebound_pair, w.pair_rebound = integers(a["rebound_pair"]), doubles(a["pair_rebound"])
    w.rebound_sum = doubles(a["rebound_sum"])
    w.surface_rebound = doubles(a["surface_rebound"])
