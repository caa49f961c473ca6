# mypy: ignore-errors
"""Passes over particles in a substep, block by block: kick, drift, and the sums of contact impulses."""

from __future__ import annotations

import cython
from cython.cimports.lanes import (
    above,
    any_lane,
    lanes,
    lanes2,
    lanes4,
    larger,
    largest_lane,
    load,
    load2,
    load4,
    magnitude,
    outside,
    real,
    smaller,
    spread,
    store,
    store2,
    store4,
    sum_of_pairs,
)

from pyverlet.core.cells import BLOCK
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.step import Step


@inlined
def update_moved(w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t) -> cython.void:
    """Compute displacements since particles were listed."""
    moved: cython.pointer(real) = w.moved
    position: cython.pointer(real) = w.position
    listed: cython.pointer(real) = w.listed
    for i in range(2 * a, 2 * b):
        moved[i] = position[i] - listed[i]


@kernel
def kick(shared: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t, part: cython.int) -> cython.void:
    """Kick particles by forces; in the first substep, subtract the part of the last contact impulses that velocities contain."""
    own: Step = shared[0]
    w: cython.pointer(Step) = cython.address(own)
    begins: cython.bint = w.substep == w.first
    kicked: real = w.opening if begins else w.h
    back: real = w.already_given if begins else cython.cast(real, 0)
    most: real = 0
    fastest: lanes = spread(0)
    whole: cython.Py_ssize_t
    i: cython.Py_ssize_t
    if w.rough:
        whole = b - b % 8
        for i in range(a, whole, 8):
            m: lanes4 = load4(w.motion, i)
            force: lanes2 = load2(w.acceleration, i)
            given: lanes2 = load2(w.given, i)
            vx: lanes = m.x + force.x * spread(kicked) - given.x * spread(back)
            vy: lanes = m.y + force.y * spread(kicked) - given.y * spread(back)
            spin: lanes = m.z - load(w.given_spin, i) * spread(back)
            store4(w.motion, i, vx, vy, spin, m.w)
            store2(w.free, i, vx, vy)
            store(w.free_spin, i, spin)
            fastest = larger(vx * vx + vy * vy, fastest)
        most = largest_lane(fastest)
        for i in range(whole, b):
            x: real = w.motion[4 * i] + w.acceleration[2 * i] * kicked - w.given[2 * i] * back
            y: real = w.motion[4 * i + 1] + w.acceleration[2 * i + 1] * kicked - w.given[2 * i + 1] * back
            s: real = w.motion[4 * i + 2] - w.given_spin[i] * back
            w.motion[4 * i], w.motion[4 * i + 1], w.motion[4 * i + 2] = x, y, s
            w.free[2 * i], w.free[2 * i + 1], w.free_spin[i] = x, y, s
            square: real = x * x + y * y
            most = square if square > most else most
    else:
        whole = 2 * b - 2 * b % 8
        for i in range(2 * a, whole, 8):
            u: lanes = load(w.velocity, i) + load(w.acceleration, i) * spread(kicked) - load(w.given, i) * spread(back)
            store(w.velocity, i, u)
            store(w.free, i, u)
            fastest = larger(sum_of_pairs(u * u), fastest)
        most = largest_lane(fastest)
        for i in range(whole // 2, b):
            x = w.velocity[2 * i] + w.acceleration[2 * i] * kicked - w.given[2 * i] * back
            y = w.velocity[2 * i + 1] + w.acceleration[2 * i + 1] * kicked - w.given[2 * i + 1] * back
            w.velocity[2 * i], w.velocity[2 * i + 1], w.free[2 * i], w.free[2 * i + 1] = x, y, x, y
            square = x * x + y * y
            most = square if square > most else most
    update_moved(w, a, b)
    since: cython.pointer(cython.double) = w.since
    for i in range(a, b):
        since[i] = 0
        w.thrown[i] = 0
    w.fastest[part] = most


@kernel
def drift(w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t, part: cython.int) -> cython.void:
    """Drift: x += v h; also find out whether the pair list may be invalid in the next substep."""
    own: Step = w[0]
    o: cython.pointer(Step) = cython.address(own)
    h: real = o.h
    stale: cython.bint = False
    whole: cython.Py_ssize_t = b - b % (8 if o.rough else 4)
    i: cython.Py_ssize_t
    if o.rough:
        for i in range(a, whole, 8):
            m: lanes4 = load4(o.motion, i)
            p: lanes2 = load2(o.position, i)
            q: lanes2 = load2(o.checked, i)
            far_x: lanes = m.x * spread(h)
            far_y: lanes = m.y * spread(h)
            px: lanes = p.x + far_x
            py: lanes = p.y + far_y
            store2(o.position, i, px, py)
            far_x = far_x + (px - q.x)
            far_y = far_y + (py - q.y)
            stale |= any_lane(outside(above(spread(o.allowed), far_x * far_x + far_y * far_y)))
    else:
        for i in range(2 * a, 2 * whole, 8):
            step: lanes = load(o.velocity, i) * spread(h)
            there: lanes = load(o.position, i) + step
            store(o.position, i, there)
            away: lanes = there + step - load(o.checked, i)
            stale |= any_lane(outside(above(spread(o.allowed), sum_of_pairs(away * away))))
    v: cython.pointer(real) = o.motion if o.rough else o.velocity
    width: cython.Py_ssize_t = 4 if o.rough else 2
    for i in range(whole, b):
        dx: real = v[width * i] * h
        dy: real = v[width * i + 1] * h
        x: real = o.position[2 * i] + dx
        y: real = o.position[2 * i + 1] + dy
        o.position[2 * i], o.position[2 * i + 1] = x, y
        dx += x - o.checked[2 * i]
        dy += y - o.checked[2 * i + 1]
        stale |= not (dx * dx + dy * dy < o.allowed)
    w.stale[part] = stale


@kernel
def remember(w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t) -> cython.void:
    """Store the sum of contact impulses of this substep; velocities at the end of a frame get half of it.

    Jumps of the spin are limited to twice the previous value.
    """
    i: cython.Py_ssize_t
    if w.rough:
        whole: cython.Py_ssize_t = b - b % 8
        for i in range(a, whole, 8):
            m: lanes4 = load4(w.motion, i)
            u: lanes2 = load2(w.free, i)
            last: lanes = magnitude(load(w.given_spin, i))
            limit: lanes = last + last + spread(w.rest_speed) / load(w.radius, i)
            store2(w.given, i, m.x - u.x, m.y - u.y)
            store(w.given_spin, i, larger(-limit, smaller(limit, m.z - load(w.free_spin, i))))
        for i in range(whole, b):
            turned: real = w.motion[4 * i + 2] - w.free_spin[i]
            before: real = w.given_spin[i] if w.given_spin[i] > 0 else -w.given_spin[i]
            most: real = before + before + w.rest_speed / w.radius[i]
            w.given[2 * i], w.given[2 * i + 1] = w.motion[4 * i] - w.free[2 * i], w.motion[4 * i + 1] - w.free[2 * i + 1]
            w.given_spin[i] = max(min(turned, most), -most)
    else:
        given: cython.pointer(real) = w.given
        velocity: cython.pointer(real) = w.velocity
        free: cython.pointer(real) = w.free
        for i in range(2 * a, 2 * b):
            given[i] = velocity[i] - free[i]


@kernel
def kick_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Kick a block of particles."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    block: cython.int = w.awake[item]
    kick(w, block * BLOCK, min((block + 1) * BLOCK, w.count), block)


@kernel
def moves_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Compute displacements of a block of particles."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    block: cython.int = w.awake[item]
    update_moved(w, block * BLOCK, min((block + 1) * BLOCK, w.count))


@kernel
def remember_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Store the sums of contact impulses of a block of particles."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    block: cython.int = w.awake[item]
    remember(w, block * BLOCK, min((block + 1) * BLOCK, w.count))
