# mypy: ignore-errors
"""Records events while they are wanted: which contacts touch in a frame, their approach speeds and the number of bounces."""

from __future__ import annotations

import cython
from cython.cimports.lanes import above, any_lane, choose, either, lanes, lanes2, larger, load, mask, real, spread, store, take
from cython.cimports.libc.stdint import int32_t, int64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pair_memory import repeats
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import (
    EVENT,
    EVENT_BOUNCES,
    EVENT_IMPULSE,
    EVENT_SPEED,
    GAP,
    NORMAL,
    NORMAL_Y,
    PUSH,
    ROUNDED,
    SPEED,
    SPEED_Y,
    pinned_lane,
    row_of,
)

SURFACE_BIT = cython.declare(int64_t, 0x80000000)
"""Bit in the keys of contacts with surfaces."""


@inlined
def least_bounce(w: cython.pointer(Step), i: cython.Py_ssize_t) -> real:
    """Contacts of particle i with lower speeds carry load, m/s."""
    return w.least_bounce if w.falls_free else max(w.least_bounce, w.resting * w.strength[i])


@inlined
def least_of_pair(w: cython.pointer(Step), k: cython.Py_ssize_t) -> real:
    """`least_bounce` of the pair in lane k."""
    return max(least_bounce(w, w.i[k]), least_bounce(w, w.j[k]))


@inlined
def record_impact(
    w: cython.pointer(Step), k: cython.Py_ssize_t, speed: cython.double, given: cython.double, away: cython.double
) -> cython.void:  # fmt: skip
    """Record that pair k met at `speed` and got the impulse `given`, over the reduced mass, `away` of it beyond stopping.

    It counts as a bounce if `away` exceeds the speed of resting contacts.
    """
    if w.records_events:
        w.touched[k] = 1
        w.met[k] = max(w.met[k], cython.cast(real, speed))
        w.pressed[k] += cython.cast(real, given)
        if away > least_of_pair(w, k):
            w.bounces[k] += 1


@inlined
def record_pair(w: cython.pointer(Step), k: cython.Py_ssize_t, speed: cython.double, away: cython.double) -> cython.void:
    """Record that pair k met at a speed and separates at another."""
    record_impact(w, k, speed, speed + away, away)


@inlined
def record_surface(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, speed: cython.double, away: cython.double
) -> cython.void:
    """Record that contact k of particle i with a surface met at `speed` and separates at `away`."""
    if w.records_events:
        row: cython.pointer(cython.double) = w.contact
        row[row_of(k) + EVENT] = 1
        row[row_of(k) + EVENT_SPEED] = max(row[row_of(k) + EVENT_SPEED], speed)
        row[row_of(k) + EVENT_IMPULSE] += speed + away
        if away > least_bounce(w, i):
            row[row_of(k) + EVENT_BOUNCES] += 1


@inlined
def record_approach(
    w: cython.pointer(Step), k: cython.Py_ssize_t, speed: lanes, nx: lanes, ny: lanes, before: lanes, after: lanes
) -> cython.void:  # fmt: skip
    """Record the approach speed of those of the pairs from k on whose contact begins to act.

    If another contact has stopped one of the two in this sweep, the speed before any contact acted is taken. Impulses are no
    measure of it: a supported particle takes larger ones.
    """
    zero: lanes = spread(0)
    acts: lanes = choose(either(above(before, zero), above(load(w.load, k), zero)), zero, after)
    new: mask = above(acts, zero)
    if any_lane(new):
        u: lanes2 = take(w.free, w.i, k)
        v: lanes2 = take(w.free, w.j, k)
        came: lanes = larger(-speed, (u.x - v.x) * nx + (u.y - v.y) * ny)
        store(w.met, k, larger(load(w.met, k), choose(new, came, zero)))


@inlined
def record_more(w: cython.pointer(Step), k: cython.Py_ssize_t, given: cython.double) -> cython.void:
    """Add to the impulse of surface contact k, which was touched in this substep."""
    if w.records_events and w.surface[k] < 0:
        w.pressed[pinned_lane(w, k)] += cython.cast(real, given)
    elif w.records_events:
        w.contact[row_of(k) + EVENT_IMPULSE] += given


@kernel
def record_held(w: cython.pointer(Step), i: cython.Py_ssize_t, vx: cython.double, vy: cython.double) -> cython.void:
    """Record the speed at which particle i, which came at (vx, vy), met surfaces that hold it and did not in this frame."""
    k: cython.Py_ssize_t
    row: cython.pointer(cython.double) = w.contact
    for k in range(w.contact_begin[i], w.contact_end[i]):
        at: cython.Py_ssize_t = row_of(k)
        if row[at + PUSH] > 0:
            speed: cython.double = (vx - row[at + SPEED]) * row[at + NORMAL] + (vy - row[at + SPEED_Y]) * row[at + NORMAL_Y]
            if w.surface[k] >= 0:
                if row[at + EVENT] == 0 and row[at + EVENT_SPEED] == 0:
                    row[at + EVENT_SPEED] = max(speed, 0.0)
            elif w.touched[pinned_lane(w, k)] == 0 and w.met[pinned_lane(w, k)] == 0:
                w.met[pinned_lane(w, k)] = cython.cast(real, max(speed, 0.0))


@kernel
def record_loads(w: cython.pointer(Step), s: cython.Py_ssize_t) -> cython.void:
    """Record pairs of group s that carry load or overlap as touching; impulses of resting contacts are scaled to h."""
    k: cython.Py_ssize_t
    none: real = 0
    impulse: cython.pointer(real) = w.impulse
    depth: cython.pointer(real) = w.depth
    met: cython.pointer(real) = w.met
    pressed: cython.pointer(real) = w.pressed
    rest_scale: real = w.rest_scale
    touched: cython.pointer(int32_t) = w.touched
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):  # branch-free, so that it is vectorised
        touched[k] |= (impulse[k] > none) | (depth[k] > none)
        met[k] = met[k] if touched[k] != 0 else none
        pressed[k] += rest_scale * impulse[k]


@kernel
def record_surface_loads(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Record surfaces that carry particle i, or touch it up to rounding; clear the speed of others."""
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        given: cython.double = w.contact[row_of(k) + PUSH]
        if w.surface[k] >= 0 and (given > 0 or w.contact[row_of(k) + GAP] <= ROUNDED * w.radius[i]):
            w.contact[row_of(k) + EVENT] = 1
            w.contact[row_of(k) + EVENT_IMPULSE] += w.rest_scale * given
        elif w.contact[row_of(k) + EVENT] == 0:
            w.contact[row_of(k) + EVENT_SPEED] = 0


@kernel
def count_events(w: cython.pointer(Step)) -> cython.Py_ssize_t:
    """Upper bound of the number of recorded contacts."""
    capacity: cython.Py_ssize_t = 0
    for s in range(w.groups):
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            capacity += w.touched[k] != 0
    for i in range(w.count if w.surfaces_good else 0):
        capacity += w.contact_end[i] - w.contact_begin[i]
    return capacity


@kernel
def collect_events(
    w: cython.pointer(Step), number: cython.pointer(int64_t), key: cython.pointer(int64_t), speed: cython.p_double,
    bounces: cython.pointer(int64_t), pushes: cython.p_double,
) -> cython.Py_ssize_t:  # fmt: skip
    """Write and clear the recorded contacts; returns their number. number: the user's particle numbers.

    Keys have the lower number in the upper half; in the lower half the other one + 1, or `SURFACE_BIT` and the surface. pushes:
    along the normal, over the reduced mass, or the particle's.
    """
    n: cython.Py_ssize_t = 0
    k: int64_t
    for s in range(w.groups):
        for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
            if w.touched[k] != 0:
                a: int64_t = number[w.lists.particle[w.i[k]]]
                b: int64_t = number[w.lists.particle[w.j[k]]]
                key[n], speed[n], bounces[n], pushes[n] = (min(a, b) << 32) + max(a, b) + 1, w.met[k], w.bounces[k], w.pressed[k]
                n += not repeats(w, s, k)
                w.touched[k], w.met[k], w.bounces[k], w.pressed[k] = 0, 0, 0, 0
    for i in range(w.count if w.surfaces_good else 0):
        for k in range(w.contact_begin[i], w.contact_end[i]):
            row: cython.pointer(cython.double) = w.contact
            at: cython.Py_ssize_t = row_of(k)
            if row[at + EVENT] > 0:
                key[n] = (number[w.lists.particle[i]] << 32) + SURFACE_BIT + w.surface[k]
                speed[n], bounces[n] = row[at + EVENT_SPEED], cython.cast(int64_t, row[at + EVENT_BOUNCES])
                pushes[n] = row[at + EVENT_IMPULSE]
                row[at + EVENT_SPEED] = row[at + EVENT_BOUNCES] = row[at + EVENT] = row[at + EVENT_IMPULSE] = 0
                n += 1
    return n
