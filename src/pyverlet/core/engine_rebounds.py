# mypy: ignore-errors
"""Allocates arrays for impacts of linked particles, in worlds that have links."""

from __future__ import annotations

import cython
from cython.cimports.arrays import doubles_in, integers_in, small_integers_in

from pyverlet.core import engine_numpy
from pyverlet.core.cells import BLOCK
from pyverlet.core.rebounds import IMPACT, REBOUND
from pyverlet.core.step import Step


@cython.cfunc
def make_rebound_arrays(w: cython.pointer(Step), a):
    """Allocate arrays for particles, groups, lanes, and places of surfaces."""
    if not w.linked or w.count < 0:
        return
    engine_numpy.have_rebound_arrays(
        a, w.count, (w.count + BLOCK - 1) // BLOCK, w.lists.lanes_capacity, w.contact_capacity + 8, IMPACT, REBOUND
    )
    w.impact, w.node, w.rebounds = doubles_in(a, "impact"), small_integers_in(a, "node"), small_integers_in(a, "rebounds")
    w.rebounded, w.rebounding = small_integers_in(a, "rebounded"), small_integers_in(a, "rebounding")
    w.rebound_pair, w.pair_rebound = integers_in(a, "rebound_pair"), doubles_in(a, "pair_rebound")
    w.rebound_sum = doubles_in(a, "rebound_sum")
    w.surface_rebound = doubles_in(a, "surface_rebound")
