# mypy: ignore-errors
"""What pairs are made of: contact distance, masses, restitution, friction and radii. One for all, or one a lane."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.pair_lists import Lists
from pyverlet.core.step import Step


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def compose(w: cython.pointer(Step), ls: cython.pointer(Lists), k: int64_t, i: int64_t, j: int64_t) -> cython.void:
    """Restitution, friction and radii of particles i and j, in lane k.

    Of two discs the larger restitution counts, and the geometric mean of the frictions; those of all stand for negative ones.
    """
    e: real = cython.cast(real, ls.restitution)
    mu: real = cython.cast(real, ls.friction)
    of_i: real = w.own_restitution[i] if w.own_restitution[i] >= 0 else e
    of_j: real = w.own_restitution[j] if w.own_restitution[j] >= 0 else e
    w.restitution[k] = max(of_i, of_j)
    w.friction[k] = mu
    if w.own_friction[i] >= 0 or w.own_friction[j] >= 0:
        of_i = w.own_friction[i] if w.own_friction[i] >= 0 else mu
        of_j = w.own_friction[j] if w.own_friction[j] >= 0 else mu
        w.friction[k] = cython.cast(real, sqrt(of_i * of_j))
    w.radius_i[k], w.radius_j[k] = w.radius[i], w.radius[j]
    w.turn_i[k], w.turn_j[k] = 2 / w.radius[i], 2 / w.radius[j]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def fill_lanes(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """What the pairs of group s are made of, as far as they are not all alike."""
    k: int64_t
    if w.sized or w.varied:
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            i: int64_t = w.i[k]
            j: int64_t = w.j[k]
            if w.sized:
                w.reach[k] = w.radius[i] + w.radius[j]
            if w.varied:
                w.share[k] = w.inverse_mass[i] / (w.inverse_mass[i] + w.inverse_mass[j])
    if w.mixed:
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            compose(w, ls, k, w.i[k], w.j[k])


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def fill_alike(w: cython.pointer(Step), ls: cython.pointer(Lists)) -> cython.void:
    """What is the same for all pairs, in the first eight lanes."""
    k: int64_t
    for k in range(8):
        if not w.sized:
            w.reach[k] = w.radius[0] + w.radius[0]
        if not w.varied:
            w.share[k] = cython.cast(real, 0.5)
        if not w.mixed:
            compose(w, ls, k, 0, 0)
