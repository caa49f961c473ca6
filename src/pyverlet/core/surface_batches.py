# mypy: ignore-errors
"""Passes over the particles at surfaces: eight contacts at a time where a particle is carried by one surface, else one by one.

Most particles at surfaces rest on one and keep clear of the others. The loops over eight contacts have no branches, so that
compilers make vectors of them, and give the bits of `core.surface_contacts`, to which a particle is left that needs more.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import gather, lanes2, lanes4, real, spread, store, take, take4
from cython.cimports.libc.math import fabs

from pyverlet.core.cells import BLOCK
from pyverlet.core.event_recording import record_held
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.step import Step
from pyverlet.core.surface_contacts import hold_surfaces, relax_surfaces, stands, warm_surfaces
from pyverlet.core.surface_formulas import SETTLED, SMALL_ANGLE, bend_change, bend_excess, dragged
from pyverlet.core.surface_rows import (
    BEND,
    COULOMB,
    DRAG,
    GAP,
    NORMAL,
    NORMAL_Y,
    PUSH,
    RUNS,
    SEEN,
    SEEN_Y,
    SPEED,
    SPEED_Y,
    clear_of,
    row_of,
)
from pyverlet.core.surface_shapes import measure_surface
from pyverlet.core.surfaces import MOST_FASTER, bounce_surfaces, has_rebounds, keeps_clear

TASK_WARM = cython.declare(cython.int, 0)
TASK_HOLD = cython.declare(cython.int, 1)
TASK_RELAX = cython.declare(cython.int, 2)
TASK_RELAX_AGAIN = cython.declare(cython.int, 3)
"""Passes over particles at surfaces. The last one: surfaces other than pinned circles were measured by the one before."""


Rest = cython.struct(
    vx=cython.pointer(real),  # (8,) m/s, before and after
    vy=cython.pointer(real),
    spin=cython.pointer(real),  # rad/s; this and the next two only with friction
    radius=cython.pointer(real),  # m
    ease=cython.pointer(real),  # as in `Step`
    x=cython.pointer(real),  # m, unless relaxed
    y=cython.pointer(real),
    push=cython.p_double,  # impulses after it, m/s
    drag=cython.p_double,
    room=cython.p_double,  # m that the particle keeps clear of other surfaces, over what it moves
    spare=cython.p_double,  # positive if no branch of `core.surface_contacts` is needed
)
"""The particles of eight contacts, and results for them."""


@inlined
def carries_alone(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t) -> cython.bint:
    """Whether contact k, which carries particle i, is the only one that does, and not one with a pinned circle."""
    o: cython.Py_ssize_t
    alone: cython.bint = w.surface[k] >= 0
    for o in range(w.contact_begin[i], w.contact_end[i]):
        alone = alone and (o == k or w.contact[row_of(o) + PUSH] <= 0)
    return alone


@inlined
def load_rest(
    w: cython.pointer(Step), k: cython.Py_ssize_t, r: cython.pointer(Rest), rough: cython.bint, places: cython.bint
) -> cython.void:  # fmt: skip
    """Load what the particles of contacts k to k + 7 are and where, if `places`."""
    if rough:
        motion: lanes4 = take4(w.motion, w.contact_particle, k)
        store(r.vx, 0, motion.x)
        store(r.vy, 0, motion.y)
        store(r.spin, 0, motion.z)
        store(r.radius, 0, gather(w.radius, w.contact_particle, k))
        store(r.ease, 0, gather(w.ease, w.contact_particle, k) if w.mixed else spread(w.ease[0]))
    else:
        velocity: lanes2 = take(w.velocity, w.contact_particle, k)
        store(r.vx, 0, velocity.x)
        store(r.vy, 0, velocity.y)
    if places:
        position: lanes2 = take(w.position, w.contact_particle, k)
        store(r.x, 0, position.x)
        store(r.y, 0, position.y)


@inlined
def store_rest(
    w: cython.pointer(Step), k: cython.Py_ssize_t, n: cython.int, r: cython.pointer(Rest), rough: cython.bint
) -> cython.void:
    """Store the results of contact k + n."""
    i: cython.Py_ssize_t = w.contact_particle[k + n]
    at: cython.Py_ssize_t = row_of(k) + n
    width: cython.Py_ssize_t = 4 if rough else 2
    v: cython.pointer(real) = w.motion if rough else w.velocity
    v[width * i] = r.vx[n]
    v[width * i + 1] = r.vy[n]
    w.contact[at + PUSH] = r.push[n]
    if rough:
        v[width * i + 2] = r.spin[n]
        w.contact[at + DRAG] = r.drag[n]


@inlined
def solve_rest(
    w: cython.pointer(Step), k: cython.Py_ssize_t, r: cython.pointer(Rest), rough: cython.bint, relax: cython.bint
) -> cython.void:  # fmt: skip
    """Hold or relax the particles of contacts k to k + 7, each as if carried by this contact alone; no result is stored.

    The formulas are those of `hold`, `keeps_clear`, `turns_away` and `is_slow`.
    """
    row: cython.p_double = w.contact
    at: cython.Py_ssize_t = row_of(k)
    clear: cython.Py_ssize_t = clear_of(k)
    h: cython.double = w.h
    slow: cython.double = MOST_FASTER * w.rest_speed
    n: cython.int
    vx: cython.pointer(real) = r.vx
    vy: cython.pointer(real) = r.vy
    spin: cython.pointer(real) = r.spin
    ax: real[8]
    ay: real[8]
    if not relax:
        acceleration: lanes2 = take(w.acceleration, w.contact_particle, k)
        store(ax, 0, acceleration.x)
        store(ay, 0, acceleration.y)
    for n in range(8):
        nx: cython.double = row[at + NORMAL + n]
        ny: cython.double = row[at + NORMAL_Y + n]
        bend: cython.double = row[at + BEND + n]
        runs: cython.double = row[at + RUNS + n]
        had: cython.double = row[at + PUSH + n]
        ux: cython.double = vx[n] - row[at + SPEED + n]
        uy: cython.double = vy[n] - row[at + SPEED_Y + n]
        speed: cython.double = ux * nx + uy * ny
        along: cython.double = ux * ny - uy * nx + runs
        slide: cython.double = along * h * bend
        turned: cython.double = along * bend * h
        if relax:
            speed -= 0.5 * (along * turned)
        else:
            speed = speed - row[at + GAP + n] / h + bend_excess(along, slide)
            away: cython.double = fabs(r.x[n] - w.clear[clear + n]) + fabs(r.y[n] - w.clear[clear + 8 + n])
            away += h * (fabs(vx[n]) + fabs(vy[n])) + h * h * (fabs(ax[n]) + fabs(ay[n]))
            r.room[n] = w.clear[clear + 16 + n] - 2 * away
        after: cython.double = max(had + speed, 0.0)
        gain: cython.double = after - had
        tangent: cython.double = 0.0
        if rough:
            ux -= gain * nx
            uy -= gain * ny
            rim: cython.double = spin[n] * r.radius[n]
            held: cython.double = row[at + DRAG + n]
            new: cython.double = dragged(held, ux * ny - uy * nx - rim, r.ease[n], row[at + COULOMB + n] * after)
            tangent = new - held
            r.drag[n] = new
            spin[n] -= cython.cast(real, tangent * (r.ease[n] / cython.cast(cython.double, r.radius[n])))
        r.push[n] = after
        new_x: real = vx[n] + cython.cast(real, tangent * ny - gain * nx)
        new_y: real = vy[n] - cython.cast(real, tangent * nx + gain * ny)
        vx[n], vy[n] = new_x, new_y
        if relax:
            r.spare[n] = min(after, 1 - turned * turned)
        else:
            x: cython.double = new_x
            y: cython.double = new_y
            spare: cython.double = min(SMALL_ANGLE - slide * slide, slow * slow - (x * x + y * y))
            x = x - row[at + SPEED + n] + runs * ny
            y = y - row[at + SPEED_Y + n] - runs * nx
            r.spare[n] = min(spare, SETTLED * after - bend_change(x, y, tangent, h, bend))


@inlined
def warm_rest(w: cython.pointer(Step), k: cython.Py_ssize_t, r: cython.pointer(Rest), rough: cython.bint) -> cython.void:
    """Repeat the impulses of contacts k to k + 7; `room` is how far particles have moved since these were measured."""
    row: cython.p_double = w.contact
    at: cython.Py_ssize_t = row_of(k)
    n: cython.int
    for n in range(8):
        push: cython.double = row[at + PUSH + n]
        tangent: cython.double = row[at + DRAG + n] if rough else 0.0
        r.room[n] = fabs(r.x[n] - row[at + SEEN + n]) + fabs(r.y[n] - row[at + SEEN_Y + n])
        r.push[n] = push
        r.vx[n] += cython.cast(real, tangent * row[at + NORMAL_Y + n] - push * row[at + NORMAL + n])
        r.vy[n] -= cython.cast(real, tangent * row[at + NORMAL + n] + push * row[at + NORMAL_Y + n])
        if rough:
            r.drag[n] = tangent
            r.spin[n] -= cython.cast(real, tangent * (r.ease[n] / cython.cast(cython.double, r.radius[n])))


@inlined
def warm_eight(
    w: cython.pointer(Step), k: cython.Py_ssize_t, r: cython.pointer(Rest), rough: cython.bint, last: cython.Py_ssize_t
) -> cython.Py_ssize_t:  # fmt: skip
    """Warm-start the particles of contacts k to k + 7, except `last`; returns the last one that was by itself."""
    n: cython.int
    load_rest(w, k, r, rough, True)
    warm_rest(w, k, r, rough)
    for n in range(8):
        i: cython.Py_ssize_t = w.contact_particle[k + n]
        if not r.push[n] > 0 or i == last:
            continue
        if r.room[n] == 0 and carries_alone(w, i, k + n):
            store_rest(w, k, n, r, rough)
        else:
            warm_surfaces(w, i)
            last = i
    return last


@inlined
def hold_eight(
    w: cython.pointer(Step), block: cython.Py_ssize_t, k: cython.Py_ssize_t, r: cython.pointer(Rest), rough: cython.bint,
    last: cython.Py_ssize_t,
) -> cython.Py_ssize_t:  # fmt: skip
    """Hold the particles of contacts k to k + 7, except `last`; returns the last one that was held by itself."""
    n: cython.int
    load_rest(w, k, r, rough, True)
    solve_rest(w, k, r, rough, False)
    for n in range(8):
        i: cython.Py_ssize_t = w.contact_particle[k + n]
        if i == last:
            continue
        clear: cython.bint = r.room[n] > 0 and w.thrown[i] == 0
        if w.contact[row_of(k) + PUSH + n] > 0:
            if clear and w.since[i] == 0 and r.spare[n] > 0 and carries_alone(w, i, k + n):
                store_rest(w, k, n, r, rough)
                continue
        elif clear or w.contact_begin[i] != k + n:
            continue
        hold_particle(w, block, i)
        last = i
    return last


@inlined
def relax_eight(
    w: cython.pointer(Step), k: cython.Py_ssize_t, r: cython.pointer(Rest), rough: cython.bint, again: cython.bint,
    last: cython.Py_ssize_t,
) -> cython.Py_ssize_t:  # fmt: skip
    """Relax the particles of contacts k to k + 7, except `last`; returns the last one that was relaxed by itself."""
    n: cython.int
    carry: cython.int = 0
    for n in range(8):
        if w.contact[row_of(k) + PUSH + n] > 0:
            carry |= 1 << n
            if not again and w.surface[k + n] >= 0:
                measure_surface(w, w.contact_particle[k + n], k + n, True)
    if carry == 0:
        return last
    load_rest(w, k, r, rough, False)
    solve_rest(w, k, r, rough, True)
    for n in range(8):
        i: cython.Py_ssize_t = w.contact_particle[k + n]
        if not (carry >> n) & 1 or i == last:
            continue
        if r.spare[n] > 0 and carries_alone(w, i, k + n):
            store_rest(w, k, n, r, rough)
        else:
            relax_surfaces(w, i, again)
            last = i
    return last


@inlined
def solve_eights(w: cython.pointer(Step), block: cython.Py_ssize_t, task: cython.int, rough: cython.bint) -> cython.void:
    """`solve_surfaces`, eight contacts at a time."""
    vx: real[8]
    vy: real[8]
    spin: real[8]
    radius: real[8]
    ease: real[8]
    x: real[8]
    y: real[8]
    push: cython.double[8]
    drag: cython.double[8]
    room: cython.double[8]
    spare: cython.double[8]
    rest: Rest
    r: cython.pointer(Rest) = cython.address(rest)
    r.vx, r.vy, r.spin, r.radius, r.ease, r.x, r.y = vx, vy, spin, radius, ease, x, y
    r.push, r.drag, r.room, r.spare = push, drag, room, spare
    first: cython.Py_ssize_t = w.at_surface[block * BLOCK]
    final: cython.Py_ssize_t = w.at_surface[block * BLOCK + w.at_surface_count[block] - 1]
    last: cython.Py_ssize_t = -1
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[first], w.contact_end[final], 8):
        if task == TASK_WARM:
            last = warm_eight(w, k, r, rough, last)
        elif task == TASK_HOLD:
            last = hold_eight(w, block, k, r, rough, last)
        else:
            last = relax_eight(w, k, r, rough, task == TASK_RELAX_AGAIN, last)


@kernel
def hold_particle(w: cython.pointer(Step), block: cython.Py_ssize_t, i: cython.Py_ssize_t) -> cython.void:
    """Particle i bounces if it hits a surface fast, and is held."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    clear: cython.bint = keeps_clear(w, i)
    if not (clear and w.thrown[i] == 0) and bounce_surfaces(w, i):
        clear = keeps_clear(w, i)
        if w.linked:
            w.rebounds[block] |= has_rebounds(w, i)
    x: real = v[width * i]
    y: real = v[width * i + 1]
    hold_surfaces(w, i, clear)
    if w.records_events:
        record_held(w, i, x, y)


@kernel
def solve_surfaces(w: cython.pointer(Step), block: cython.Py_ssize_t, task: cython.int) -> cython.void:
    """Warm-start, hold or relax the particles of a block that may touch surfaces; fast ones bounce before they are held."""
    n: cython.Py_ssize_t
    by_one: cython.bint = w.linked or w.restless or w.rolls or w.records_contacts or w.records_events
    if by_one or (task == TASK_WARM and not stands(w)):
        for n in range(block * BLOCK, block * BLOCK + w.at_surface_count[block]):
            if task == TASK_WARM:
                warm_surfaces(w, w.at_surface[n])
            elif task == TASK_HOLD:
                hold_particle(w, block, w.at_surface[n])
            else:
                relax_surfaces(w, w.at_surface[n], task == TASK_RELAX_AGAIN)
    elif w.at_surface_count[block] > 0:
        if w.rough:
            solve_eights(w, block, task, True)
        else:
            solve_eights(w, block, task, False)
