# mypy: ignore-errors
"""A frame: its substeps, stage by stage, as every thread of the team goes through them.

Per substep of length h:
 1. kick: velocities gain the acceleration; walls give what they gave in the last substep.
 2. warm start: so do contacts, along the normals of now.
 3. walls: what comes fast bounces, the rest is held.
 4. contacts: one sweep over the pairs, with springs; pairs that meet fast bounce, in closed form. Links, block by block.
 5. drift: walls once more, then x += v h.
 6. relax: sweeps without the springs.
 7. remember what contacts gave.

Velocities within a frame are those of the middle of a substep (Stormer and Verlet). With v, a and c the velocity, the
acceleration by forces and that by contacts at the start of a frame, its first substep begins from v + a h / 2 - c h' / 2, h'
being the substep before, and contacts give c (h + h') / 2; at the end v + (a + c) h / 2 is the velocity of the positions of now.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import above, any_lane, lanes, larger, largest_lane, load, outside, real, spread, store, sum_of_pairs
from cython.cimports.libc.math import sqrt
from cython.cimports.team import team_barrier

from pyverlet.core.contacts import relax_contacts, solve_contacts
from pyverlet.core.links import begin_links, end_links, solve_links
from pyverlet.core.step import Step
from pyverlet.core.walls import bounce_walls, hold_walls, list_walls, relax_walls, warm_walls
from pyverlet.core.warm_start import warm_start


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def kick(shared: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t, part: cython.int) -> cython.void:
    """Forces; what contacts gave in the last substep of the frame before comes back as `given` says."""
    own: Step = shared[0]
    w: cython.pointer(Step) = cython.address(own)
    begins: cython.bint = w.substep == w.first
    kicked: real = w.opening if begins else w.h
    back: real = w.taken_back if begins else cython.cast(real, 0)
    most: real = 0
    i: cython.Py_ssize_t
    if w.rough:
        for i in range(a, b):
            x: real = w.motion[4 * i] + w.acceleration[2 * i] * kicked - w.given[2 * i] * back
            y: real = w.motion[4 * i + 1] + w.acceleration[2 * i + 1] * kicked - w.given[2 * i + 1] * back
            s: real = w.motion[4 * i + 2] - w.given_spin[i] * back
            w.motion[4 * i], w.motion[4 * i + 1], w.motion[4 * i + 2] = x, y, s
            w.free[2 * i], w.free[2 * i + 1], w.free_spin[i] = x, y, s
            square: real = x * x + y * y
            most = square if square > most else most
    else:
        fastest: lanes = spread(0)
        whole: cython.Py_ssize_t = 2 * b - 2 * b % 8
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
    moved: cython.pointer(real) = w.moved
    position: cython.pointer(real) = w.position
    listed: cython.pointer(real) = w.listed
    for i in range(2 * a, 2 * b):
        moved[i] = position[i] - listed[i]
    w.fastest[part] = most


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def drift(w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t, part: cython.int) -> cython.void:
    """x += v h; whether a particle may leave where the list of pairs is good in the next substep."""
    own: Step = w[0]
    o: cython.pointer(Step) = cython.address(own)
    h: real = o.h
    i: cython.Py_ssize_t
    stale: cython.bint = False
    whole: cython.Py_ssize_t = a if o.rough else b - b % 4
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


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def remember(w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t) -> cython.void:
    """What the contacts of this substep gave."""
    i: cython.Py_ssize_t
    if w.rough:
        for i in range(a, b):
            w.given[2 * i] = w.motion[4 * i] - w.free[2 * i]
            w.given[2 * i + 1] = w.motion[4 * i + 1] - w.free[2 * i + 1]
            w.given_spin[i] = w.motion[4 * i + 2] - w.free_spin[i]
    else:
        given: cython.pointer(real) = w.given
        velocity: cython.pointer(real) = w.velocity
        free: cython.pointer(real) = w.free
        for i in range(2 * a, 2 * b):
            given[i] = velocity[i] - free[i]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def substep(
    w: cython.pointer(Step), part: cython.int, parts: cython.int, a: cython.Py_ssize_t, b: cython.Py_ssize_t
) -> cython.void:
    """One substep: the part of one thread."""
    parity: cython.Py_ssize_t
    half: cython.Py_ssize_t
    _: cython.int
    p: cython.int
    i: cython.Py_ssize_t
    kick(w, a, b, part)
    team_barrier(w.team)
    if part == 0:
        fastest: real = 0
        for p in range(parts):
            fastest = max(fastest, w.fastest[p])
        w.far = 2 * w.h * cython.cast(real, sqrt(fastest)) + w.near
    team_barrier(w.team)
    walled: cython.Py_ssize_t = list_walls(w, a, b)
    for i in range(a, a + walled):
        warm_walls(w, w.at_wall[i])
    team_barrier(w.team)
    for parity in range(2):
        for half in range(w.cut[parity * (parts + 1) + part], w.cut[parity * (parts + 1) + part + 1]):
            warm_start(w, 2 * half + parity)
        team_barrier(w.team)
    if w.link_rows:
        begin_links(w, part)
        team_barrier(w.team)
    for i in range(a, a + walled):
        bounce_walls(w, w.at_wall[i])
        hold_walls(w, w.at_wall[i])
    team_barrier(w.team)
    for parity in range(2):
        for half in range(w.cut[parity * (parts + 1) + part], w.cut[parity * (parts + 1) + part + 1]):
            solve_contacts(w, 2 * half + parity)
        team_barrier(w.team)
    if w.link_rows:
        solve_links(w, part, True)
        team_barrier(w.team)
    for i in range(a, a + walled):
        hold_walls(w, w.at_wall[i])
    drift(w, a, b, part)
    for _ in range(w.relaxes):
        for i in range(a, a + walled):
            relax_walls(w, w.at_wall[i])
        team_barrier(w.team)
        for parity in range(2):
            for half in range(w.cut[parity * (parts + 1) + part], w.cut[parity * (parts + 1) + part + 1]):
                relax_contacts(w, 2 * half + parity)
            team_barrier(w.team)
        if w.link_rows:
            solve_links(w, part, False)
            team_barrier(w.team)
    if w.link_rows:
        end_links(w, part)
    remember(w, a, b)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def run_substeps(what: cython.p_void, part: cython.int, parts: cython.int) -> cython.void:
    """Substeps of a frame until all are done or the list of pairs needs a look: the part of one thread of the team."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    blocks: cython.Py_ssize_t = (w.count + 63) // 64
    a: cython.Py_ssize_t = 64 * (blocks * part // parts)
    b: cython.Py_ssize_t = min(64 * (blocks * (part + 1) // parts), w.count)
    p: cython.int
    stale: cython.bint = False
    while w.substep < w.substeps and not stale:
        substep(w, part, parts, a, b)
        for p in range(parts):
            stale |= w.stale[p] != 0
        team_barrier(w.team)
        if part == 0:
            w.substep += 1
        team_barrier(w.team)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def strays(w: cython.pointer(Step)) -> cython.bint:
    """Whether a particle may leave where the list of pairs is good in the first substep."""
    i: cython.Py_ssize_t
    found: cython.bint = False
    for i in range(w.count):
        dx: real = w.position[2 * i] + w.h * w.velocity[2 * i] - w.checked[2 * i]
        dy: real = w.position[2 * i + 1] + w.h * w.velocity[2 * i + 1] - w.checked[2 * i + 1]
        found |= not (dx * dx + dy * dy <= w.allowed)
    return found
