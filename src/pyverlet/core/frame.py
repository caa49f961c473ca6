# mypy: ignore-errors
"""A frame: its substeps, stage by stage, as every thread of the team goes through them.

Per substep of length h:
 1. kick: velocities gain the acceleration; walls give what they gave in the last substep.
 2. warm start: so do contacts, along the normals of now.
 3. walls: what comes fast bounces, the rest is held.
 4. contacts: one sweep over the pairs, with springs; pairs that meet fast bounce, in closed form.
 5. drift: walls once more, then x += v h.
 6. relax: sweeps without the springs.
 7. remember what contacts gave.

Velocities within a frame are those of the middle of a substep (Stormer and Verlet). With v, a and c the velocity, the
acceleration by forces and that by contacts at the start of a frame, its first substep begins from v + a h / 2 - c h' / 2, h'
being the substep before, and contacts give c (h + h') / 2; at the end v + (a + c) h / 2 is the velocity of the positions of now.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt
from cython.cimports.team import team_barrier

from pyverlet.core.contacts import relax_contacts, solve_contacts
from pyverlet.core.step import Step
from pyverlet.core.walls import bounce_walls, hold_walls, list_walls, relax_walls, warm_walls
from pyverlet.core.warm_start import warm_start


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def kick(w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t, part: cython.int) -> cython.void:
    """Forces; what contacts gave in the last substep of the frame before comes back as `given` says."""
    begins: cython.bint = w.substep == w.first
    kicked: real = w.opening if begins else w.kick
    back: real = w.taken_back if begins else cython.cast(real, 0)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    most: real = 0
    i: cython.Py_ssize_t
    for i in range(a, b):
        x: real = v[width * i] + w.acceleration[2 * i] * kicked - w.given[2 * i] * back
        y: real = v[width * i + 1] + w.acceleration[2 * i + 1] * kicked - w.given[2 * i + 1] * back
        v[width * i] = x
        v[width * i + 1] = y
        w.free[2 * i] = x
        w.free[2 * i + 1] = y
        w.moved[2 * i] = w.position[2 * i] - w.listed[2 * i]
        w.moved[2 * i + 1] = w.position[2 * i + 1] - w.listed[2 * i + 1]
        square: real = x * x + y * y
        most = square if square > most else most
    if w.rough:
        for i in range(a, b):
            w.motion[4 * i + 2] -= w.given_spin[i] * back
            w.free_spin[i] = w.motion[4 * i + 2]
    w.fastest[part] = most


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def drift(w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t, part: cython.int) -> cython.void:
    """x += v h; whether a particle may leave where the list of pairs is good in the next substep."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    h: real = w.h
    i: cython.Py_ssize_t
    stale: cython.bint = False
    for i in range(a, b):
        x: real = w.position[2 * i] + h * v[width * i]
        y: real = w.position[2 * i + 1] + h * v[width * i + 1]
        w.position[2 * i] = x
        w.position[2 * i + 1] = y
        dx: real = x + h * v[width * i] - w.checked[2 * i]
        dy: real = y + h * v[width * i + 1] - w.checked[2 * i + 1]
        stale |= not (dx * dx + dy * dy <= w.allowed)
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
        for i in range(2 * a, 2 * b):
            w.given[i] = w.velocity[i] - w.free[i]


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
    for i in range(a, a + walled):
        bounce_walls(w, w.at_wall[i])
        hold_walls(w, w.at_wall[i])
    team_barrier(w.team)
    for parity in range(2):
        for half in range(w.cut[parity * (parts + 1) + part], w.cut[parity * (parts + 1) + part + 1]):
            solve_contacts(w, 2 * half + parity)
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
