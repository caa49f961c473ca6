# mypy: ignore-errors
"""Contact distance, masses, restitution, friction and radii of pairs: one value for all, or one per lane."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pair_lists import Lists
from pyverlet.core.step import Step


@inlined
def combined(how: cython.int, a: cython.double, b: cython.double) -> cython.double:
    """Combine two values: 0 geometric mean, 1 mean, 2 minimum, 3 maximum, 4 product."""
    if how == 4:
        return a * b
    if a == b:  # exact
        return a
    if how == 0:
        return sqrt(a * b)
    if how == 1:
        return 0.5 * (a + b)
    return min(a, b) if how == 2 else max(a, b)


@inlined
def bounce_of(how: cython.int, a: cython.double, b: cython.double) -> cython.double:
    """`combined` for restitution, where the maximum replaces the geometric mean, as in Box2D."""
    return max(a, b) if how == 0 else combined(how, a, b)


@inlined
def together(
    w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t, which: cython.int, own: cython.double
) -> cython.double:
    """Value of the material table for a and b, if any: 0 restitution, 1 friction, 2 rolling resistance; else `own`."""
    value: cython.double = w.together[3 * (a * w.materials + b) + which]
    return value if value >= 0 else own


@inlined
def compose(w: cython.pointer(Step), ls: cython.pointer(Lists), k: int64_t, i: int64_t, j: int64_t) -> cython.void:
    """Write restitution, friction, rolling resistance and radii of particles i and j to lane k.

    Negative values of particles mean the default; two materials may have values of their own.
    """
    e: cython.double = ls.restitution
    mu: cython.double = ls.friction
    c: cython.double = ls.rolling
    own: cython.double = w.own_restitution[i]
    other: cython.double = w.own_restitution[j]
    e = bounce_of(w.combine, own if own >= 0 else e, other if other >= 0 else e)
    own, other = w.own_friction[i], w.own_friction[j]
    mu = combined(w.combine, own if own >= 0 else mu, other if other >= 0 else mu)
    own, other = w.own_rolling[i], w.own_rolling[j]
    c = combined(w.combine, own if own >= 0 else c, other if other >= 0 else c)
    if w.materials > 0:
        a: cython.Py_ssize_t = w.own_material[i]
        b: cython.Py_ssize_t = w.own_material[j]
        e, mu, c = together(w, a, b, 0, e), together(w, a, b, 1, mu), together(w, a, b, 2, c)
    w.restitution[k], w.friction[k] = cython.cast(real, e), cython.cast(real, mu)
    w.rolling[k] = cython.cast(real, c) * w.radius[i] * w.radius[j] / (w.radius[i] + w.radius[j])
    w.radius_i[k], w.radius_j[k] = w.radius[i], w.radius[j]
    w.turn_i[k], w.turn_j[k] = w.ease[i] / w.radius[i], w.ease[j] / w.radius[j]
    # Values common to all lanes are filled in separately.
    part: cython.double = w.share[k] if w.varied else 0.5
    ease: cython.double = w.ease[j] + part * (cython.cast(cython.double, w.ease[i]) - w.ease[j])
    w.grip[k] = cython.cast(real, 1 / (1 + ease))


@kernel
def fill_lanes(w: cython.pointer(Step), ls: cython.pointer(Lists), s: cython.Py_ssize_t) -> cython.void:
    """Write the materials of the pairs of group s, as far as they differ."""
    if w.sized or w.varied:
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            i: int64_t = w.i[k]
            j: int64_t = w.j[k]
            if w.sized:
                w.reach[k] = w.radius[i] + w.radius[j]
                w.per_reach[k] = 1 / w.reach[k]
            if w.varied:
                w.share[k] = w.inverse_mass[i] / (w.inverse_mass[i] + w.inverse_mass[j])
    if w.mixed:
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            compose(w, ls, k, w.i[k], w.j[k])


@kernel
def fill_alike(w: cython.pointer(Step), ls: cython.pointer(Lists)) -> cython.void:
    """Write values common to all pairs to the first eight lanes."""
    k: int64_t
    for k in range(8 if w.count > 0 else 0):
        if not w.sized:
            w.reach[k] = w.radius[0] + w.radius[0]
            w.per_reach[k] = 1 / w.reach[k]
        if not w.varied:
            w.share[k] = cython.cast(real, 0.5)
        if not w.mixed:
            compose(w, ls, k, 0, 0)
