# mypy: ignore-errors
"""Who touches whom in a frame, how fast they met and how often they bounced: for events, while somebody listens."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import CONTACT, GAP, HEARD, HEARD_BOUNCES, HEARD_SPEED, PUSH, ROUNDED

SURFACE_BIT = cython.declare(int64_t, 0x80000000)
"""Of the keys of contacts with surfaces."""


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
    none: real = 0
    impulse: cython.pointer(real) = w.impulse
    depth: cython.pointer(real) = w.depth
    load: cython.pointer(real) = w.load
    met: cython.pointer(real) = w.met
    touched: cython.pointer(int32_t) = w.touched
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):  # without branches, eight at a time
        touched[k] |= (impulse[k] > none) | (depth[k] > none)
        given: real = impulse[k] if load[k] <= none else none
        met[k] = given if given > met[k] else met[k]


@kernel
def hear_surface_loads(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Surfaces that carry particle i touch it, and those that it is at to rounding though they carry nothing."""
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        given: cython.double = w.contact[CONTACT * k + PUSH]
        if (given > 0 or w.contact[CONTACT * k + GAP] <= ROUNDED * w.radius[i]) and w.surface[k] >= 0:
            if w.contact[CONTACT * k + HEARD] == 0:
                w.contact[CONTACT * k + HEARD_SPEED] = max(w.contact[CONTACT * k + HEARD_SPEED], given)
            w.contact[CONTACT * k + HEARD] = 1


@kernel
def take_heard(
    w: cython.pointer(Step), number: cython.pointer(int64_t), key: cython.pointer(int64_t), speed: cython.p_double,
    bounces: cython.pointer(int64_t),
) -> cython.Py_ssize_t:  # fmt: skip
    """What was heard, which is then forgotten; returns of how many contacts. number: of each of the user's particles.

    Keys have the lower number in their upper half, and in the lower the other one + 1, or `SURFACE_BIT` and the surface.
    """
    n: cython.Py_ssize_t = 0
    k: cython.Py_ssize_t
    for s in range(w.groups):
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            if w.touched[k] != 0:
                a: int64_t = number[w.lists.particle[w.i[k]]]
                b: int64_t = number[w.lists.particle[w.j[k]]]
                key[n], speed[n], bounces[n] = (min(a, b) << 32) + max(a, b) + 1, w.met[k], w.bounces[k]
                w.touched[k], w.met[k], w.bounces[k] = 0, 0, 0
                n += 1
    for i in range(w.count if w.surfaces_good else 0):
        for k in range(w.contact_begin[i], w.contact_end[i]):
            row: cython.pointer(cython.double) = w.contact
            at: cython.Py_ssize_t = CONTACT * k
            if row[at + HEARD] > 0:
                key[n] = (number[w.lists.particle[i]] << 32) + SURFACE_BIT + w.surface[k]
                speed[n], bounces[n] = row[at + HEARD_SPEED], cython.cast(int64_t, row[at + HEARD_BOUNCES])
                row[at + HEARD_SPEED] = row[at + HEARD_BOUNCES] = row[at + HEARD] = 0
                n += 1
    return n
