# mypy: ignore-errors
"""Who touches whom in a frame, how fast they met and how often they bounced: for events, while somebody listens."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import CONTACT, HEARD, HEARD_BOUNCES, HEARD_SPEED, PUSH


@inlined
def least_bounce(w: cython.pointer(Step), i: cython.Py_ssize_t) -> real:
    """Contacts that particle i meets more slowly carry load, m/s."""
    return w.least_bounce if w.falls_free else max(w.least_bounce, w.resting * w.strength[i])


@inlined
def least_of_pair(w: cython.pointer(Step), k: cython.Py_ssize_t) -> real:
    """The same of the pair in lane k."""
    return max(least_bounce(w, w.i[k]), least_bounce(w, w.j[k]))


@inlined
def hear_pair(w: cython.pointer(Step), k: cython.Py_ssize_t, speed: cython.double, away: cython.double) -> cython.void:
    """Pair k has met at a speed, and leaves at another one: it has bounced if that is faster than contacts at rest are."""
    if w.listening:
        w.touched[k] = 1
        w.met[k] = max(w.met[k], cython.cast(real, speed))
        if away > least_of_pair(w, k):
            w.bounces[k] += 1


@inlined
def hear_surface(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, speed: cython.double, away: cython.double
) -> cython.void:
    """The same of contact k of particle i with a surface."""
    if w.listening:
        row: cython.pointer(cython.double) = w.contact
        row[CONTACT * k + HEARD] = 1
        row[CONTACT * k + HEARD_SPEED] = max(row[CONTACT * k + HEARD_SPEED], speed)
        if away > least_bounce(w, i):
            row[CONTACT * k + HEARD_BOUNCES] += 1


@kernel
def hear_loads(w: cython.pointer(Step), s: cython.Py_ssize_t) -> cython.void:
    """Pairs of group s that carry load or overlap touch; what a contact without a past gives is the speed at which it was met."""
    k: cython.Py_ssize_t
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
        if w.impulse[k] > 0 or w.depth[k] > 0:
            w.touched[k] = 1
            if w.load[k] <= 0:
                w.met[k] = max(w.met[k], w.impulse[k])


@kernel
def hear_surface_loads(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Surfaces that carry particle i."""
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        given: cython.double = w.contact[CONTACT * k + PUSH]
        if given > 0 and w.surface[k] >= 0:
            if w.contact[CONTACT * k + HEARD] == 0:
                w.contact[CONTACT * k + HEARD_SPEED] = max(w.contact[CONTACT * k + HEARD_SPEED], given)
            w.contact[CONTACT * k + HEARD] = 1
