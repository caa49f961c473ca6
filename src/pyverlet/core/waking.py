# mypy: ignore-errors
"""Finds sleepers to wake: those that would be touched in the coming substep.

Sleepers count as pinned: a particle would bounce off one as off a wall. So they wake before, if an awake particle can reach them
at its current velocity, or at twice the speed of the fastest in a row of particles that may hit each other within the substep.
"""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_integers, doubles, octets
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.cells import BLOCK
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.step import Step

MOST_HITS = cython.declare(cython.int, 100)
"""Most hits in a row."""

THROWN = cython.declare(cython.double, 2.0)
"""Largest speed of a light circle after a hit, over that of what hits it."""

NEARER = cython.declare(cython.double, 0.005)
"""Over the contact distance: particles that stay farther away do not touch a sleeper. Less than islands are separated by."""


@inlined
def way_in_lane(w: cython.pointer(Step), k: int64_t, axis: cython.int) -> cython.double:
    """From one circle of lane k to the other along an axis, m."""
    i: int64_t = w.i[k]
    j: int64_t = w.j[k]
    begun: cython.double = w.gap_x[k] if axis == 0 else w.gap_y[k]
    moved: real = (w.position[2 * j + axis] - w.listed[2 * j + axis]) - (w.position[2 * i + axis] - w.listed[2 * i + axis])
    return begun + moved


@inlined
def speed_along(w: cython.pointer(Step), i: int64_t, axis: cython.int) -> cython.double:
    """Velocity along an axis between two substeps, m/s."""
    return w.motion[4 * i + axis] if w.rough else w.velocity[2 * i + axis]


@kernel
def spread_speeds(w: cython.pointer(Step)) -> cython.void:
    """Raise the speed of particles that may be hit within the substep to that of what hits them."""
    speed: cython.p_double = w.speed
    hits: cython.int = 0
    again: cython.bint = True
    while again and hits < MOST_HITS:
        again = False
        hits += 1
        for s in range(w.groups):
            for k in range(w.begin[s], w.begin[s] + w.swept[s]):
                a: cython.double = speed[w.i[k]]
                b: cython.double = speed[w.j[k]]
                x: cython.double = way_in_lane(w, k, 0)
                y: cython.double = way_in_lane(w, k, 1)
                reach: cython.double = w.radius[w.i[k]]
                reach += w.radius[w.j[k]] + (a + b) * w.h + w.nearer
                if a != b and x * x + y * y < reach * reach:
                    speed[w.i[k]] = speed[w.j[k]] = max(a, b)
                    again = True


@kernel
def comes_to(w: cython.pointer(Step), k: int64_t, awake: int64_t, sign: cython.double) -> cython.bint:
    """Whether `awake` may reach the other circle of lane k in this substep; sign: 1 or -1, the direction of the lane."""
    x: cython.double = sign * way_in_lane(w, k, 0)
    y: cython.double = sign * way_in_lane(w, k, 1)
    u: cython.double = speed_along(w, awake, 0)
    v: cython.double = speed_along(w, awake, 1)
    speed: cython.double = w.speed[awake]
    reach: cython.double = w.radius[w.i[k]]
    reach += w.radius[w.j[k]]
    reach += min(w.nearer, NEARER * reach)
    square: cython.double = u * u + v * v
    if speed * speed > square * 1.000001:  # others may hit it first
        far: cython.double = reach + THROWN * speed * w.h
        if x * x + y * y < far * far:
            return True
    time: cython.double = 0
    if square > 0:
        time = min(max((x * u + y * v) / square, 0.0), cython.cast(cython.double, w.h))
    x -= u * time
    y -= v * time
    return x * x + y * y < reach * reach


@kernel
def awake_of(w: cython.pointer(Step), k: int64_t) -> int64_t:
    """The awake free circle of lane k, if the other one sleeps; else -1."""
    i: int64_t = w.i[k]
    j: int64_t = w.j[k]
    if w.island[i] >= 0:
        return j if w.inverse_mass[j] > 0 else -1
    return i if w.island[j] >= 0 and w.inverse_mass[i] > 0 else -1


@kernel
def anyone_near(w: cython.pointer(Step)) -> cython.bint:
    """Compute the speeds of awake particles; returns whether the fastest could reach a sleeper."""
    fastest: cython.double = 0
    x: cython.double
    y: cython.double
    for b in range((w.count + BLOCK - 1) // BLOCK):
        if w.still_known and w.still[b]:
            continue
        for i in range(b * BLOCK, min((b + 1) * BLOCK, w.count)):
            if w.island[i] < 0:
                x, y = speed_along(w, i, 0), speed_along(w, i, 1)
                w.speed[i] = sqrt(x * x + y * y)
                fastest = max(fastest, w.speed[i])
    for s in range(w.groups):
        for k in range(w.begin[s] + w.swept[s], w.begin[s] + w.lanes[s]):
            if awake_of(w, k) >= 0:
                x = way_in_lane(w, k, 0)
                y = way_in_lane(w, k, 1)
                reach: cython.double = w.radius[w.i[k]]
                reach += w.radius[w.j[k]] + w.nearer + THROWN * fastest * w.h
                if x * x + y * y < reach * reach:
                    return True
    return False


@kernel
def find_met(w: cython.pointer(Step)) -> cython.bint:
    """Mark sleepers that are touched in the coming substep in `met_asleep`; returns whether there are any. Needs valid lists."""
    found: cython.bint = False
    if not (w.pins and anyone_near(w)):
        return False
    spread_speeds(w)
    for s in range(w.groups):
        for k in range(w.begin[s] + w.swept[s], w.begin[s] + w.lanes[s]):
            i: int64_t = awake_of(w, k)
            if i >= 0 and comes_to(w, k, i, 1.0 if i == w.i[k] else -1.0):
                w.met_asleep[w.j[k] if i == w.i[k] else w.i[k]] = 1
                found = True
    return found


@cython.cfunc
def watch(w: cython.pointer(Step), a, island, nearer: cython.double):
    """Have calls under gravity alone end before an awake particle touches a sleeper.

    island: (count,) -1 if awake, None: do not. nearer: m, by which accelerations may bring circles closer in a substep.
    """
    w.watches = island is not None
    if w.watches:
        a["island"] = island
        if "speed" not in a or len(a["speed"]) != w.count:
            a["speed"], a["met_asleep"] = np.empty(w.count), np.zeros(w.count, np.uint8)
        w.island, w.nearer = const_integers(island), nearer
        w.speed, w.met_asleep = doubles(a["speed"]), octets(a["met_asleep"])


@cython.cfunc
def take_met(w: cython.pointer(Step), a):
    """(count,) uint8, 1 for sleepers that are touched in the coming substep; or None."""
    if not find_met(w):
        return None
    met, a["met_asleep"] = a["met_asleep"], np.zeros(w.count, np.uint8)
    w.met_asleep = octets(a["met_asleep"])
    return met
