# mypy: ignore-errors
"""Contacts of particles with surfaces: hard constraints with warm start, solved particle by particle."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, sqrt

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.one_way import find_sides
from pyverlet.core.step import Step
from pyverlet.core.surface_formulas import SETTLED, SMALL_ANGLE, bend_change, bend_excess, dragged
from pyverlet.core.surface_passing import passes_by
from pyverlet.core.surface_rows import (
    BEND,
    COULOMB,
    DRAG,
    FARAWAY,
    GAP,
    NORMAL,
    NORMAL_Y,
    PUSH,
    ROLL,
    ROLL_MOST,
    RUNS,
    SEEN,
    SIDES,
    SPEED,
    SPEED_Y,
    SPIN,
    keep_with_pair,
    row_of,
)
from pyverlet.core.surface_shapes import measure_surface
from pyverlet.core.surfaces import (
    MOST_FASTER,
    is_slow,
    length,
    most_speed,
    push_off,
    stays_off,
    update_clear,
    way_from,
)

MOST_TURNS_AROUND = cython.declare(cython.int, 64)
"""Most sweeps over the contacts of a particle between several surfaces; in a narrow wedge they counteract each other."""

TOGETHER = cython.declare(cython.int, 16)
"""Sweeps between direct solutions of two surfaces; friction must settle in between."""

JAMMED = cython.declare(cython.double, 0.9)
"""If the last sweep changes more than this fraction of the sweep halfway, no impulses satisfy all surfaces."""

SQUEEZED = cython.declare(cython.double, 0.5)
"""Yielding of a surface in a squeeze, as a fraction of its impulse."""

PARALLEL = cython.declare(cython.double, 1e-5)
"""Square of the sine of the angle below which two surfaces count as parallel."""


@inlined
def excess_speed(w: cython.pointer(Step), k: cython.Py_ssize_t, vx: cython.double, vy: cython.double) -> cython.double:
    """Speed into a surface beyond that at which the rim just reaches it in this substep, m/s.

    Particles inside a pinned circle are separated no faster than from others.
    """
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    nx: cython.double = row[first + NORMAL]
    ny: cython.double = row[first + NORMAL_Y]
    ux: cython.double = vx - row[first + SPEED]
    uy: cython.double = vy - row[first + SPEED_Y]
    nearer: cython.double = row[first + GAP] / w.h
    if w.surface[k] < 0:
        nearer = max(nearer, -cython.cast(cython.double, w.push))
    speed: cython.double = ux * nx + uy * ny - nearer
    bend: cython.double = row[first + BEND]
    if bend != 0:  # curved surfaces recede from the tangent by 1 - cos(s) = s² / (1 + sqrt(1 - s²)) of the path along it
        slip: cython.double = ux * ny - uy * nx + row[first + RUNS]
        slide: cython.double = slip * w.h * bend
        square: cython.double = slide * slide
        if square < SMALL_ANGLE:
            speed += bend_excess(slip, slide)
        else:
            speed += slip * slide / (1 + sqrt(1 - square)) if square < 1 else 1 / (bend * w.h)
    return speed


@inlined
def turn_by(w: cython.pointer(Step), i: cython.Py_ssize_t, roll: cython.double) -> cython.void:
    """Apply an angular impulse to particle i, over its mass, m^2/s."""
    if w.rolls:
        r: cython.double = w.radius[i]
        ease: cython.double = w.ease[w.mixed * i]
        w.motion[4 * i + 2] += cython.cast(real, ease * roll / (r * r))


@inlined
def hold_roll(
    w: cython.pointer(Step), i: cython.Py_ssize_t, first: cython.Py_ssize_t, after: cython.double, tangent: cython.double
) -> cython.void:
    """Rolling resistance: stop the disc's rolling on the surface within its limit; friction is about to give `tangent`."""
    row: cython.pointer(cython.double) = w.contact
    r: cython.double = w.radius[i]
    ease: cython.double = w.ease[w.mixed * i]
    if ease == 0:
        return
    most: cython.double = row[first + ROLL_MOST] * after
    had: cython.double = row[first + ROLL]
    spin: cython.double = w.motion[4 * i + 2] - row[first + SPIN] - ease * tangent / r
    row[first + ROLL] = min(max(had - r * r * spin / ease, -most), most)
    turn_by(w, i, row[first + ROLL] - had)


@inlined
def hold(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, relax: cython.bint, leak: cython.double,
    has_friction: cython.bint,
) -> cython.double:  # fmt: skip
    """Update a resting contact: the impulse that lets the rim just reach the surface within this substep.

    leak: fraction of the impulse as a speed at which the rim may enter the surface. has_friction: with friction.

    Returns the absolute change of the impulse.
    """
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    nx: cython.double = row[first + NORMAL]
    ny: cython.double = row[first + NORMAL_Y]
    before: cython.double = row[first + PUSH]
    ux: cython.double = v[width * i] - row[first + SPEED]
    uy: cython.double = v[width * i + 1] - row[first + SPEED_Y]
    speed: cython.double = ux * nx + uy * ny
    if relax:  # velocity in the middle of the substep, along the chord of a curved path
        if row[first + BEND] != 0:
            along: cython.double = ux * ny - uy * nx + row[first + RUNS]
            turned: cython.double = along * row[first + BEND] * w.h
            speed -= 0.5 * (along * turned if turned * turned < 1 else 1 / (row[first + BEND] * w.h))
    else:
        if before == 0 and passes_by(w, i, k, v[width * i], v[width * i + 1]):
            return 0.0
        speed = excess_speed(w, k, v[width * i], v[width * i + 1])
    after: cython.double = max(before + speed - leak * before, 0.0)
    if before == 0 and after == 0:
        return 0.0
    row[first + PUSH] = after
    if after == 0:
        forget_clear(w, i)
    tangent: cython.double = 0.0
    if has_friction:
        ux -= (after - before) * nx
        uy -= (after - before) * ny
        slip: cython.double = ux * ny - uy * nx - v[4 * i + 2] * w.radius[i]
        old: cython.double = row[first + DRAG]
        row[first + DRAG] = dragged(old, slip, w.ease[w.mixed * i], row[first + COULOMB] * after)
        tangent = row[first + DRAG] - old
        if w.rolls:
            hold_roll(w, i, first, after, tangent)
    if w.surface[k] < 0:
        keep_with_pair(w, k)
    push_off(w, i, k, after - before, tangent, nx, ny)
    return fabs(after - before)


@kernel
def hold_two(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, o: cython.Py_ssize_t, limit: cython.double
) -> cython.void:
    """Solve two loaded surfaces of a corner directly, as sweeps would converge slowly."""
    a: cython.Py_ssize_t = row_of(k)
    b: cython.Py_ssize_t = row_of(o)
    row: cython.pointer(cython.double) = w.contact
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    across: cython.double = row[a + NORMAL] * row[b + NORMAL_Y] - row[a + NORMAL_Y] * row[b + NORMAL]
    if across * across < PARALLEL:
        return
    along: cython.double = row[a + NORMAL] * row[b + NORMAL] + row[a + NORMAL_Y] * row[b + NORMAL_Y]
    first: cython.double = excess_speed(w, k, v[width * i], v[width * i + 1])
    second: cython.double = excess_speed(w, o, v[width * i], v[width * i + 1])
    more: cython.double = (first - along * second) / (across * across)
    other: cython.double = (second - along * first) / (across * across)
    ux: cython.double = v[width * i] - more * row[a + NORMAL] - other * row[b + NORMAL]
    uy: cython.double = v[width * i + 1] - more * row[a + NORMAL_Y] - other * row[b + NORMAL_Y]
    if row[a + PUSH] + more > 0 and row[b + PUSH] + other > 0 and ux * ux + uy * uy <= limit * limit:
        row[a + PUSH] += more
        row[b + PUSH] += other
        if w.surface[k] < 0:
            keep_with_pair(w, k)
        if w.surface[o] < 0:
            keep_with_pair(w, o)
        push_off(w, i, k, more, 0, row[a + NORMAL], row[a + NORMAL_Y])
        push_off(w, i, o, other, 0, row[b + NORMAL], row[b + NORMAL_Y])


@inlined
def turns_away(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, tangent: cython.double) -> cython.bint:
    """Whether friction `tangent` has changed the correction for a surface's curvature noticeably: s² h / 2 R.

    Buckled chains amplify what is left, so with links every curvature counts.
    """
    row: cython.pointer(cython.double) = w.contact
    first: cython.Py_ssize_t = row_of(k)
    if row[first + BEND] == 0:
        return False
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    x: cython.double = v[width * i] - row[first + SPEED] + row[first + RUNS] * row[first + NORMAL_Y]
    y: cython.double = v[width * i + 1] - row[first + SPEED_Y] - row[first + RUNS] * row[first + NORMAL]
    return bend_change(x, y, tangent, w.h, row[first + BEND]) > SETTLED * row[first + PUSH] or w.linked


@kernel
def hold_all(
    w: cython.pointer(Step), i: cython.Py_ssize_t, has_friction: cython.bint, came_x: cython.double, came_y: cython.double,
    far: cython.double,
) -> cython.bint:  # fmt: skip
    """Sweep over surfaces that are nearer than `far` or loaded, until none changes; came: velocity before the first sweep.

    Returns False if there are no impulses that leave particle i slower than `most_speed`.
    """
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    k: cython.Py_ssize_t
    change: cython.double = 0
    halfway: cython.double = 0
    limit: cython.double = -1  # not known yet
    faster: cython.double = 0  # while surfaces counteract each other
    for k in range(w.contact_begin[i], w.contact_end[i]):
        faster = max(faster, MOST_FASTER * w.contact[row_of(k) + PUSH])
    for turn in range(MOST_TURNS_AROUND):
        most: cython.double = 0
        loaded: cython.int = 0
        bends: cython.bint = False
        one: cython.Py_ssize_t = -1
        change = 0
        for k in range(w.contact_begin[i], w.contact_end[i]):
            if w.contact[row_of(k) + GAP] < far or w.contact[row_of(k) + PUSH] > 0:
                drag: cython.double = w.contact[row_of(k) + DRAG]
                change = max(change, hold(w, i, k, False, 0, has_friction))
                most = max(most, w.contact[row_of(k) + PUSH])
                if w.contact[row_of(k) + PUSH] > 0:
                    loaded += 1
                    bends |= has_friction and turns_away(w, i, k, w.contact[row_of(k) + DRAG] - drag)
                    if loaded == 2 and turn % TOGETHER == 8:
                        hold_two(w, i, one, k, most_speed(w, i, came_x, came_y) + faster)
                    one = k
        settled: cython.bint = (loaded < 2 and not bends) or change <= SETTLED * most
        if not is_slow(w, i):
            limit = most_speed(w, i, came_x, came_y) if limit < 0 else limit
            if not length(v[width * i], v[width * i + 1]) <= (limit if settled else limit + faster):
                return False
        if settled:
            return True
        if 2 * turn == MOST_TURNS_AROUND:
            halfway = change
    return change <= JAMMED * halfway and (is_slow(w, i) or length(v[width * i], v[width * i + 1]) <= limit)


@inlined
def undo_push(w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, push: cython.double) -> cython.void:
    """Undo friction and rolling resistance of a contact in this substep, and the given part of its push."""
    first: cython.Py_ssize_t = row_of(k)
    if push == 0 and w.contact[first + DRAG] == 0 and w.contact[first + ROLL] == 0:
        return
    push_off(w, i, k, -push, -w.contact[first + DRAG], w.contact[first + NORMAL], w.contact[first + NORMAL_Y])
    turn_by(w, i, -w.contact[first + ROLL])
    w.contact[first + PUSH] -= push
    forget_clear(w, i)
    w.contact[first + DRAG] = w.contact[first + ROLL] = 0
    if w.surface[k] < 0:
        keep_with_pair(w, k)


@kernel
def forget_jam(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """After the warm start: discard the impulses of surfaces on a particle that they make far too fast.

    In a closing wedge surfaces push ever harder against each other, and as they turn the difference would throw the particle.
    """
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    k: cython.Py_ssize_t
    if is_slow(w, i):
        return
    excess: cython.double = length(v[width * i], v[width * i + 1]) - 2 * length(w.free[2 * i], w.free[2 * i + 1])
    if excess <= MOST_FASTER * w.rest_speed:
        return
    fast: cython.double = 0
    pushes: cython.double = 0
    x: cython.double = 0
    y: cython.double = 0
    for k in range(w.contact_begin[i], w.contact_end[i]):
        first: cython.Py_ssize_t = row_of(k)
        push: cython.double = w.contact[first + PUSH]
        if push > 0:
            fast = max(fast, length(w.contact[first + SPEED], w.contact[first + SPEED_Y]))
            pushes += push
            x += push * w.contact[first + NORMAL]
            y += push * w.contact[first + NORMAL_Y]
    # Fixed surfaces do not close, and surfaces that push in the same direction carry a load.
    if fast == 0 or excess <= MOST_FASTER * fast or 2 * length(x, y) > pushes:
        return
    for k in range(w.contact_begin[i], w.contact_end[i]):
        undo_push(w, i, k, w.contact[row_of(k) + PUSH])


@kernel
def hold_surfaces(w: cython.pointer(Step), i: cython.Py_ssize_t, clear: cython.bint) -> cython.void:
    """Hold particle i at the surfaces that it may reach in this substep; clear: only those that carry it, see `keeps_clear`.

    In a wedge narrower than the friction angle no impulses push it out, as friction grows with them; then without friction.
    """
    k: cython.Py_ssize_t
    loads: cython.int = 0
    far: cython.double = -FARAWAY if clear else w.far
    unmoved: cython.bint = w.since[i] == 0 and not w.linked and not w.restless  # still where surfaces were measured
    for k in range(w.contact_begin[i], w.contact_end[i]):
        loaded: cython.bint = w.contact[row_of(k) + PUSH] > 0
        if clear and not loaded:
            continue
        loads += loaded
        if not loaded and stays_off(w, i, k, w.far):
            w.contact[row_of(k) + GAP] = FARAWAY
        elif not (loaded and unmoved and w.surface[k] >= 0):
            measure_surface(w, i, k, False)
    if not clear:
        update_clear(w, i)
    elif loads == 0:
        return
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    x: cython.double = v[width * i]
    y: cython.double = v[width * i + 1]
    if hold_all(w, i, w.rough, x, y, far):
        return
    for k in range(w.contact_begin[i], w.contact_end[i]):
        undo_push(w, i, k, 0)
    if not (w.rough and hold_all(w, i, False, x, y, far)):
        squeeze(w, i, far)


@kernel
def squeeze(w: cython.pointer(Step), i: cython.Py_ssize_t, far: cython.double) -> cython.void:
    """Surfaces leave too little room for particle i: they yield in proportion, except for the room, which is solved last."""
    turn: cython.int
    k: cython.Py_ssize_t
    for turn in range(MOST_TURNS_AROUND + 1):
        last: cython.bint = turn == MOST_TURNS_AROUND
        for k in range(w.contact_begin[i], w.contact_end[i]):
            near: cython.bint = w.contact[row_of(k) + GAP] < far or w.contact[row_of(k) + PUSH] > 0
            if near and (not last or 0 <= w.surface[k] < SIDES):
                hold(w, i, k, False, 0 if last else SQUEEZED, False)


@kernel
def relax_surfaces(w: cython.pointer(Step), i: cython.Py_ssize_t, again: cython.bint) -> cython.void:
    """Remove the speed into loaded surfaces. again: positions relative to surfaces other than pinned circles are unchanged."""
    k: cython.Py_ssize_t
    for k in range(w.contact_begin[i], w.contact_end[i]):
        if w.contact[row_of(k) + PUSH] > 0:
            if not again or w.surface[k] < 0:
                measure_surface(w, i, k, True)
            hold(w, i, k, True, 0, w.rough)


@inlined
def stands(w: cython.pointer(Step)) -> cython.bint:
    """Whether loaded contacts with surfaces other than pinned circles were measured at the end of the last substep."""
    return w.substep > w.first and w.relaxes > 0 and w.moving_count == 0 and not (w.one_way or w.linked)


@kernel
def warm_surfaces(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Warm start: repeat the impulses of surfaces on particle i along current normals."""
    k: cython.Py_ssize_t
    known: cython.bint = stands(w)
    if w.one_way:
        find_sides(w, i)
    for k in range(w.contact_begin[i], w.contact_end[i]):
        first: cython.Py_ssize_t = row_of(k)
        if w.contact[first + PUSH] > 0:
            if not known or w.surface[k] < 0 or way_from(w, i, w.contact, first + SEEN) > 0:
                measure_surface(w, i, k, False)
            if w.substep == w.first:
                w.contact[first + PUSH] *= w.scale
                w.contact[first + DRAG] *= w.scale
                if w.surface[k] < 0:
                    keep_with_pair(w, k)
            if w.rolls:
                if w.substep == w.first:
                    w.contact[first + ROLL] *= w.scale
                turn_by(w, i, w.contact[first + ROLL])
            jt: cython.double = w.contact[first + DRAG] if w.rough else 0.0
            push_off(w, i, k, w.contact[first + PUSH], jt, w.contact[first + NORMAL], w.contact[first + NORMAL_Y])
