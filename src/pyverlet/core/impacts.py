# mypy: ignore-errors
"""Impacts: pairs that approach faster than resting contacts bounce in closed form, at their time within the substep.

The path of a particle in a substep of length h is x(t) = x + u t - a t (h - t) / 2, with u its velocity in the middle of the
substep (Stormer and Verlet). At the time of impact its velocity is u + a (t - h / 2). An impulse there changes u by d, and the
position at the end by d (h - t): so it is stored as u + d and x - d t. Restitution is Newton's for single impacts, friction is
Coulomb's (Walton and Braun 1986); pairs that share a particle and meet at the same time are solved together, by Poisson's
hypothesis: the impulses that stop them, times 1 + e. Scalar code in double precision: impacts are rare.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.event_recording import least_of_pair, record_impact, record_pair
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.rebounds import IMPACT, REBOUND, node_of, store_rebound
from pyverlet.core.step import MOST_JOINT, Step
from pyverlet.core.work import add_impact_work

NEVER = cython.declare(cython.double, 1e300)
SAME_TIME = cython.declare(cython.double, 1e-3)  # fraction of h
MOST_PAIR_BOUNCES = cython.declare(cython.int, 16)
"""Most impacts of a particle with others per substep; dense crowds that move by several radii would never end. The rest follows
in the next substep."""

JOINT_SWEEPS = cython.declare(cython.int, 200)

PairMotion = cython.struct(
    i=cython.Py_ssize_t,
    j=cython.Py_ssize_t,
    part=cython.double,  # fraction of i in the inverse mass of the pair
    px=cython.double,  # from i to j at the start of the substep, m
    py=cython.double,
    ux=cython.double,  # velocity of j relative to i in the middle of the substep, m/s
    uy=cython.double,
    ax=cython.double,
    ay=cython.double,
)


@inlined
def pair_motion(w: cython.pointer(Step), k: cython.Py_ssize_t) -> PairMotion:
    """The relative motion of pair k."""
    m: PairMotion
    m.i, m.j = w.i[k], w.j[k]
    m.part = w.share[k * w.varied]
    m.px = w.gap_x[k] + (w.moved[2 * m.j] - w.moved[2 * m.i])
    m.py = w.gap_y[k] + (w.moved[2 * m.j + 1] - w.moved[2 * m.i + 1])
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    m.ux = v[width * m.j] - v[width * m.i]
    m.uy = v[width * m.j + 1] - v[width * m.i + 1]
    m.ax = w.acceleration[2 * m.j] - w.acceleration[2 * m.i]
    m.ay = w.acceleration[2 * m.j + 1] - w.acceleration[2 * m.i + 1]
    return m


@kernel
def time_of_impact(w: cython.pointer(Step), k: cython.Py_ssize_t, m: cython.pointer(PairMotion)) -> cython.double:
    """Time at which pair k begins to touch, s into the substep; NEVER if not in this substep.

    The path of a particle after an impact begins at its last one. Pairs that overlap touch at once.
    """
    h: cython.double = w.h
    reach: cython.double = w.reach[k * w.sized]
    begin: cython.double = max(w.since[m.i], w.since[m.j])
    bend: cython.double = 0.5 * begin * (h - begin)
    px: cython.double = m.px + m.ux * begin - m.ax * bend
    py: cython.double = m.py + m.uy * begin - m.ay * bend
    near: cython.double = px * px + py * py - reach * reach
    if near <= 0:
        return begin
    along: cython.double = px * m.ux + py * m.uy
    square: cython.double = m.ux * m.ux + m.uy * m.uy
    root: cython.double = along * along - square * near
    if along >= 0 or root <= 0:
        return NEVER
    t: cython.double = begin + near / (sqrt(root) - along)
    _: cython.int
    if m.ax != 0 or m.ay != 0:  # two Newton steps for the curvature of the path
        for _ in range(2):
            t = min(t, h)  # from far beyond the end of the substep they may lead anywhere
            half: cython.double = 0.5 * t * (h - t)
            x: cython.double = m.px + m.ux * t - m.ax * half
            y: cython.double = m.py + m.uy * t - m.ay * half
            slope: cython.double = 2 * (x * (m.ux + m.ax * (t - 0.5 * h)) + y * (m.uy + m.ay * (t - 0.5 * h)))
            if slope >= 0:
                return NEVER
            t -= (x * x + y * y - reach * reach) / slope
    return max(t, begin) if t < h else NEVER


@inlined
def move_path(
    w: cython.pointer(Step), i: cython.Py_ssize_t, dx: cython.double, dy: cython.double, t: cython.double
) -> cython.void:
    """After a change of velocity by (dx, dy) at time t: store the path as one with another start."""
    if w.since[i] == 0:
        w.begun[2 * i], w.begun[2 * i + 1] = w.position[2 * i], w.position[2 * i + 1]
    w.since[i] = max(w.since[i], t, 1e-300)
    w.position[2 * i] -= cython.cast(real, dx * t)
    w.position[2 * i + 1] -= cython.cast(real, dy * t)
    w.moved[2 * i] -= cython.cast(real, dx * t)
    w.moved[2 * i + 1] -= cython.cast(real, dy * t)


@kernel
def strike(
    w: cython.pointer(Step), i: cython.Py_ssize_t, dx: cython.double, dy: cython.double, turn: cython.double, t: cython.double
) -> cython.void:
    """Change the velocity of a particle by an impulse at time t; it is not warm-started."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    v[width * i] += cython.cast(real, dx)
    v[width * i + 1] += cython.cast(real, dy)
    w.free[2 * i] += cython.cast(real, dx)
    w.free[2 * i + 1] += cython.cast(real, dy)
    if w.rough:
        v[4 * i + 2] += cython.cast(real, turn)
        w.free_spin[i] += cython.cast(real, turn)
    move_path(w, i, dx, dy, t)
    if w.linked and node_of(w, i) >= 0:
        w.impact[IMPACT * i] += dx
        w.impact[IMPACT * i + 1] += dy
    if w.records_work:
        add_impact_work(w, i, dx, dy, turn, t)


@kernel
def strike_pair(
    w: cython.pointer(Step), k: cython.Py_ssize_t, m: cython.pointer(PairMotion), jx: cython.double, jy: cython.double,
    jt: cython.double, t: cython.double,
) -> cython.void:  # fmt: skip
    """Apply the impulse (jx, jy), over the reduced mass, to j and its opposite to i; its tangential part jt turns both."""
    at: cython.Py_ssize_t = k * w.mixed
    rest: cython.double = 1 - m.part
    if w.records_contacts:
        w.summed_x[k] += cython.cast(real, jx)
        w.summed_y[k] += cython.cast(real, jy)
    strike(w, m.i, -jx * m.part, -jy * m.part, jt * m.part * w.turn_i[at], t)
    strike(w, m.j, jx * rest, jy * rest, jt * rest * w.turn_j[at], t)


@kernel
def apply_friction(
    w: cython.pointer(Step), k: cython.Py_ssize_t, m: cython.pointer(PairMotion), nx: cython.double, ny: cython.double,
    pushed: cython.double, distance: cython.double, t: cython.double,
) -> cython.void:  # fmt: skip
    """Friction of an impact with normal impulse `pushed` along n. Lever arms add up to the distance: angular momentum is kept."""
    at: cython.Py_ssize_t = k * w.mixed
    mu: cython.double = w.friction[at]
    if not w.rough or mu == 0:
        return
    back: cython.double = t - 0.5 * cython.cast(cython.double, w.h)
    ux: cython.double = w.motion[4 * m.j] - w.motion[4 * m.i] + m.ax * back
    uy: cython.double = w.motion[4 * m.j + 1] - w.motion[4 * m.i + 1] + m.ay * back
    lever: cython.double = distance / w.reach[k * w.sized]
    turn: cython.double = w.motion[4 * m.i + 2] * w.radius_i[at] + w.motion[4 * m.j + 2] * w.radius_j[at]
    slip: cython.double = ux * ny - uy * nx + lever * turn
    most: cython.double = mu * pushed
    jt: cython.double = min(max(-slip * w.grip[at], -most), most)
    strike_pair(w, k, m, jt * ny, -jt * nx, jt * lever, t)


@kernel
def store_pair_rebound(
    w: cython.pointer(Step), k: cython.Py_ssize_t, x: cython.double, y: cython.double, given: cython.double, t: cython.double
) -> cython.void:
    """Record that pair k bounced with `given` along (x, y)."""
    i: cython.Py_ssize_t = w.i[k]
    j: cython.Py_ssize_t = w.j[k]
    e: cython.double = w.restitution[k * w.mixed]
    if w.linked and e > 0 and given > 0 and (node_of(w, i) >= 0 or node_of(w, j) >= 0):
        now: PairMotion = pair_motion(w, k)
        store_rebound(w, w.pair_rebound, REBOUND * k, x, y, now.ux * x + now.uy * y, given, e, t)


@kernel
def impact(w: cython.pointer(Step), k: cython.Py_ssize_t) -> cython.bint:
    """Resolve the impact of pair k, if it has one that is faster than resting contacts; returns whether it did."""
    m: PairMotion = pair_motion(w, k)
    t: cython.double = time_of_impact(w, k, cython.address(m))
    if t == NEVER:
        return False
    half: cython.double = 0.5 * t * (w.h - t)
    back: cython.double = t - 0.5 * cython.cast(cython.double, w.h)
    x: cython.double = m.px + m.ux * t - m.ax * half
    y: cython.double = m.py + m.uy * t - m.ay * half
    distance: cython.double = sqrt(x * x + y * y)
    if distance == 0:
        return False
    x /= distance
    y /= distance
    speed: cython.double = (m.ux + m.ax * back) * x + (m.uy + m.ay * back) * y
    if speed >= -least_of_pair(w, k):
        return False
    e: cython.double = w.restitution[k * w.mixed]
    push: cython.double = -(1 + e) * speed
    strike_pair(w, k, cython.address(m), push * x, push * y, 0, t)
    apply_friction(w, k, cython.address(m), x, y, push, distance, t)
    store_pair_rebound(w, k, x, y, push, t)
    record_pair(w, k, -speed, -e * speed)
    if w.records_contacts:
        w.summed_virial[k] += cython.cast(real, push * distance)
    w.thrown[m.i] += 1
    w.thrown[m.j] += 1
    return True


@kernel
def joint_impact(w: cython.pointer(Step), hits: cython.pointer(int64_t), count: cython.int, t: cython.double) -> cython.void:
    """Pairs that share particles and meet at the same time: the impulses that stop them all, times 1 + e."""
    m: PairMotion[16]
    nx: cython.double[16]
    ny: cython.double[16]
    given: cython.double[16]
    came: cython.double[16]  # largest approach speeds when they begin to push each other
    apart: cython.double[16]
    back: cython.double = t - 0.5 * cython.cast(cython.double, w.h)
    half: cython.double = 0.5 * t * (w.h - t)
    for g in range(count):
        m[g] = pair_motion(w, hits[g])
        x: cython.double = m[g].px + m[g].ux * t - m[g].ax * half
        y: cython.double = m[g].py + m[g].uy * t - m[g].ay * half
        distance: cython.double = sqrt(x * x + y * y)
        inverse: cython.double = 1 / distance if distance > 0 else 0.0  # coincident pairs have no normal
        nx[g], ny[g], given[g], apart[g] = x * inverse, y * inverse, 0, distance
        came[g] = max(-(m[g].ux + m[g].ax * back) * nx[g] - (m[g].uy + m[g].ay * back) * ny[g], 0.0)
    for _ in range(JOINT_SWEEPS):
        largest: cython.double = 0
        for g in range(count):
            now: PairMotion = pair_motion(w, hits[g])
            speed: cython.double = (now.ux + now.ax * back) * nx[g] + (now.uy + now.ay * back) * ny[g]
            after: cython.double = max(given[g] - speed, 0.0)
            change: cython.double = after - given[g]
            if given[g] == 0:
                came[g] = max(came[g], -speed)
            strike_pair(w, hits[g], cython.address(now), change * nx[g], change * ny[g], 0, t)
            given[g] = after
            largest = max(largest, fabs(change) / max(after, 1e-30) if after > 0 else 0.0)
        if largest < (1e-14 if cython.sizeof(real) == 8 else 1e-7):
            break
    for g in range(count):
        more: cython.double = w.restitution[hits[g] * w.mixed] * given[g]
        strike_pair(w, hits[g], cython.address(m[g]), more * nx[g], more * ny[g], 0, t)
    for g in range(count):
        e: cython.double = w.restitution[hits[g] * w.mixed]
        apply_friction(w, hits[g], cython.address(m[g]), nx[g], ny[g], (1 + e) * given[g], apart[g], t)
        w.thrown[m[g].i] += 1
        w.thrown[m[g].j] += 1
        store_pair_rebound(w, hits[g], nx[g], ny[g], (1 + e) * given[g], t)
        if w.records_contacts:
            w.summed_virial[hits[g]] += cython.cast(real, (1 + e) * given[g] * apart[g])
        if given[g] > 0:
            record_impact(w, hits[g], came[g], (1 + e) * given[g], e * given[g])


@kernel
def shares_particle(
    w: cython.pointer(Step), k: cython.Py_ssize_t, hits: cython.pointer(int64_t), count: cython.int
) -> cython.bint:
    """Whether pair k shares a particle with one of these, and is none of them."""
    found: cython.bint = False
    for g in range(count):
        other: cython.Py_ssize_t = hits[g]
        if w.i[other] == w.i[k] and w.j[other] == w.j[k]:
            return False
        found |= w.i[other] == w.i[k] or w.i[other] == w.j[k] or w.j[other] == w.i[k] or w.j[other] == w.j[k]
    return found


@kernel
def resolve_impacts(w: cython.pointer(Step), first: cython.Py_ssize_t, count: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Resolve the pairs in w.hit from `first` on, in the order of their times; 0 if none bounced, else how many remain in it."""
    h: cython.double = w.h
    a: cython.Py_ssize_t
    b: cython.Py_ssize_t
    kept: cython.Py_ssize_t = first
    for a in range(first, first + count):
        k: cython.Py_ssize_t = w.hit[a]
        m: PairMotion = pair_motion(w, k)
        if max(w.thrown[m.i], w.thrown[m.j]) >= MOST_PAIR_BOUNCES:
            continue
        t: cython.double = time_of_impact(w, k, cython.address(m))
        if t == NEVER:
            continue
        b = kept
        while b > first and w.hit_time[b - 1] > t:
            w.hit[b], w.hit_time[b] = w.hit[b - 1], w.hit_time[b - 1]
            b -= 1
        w.hit[b], w.hit_time[b] = k, t
        kept += 1
    bounced: cython.bint = False
    group: int64_t[16]
    a = first
    while a < kept:
        if w.hit[a] >= 0:
            group[0] = w.hit[a]
            size: cython.int = 1
            again: cython.bint = True
            while again and size < MOST_JOINT:
                again = False
                b = a + 1
                while b < kept and w.hit_time[b] - w.hit_time[a] <= SAME_TIME * h and size < MOST_JOINT:
                    if w.hit[b] >= 0 and shares_particle(w, w.hit[b], group, size):
                        group[size] = w.hit[b]
                        w.hit[b] = -1 - w.hit[b]
                        size += 1
                        again = True
                    b += 1
            if size == 1:
                bounced |= impact(w, group[0])
            else:
                joint_impact(w, group, size, w.hit_time[a])
                bounced = True
        a += 1
    return kept - first if bounced else 0
