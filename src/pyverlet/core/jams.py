# mypy: ignore-errors
"""A jam whose blow is over forgets its impulses: given again, they would throw it apart, and a few sweeps do not take that back.

Let v be the velocities before contacts, A J what the remembered impulses J change of them, and T(s) = m |v + s A J|^2 / 2 the
energy with a part s of these. Where b = m v . A J > 0, which is T'(0), any part of them adds energy, and what takes up a load
begins better from nothing. By contacts, b is the sum of M J u, with the relative velocity u along the impulse and the reduced
mass M. So those that push are told from those of a heap that rests next to the jam: they keep what they carry.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import (
    any_above,
    gather,
    lanes,
    lanes2,
    larger,
    load,
    real,
    smaller,
    spread,
    store,
    sum_of_lanes,
    take,
    where_zero,
)
from cython.cimports.team import team_stage

from pyverlet.core.cells import BLOCK
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pairs_in_lanes import Motion, apply_impulses, motion_of, slip_of
from pyverlet.core.relisting import each_group
from pyverlet.core.step import Step
from pyverlet.core.work import moment

NEIGHBOURS = cython.declare(cython.Py_ssize_t, 512)
"""Lanes of a group that are looked at together."""

ERRORS = cython.declare(real, 1e-3)
"""Of M J^2: contacts that add less than that push no more than errors of the sweeps let them."""

SWINGS = cython.declare(real, 0.25)
SWING_TIME = cython.declare(real, 1.0 / 240.0)
"""Times the masses of both and the square of a speed: the springs of a column that swings under a heavy top, and of a cage that
comes to rest, add less. That speed is that of contacts at rest in substeps of this length, s, or of now if these are longer."""

CRUSHED = cython.declare(real, 0.2)
"""Of the smaller radius: what overlaps by more is pushed out, and that takes energy."""

SLOWEST = cython.declare(real, 0.003)
"""Of the speed of contacts at rest: pairs that move against each other no faster are none of the jam."""

Push = cython.struct(gain=cython.double, least=cython.double, out=cython.double)
"""Of some contacts, J: their part of b, less what pushing out takes; from which on they push; the latter."""


@kernel
def gain_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """The part of a block in b; `gain` has what of it is the work of surfaces that move."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    if w.still[block]:
        return
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    total: cython.double = 0
    for i in range(block * BLOCK, min((block + 1) * BLOCK, w.count)):
        if w.inverse_mass[i] > 0:
            x: cython.double = w.free[2 * i]
            y: cython.double = w.free[2 * i + 1]
            gain: cython.double = x * (v[width * i] - x) + y * (v[width * i + 1] - y)
            if w.rough:
                spin: cython.double = w.free_spin[i]
                gain += moment(w, i) * w.radius[i] * w.radius[i] * spin * (w.motion[4 * i + 2] - spin)
            total += gain / w.inverse_mass[i]
    w.gain[block] += total


@inlined
def free_motion_of(w: cython.pointer(Step), k: cython.Py_ssize_t, rough: cython.bint) -> Motion:
    """Of the pairs from k on, before contacts."""
    m: Motion
    u: lanes2 = take(w.free, w.i, k)
    v: lanes2 = take(w.free, w.j, k)
    m.ux, m.uy, m.us, m.vx, m.vy, m.vs = u.x, u.y, spread(0), v.x, v.y, spread(0)
    if rough:
        m.us, m.vs = gather(w.free_spin, w.i, k), gather(w.free_spin, w.j, k)
    return m


@inlined
def push_of(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t, rough: cython.bint) -> Push:
    """Of the pairs from `first` to `end`."""
    zero: lanes = spread(0)
    gain: lanes = zero
    least: lanes = zero
    pushed: lanes = zero
    speed: real = w.rest_speed * max(cython.cast(real, 1), SWING_TIME / w.h)
    k: cython.Py_ssize_t
    for k in range(first, end, 8):
        impulse: lanes = load(w.impulse, k)
        if not any_above(impulse, zero):
            continue
        at: cython.Py_ssize_t = k * w.mixed
        nx: lanes = load(w.normal_x, k)
        ny: lanes = load(w.normal_y, k)
        m: Motion = free_motion_of(w, k, rough)
        w_i: lanes = gather(w.inverse_mass, w.i, k)
        w_j: lanes = gather(w.inverse_mass, w.j, k)
        mass: lanes = spread(1) / (w_i + w_j)
        deep: lanes = load(w.depth, k) - spread(CRUSHED) * smaller(load(w.radius_i, at), load(w.radius_j, at))
        out: lanes = impulse * smaller(spread(w.rate) * larger(deep, zero), spread(w.push))
        work: lanes = impulse * ((m.vx - m.ux) * nx + (m.vy - m.uy) * ny) - out
        if rough:
            work = work + load(w.tangent_impulse, k) * slip_of(w, k, m, nx, ny)
        gain = gain + mass * work
        pushed = pushed + mass * out
        swing: lanes = spread(SWINGS * speed * speed) * (spread(1) / w_i + spread(1) / w_j)
        least = least + spread(ERRORS) * mass * impulse * impulse + where_zero(impulse, zero, swing)
    push: Push
    push.gain, push.least, push.out = sum_of_lanes(gain), sum_of_lanes(least), sum_of_lanes(pushed)
    return push


@kernel
def search_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Which contacts of a group push; noted in `hit`, which is free until pairs are looked at that meet fast."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = 2 * item + w.parity
    last: cython.Py_ssize_t = w.begin[s] + w.swept[s]
    first: cython.Py_ssize_t = w.begin[s]
    w.least_gain[s] = 0
    w.jammed[s] = False
    while first < last:
        end: cython.Py_ssize_t = min(first + NEIGHBOURS, last)
        push: Push = push_of(w, first, end, True) if w.rough else push_of(w, first, end, False)
        w.hit[first] = push.gain > push.least
        if w.hit[first]:
            w.jammed[s] = True
            w.least_gain[s] += push.least
        w.least_gain[s] += push.out
        first = end


@inlined
def forget(w: cython.pointer(Step), first: cython.Py_ssize_t, end: cython.Py_ssize_t, rough: cython.bint) -> cython.void:
    """Of the pairs from `first` to `end`, those that move against each other take back what they have given again."""
    zero: lanes = spread(0)
    k: cython.Py_ssize_t
    for k in range(first, end, 8):
        before: lanes = load(w.impulse, k)
        if any_above(before, zero):
            nx: lanes = load(w.normal_x, k)
            ny: lanes = load(w.normal_y, k)
            m: Motion = free_motion_of(w, k, rough)
            still: mask = above(spread(SLOWEST * w.rest_speed), magnitude((m.vx - m.ux) * nx + (m.vy - m.uy) * ny))
            after: lanes = choose(still, before, zero)
            store(w.impulse, k, after)
            tangent: lanes = zero
            roll: lanes = zero
            if rough:
                tangent = load(w.tangent_impulse, k)
                store(w.tangent_impulse, k, choose(still, tangent, zero))
                tangent = choose(still, zero, -tangent)
                if w.rolls:
                    roll = load(w.roll_impulse, k)
                    store(w.roll_impulse, k, choose(still, roll, zero))
                    roll = choose(still, zero, -roll)
            apply_impulses(w, k, rough, motion_of(w, k, rough), nx, ny, after - before, tangent, roll)


@kernel
def forget_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Contacts of a group that push begin from nothing."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = 2 * item + w.parity
    last: cython.Py_ssize_t = w.begin[s] + w.swept[s]
    first: cython.Py_ssize_t = w.begin[s]
    while first < last:
        end: cython.Py_ssize_t = min(first + NEIGHBOURS, last)
        if w.hit[first] and w.rough:
            forget(w, first, end, True)
        elif w.hit[first]:
            forget(w, first, end, False)
        first = end


@kernel
def release_jams(w: cython.pointer(Step), blocks: cython.int) -> cython.void:
    """Where contacts and surfaces together add energy by what they give again, those that push forget it."""
    gain: cython.double = 0
    pushes: cython.bint = False
    n: cython.Py_ssize_t
    team_stage(w.team, gain_stage, w, blocks)
    for n in range(blocks):
        gain += w.gain[n]
    if gain <= 0:
        return
    each_group(w, search_stage)
    for n in range(w.groups):
        gain -= w.least_gain[n]
        pushes |= w.jammed[n]
    if pushes and gain > 0:
        each_group(w, forget_stage)
