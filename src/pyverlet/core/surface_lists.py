# mypy: ignore-errors
"""Lists the surfaces that each particle may touch while the list is valid; remade whenever the pair list is checked.

The list also stores contact state. There are two lists: a new one takes its state from the previous one. Until it is made, the
ranges of particles refer to the previous one.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs, floor, sqrt
from cython.cimports.libc.stdint import int32_t, int64_t, uint32_t
from cython.cimports.team import team_stage

from pyverlet.core.cells import BLOCK, image_of
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.obstacles import LENGTH, PLACE, SEGMENT, SENSOR, accepts, accepts_segment, near_segment, reach_about
from pyverlet.core.pair_lists import INDEX_WORDS
from pyverlet.core.segments import head_at
from pyverlet.core.step import BOX, CAGE, NEAR, Step
from pyverlet.core.surface_rows import (
    DRAG,
    EVENT,
    EVENT_BOUNCES,
    EVENT_IMPULSE,
    EVENT_SPEED,
    FARAWAY,
    HELD,
    PUSH,
    ROLL,
    SEEN,
    SIDES,
    is_one_way,
    pinned_lane,
    pinned_sign,
    row_of,
)

FASTER = cython.declare(cython.double, 2.2)
"""Distance at which surfaces are listed, in displacements per substep."""


@inlined
def sight(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.double:
    """Distance from its rim at which surfaces are listed for particle i, m."""
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    x: cython.double = v[width * i]
    y: cython.double = v[width * i + 1]
    return w.margin + max(FASTER * sqrt(x * x + y * y) * w.h, w.near + NEAR * w.lists.largest)


@inlined
def near_side(w: cython.pointer(Step), i: cython.Py_ssize_t, side: cython.int, far: cython.double) -> cython.bint:
    """Whether a side of the room is within that distance."""
    x: cython.double = w.position[2 * i]
    y: cython.double = w.position[2 * i + 1]
    far += w.radius[i]
    if w.boundary == CAGE:
        x -= w.x0
        y -= w.y0
        return side == 0 and (w.x1 <= far or x * x + y * y > (w.x1 - far) * (w.x1 - far))
    if side == 0:
        return x - far < w.x0
    if side == 1:
        return x + far > w.x1
    if side == 2:
        return y - far < w.y0
    return y + far > w.y1


@inlined
def put_surface(w: cython.pointer(Step), begin: cython.Py_ssize_t, end: cython.Py_ssize_t, which: int32_t) -> cython.Py_ssize_t:
    """Insert a surface into the places begin to end, in order; returns the new end. Duplicates are dropped.

    Pinned circles come first, then obstacles, then sides of the room: the last one solved wins if there is no room for all.
    """
    k: cython.Py_ssize_t = end
    while k > begin and cython.cast(uint32_t, w.surface[k - 1]) < cython.cast(uint32_t, which):
        k -= 1
    if k > begin and w.surface[k - 1] == which:
        return end
    for n in range(end, k, -1):
        w.surface[n] = w.surface[n - 1]
    w.surface[k] = which
    return end + 1


@inlined
def sees(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, x: cython.double, y: cython.double, far: cython.double
) -> cython.bint:
    """Whether particle i at (x, y) may collide with segment k, and is near it."""
    return near_segment(w, k, x, y, far) and w.segment[SEGMENT * k + SENSOR] == 0 and accepts_segment(w, i, k)


@kernel
def is_seen(w: cython.pointer(Step), k: cython.Py_ssize_t) -> cython.bint:
    """Whether segment k is listed, or near a particle at the start of a frame."""
    n: cython.Py_ssize_t
    at: cython.Py_ssize_t = SEGMENT * k
    around: cython.double = w.margin + w.near + NEAR * w.lists.largest
    wide: cython.double = around + reach_about(w, k)
    x0: cython.double = w.segment[at + PLACE]
    y0: cython.double = w.segment[at + PLACE + 1]
    x1: cython.double = x0 + w.segment[at + PLACE + 2] * w.segment[at + LENGTH]
    y1: cython.double = y0 + w.segment[at + PLACE + 3] * w.segment[at + LENGTH]
    x0, x1, y0, y1 = min(x0, x1) - wide, max(x0, x1) + wide, min(y0, y1) - wide, max(y0, y1) + wide
    for i in range(w.count):
        for n in range(w.contact_begin[i], w.contact_end[i]):
            if w.surface[n] == SIDES + k:
                return True
        x: cython.double = image_of(w.position[2 * i], w.checked[2 * i], w.cells.low_x, w.cells.period_x)
        y: cython.double = image_of(w.position[2 * i + 1], w.checked[2 * i + 1], w.cells.low_y, w.cells.period_y)
        u: cython.double = w.velocity[2 * i]
        v: cython.double = w.velocity[2 * i + 1]
        far: cython.double = FASTER * (fabs(u) + fabs(v)) * w.h + w.radius[i]  # at least as far as in `see`
        if x + far < x0 or x - far > x1 or y + far < y0 or y - far > y1:
            continue
        if near_segment(w, k, x, y, around + FASTER * sqrt(u * u + v * v) * w.h + w.radius[i]):
            return True
    return False


@kernel
def see(w: cython.pointer(Step), i: cython.Py_ssize_t, begin: cython.Py_ssize_t, fill: cython.bint) -> cython.Py_ssize_t:
    """List the surfaces near particle i, from place `begin` on; returns the end. Without `fill` only count, some twice."""
    end: cython.Py_ssize_t = begin
    far: cython.double = sight(w, i)
    side: cython.int
    pair: int32_t = w.lists.head[i] if w.pins else -1
    while pair >= 0:
        # Chains are in reverse order and groups in any, so each is inserted before existing ones.
        for n in range(end if fill else begin, begin, -1):
            w.surface[n] = w.surface[n - 1]
        if fill:
            w.surface[begin] = -1 - pair
        end += 1
        pair = w.lists.kept_next[INDEX_WORDS * pair]
    if (w.boundary == BOX or w.boundary == CAGE) and accepts(w, i, w.wall_category, w.wall_mask):
        for side in range(4):
            if near_side(w, i, side, far):
                end = put_surface(w, begin, end, side) if fill else end + 1
    if w.solids == 0:
        return end
    x: cython.double = image_of(w.position[2 * i], w.checked[2 * i], w.cells.low_x, w.cells.period_x)
    y: cython.double = image_of(w.position[2 * i + 1], w.checked[2 * i + 1], w.cells.low_y, w.cells.period_y)
    far += w.radius[i]
    first: int64_t = cython.cast(int64_t, floor((x - far) / w.cell))
    last: int64_t = cython.cast(int64_t, floor((x + far) / w.cell))
    low: int64_t = cython.cast(int64_t, floor((y - far) / w.cell))
    high: int64_t = cython.cast(int64_t, floor((y + far) / w.cell))
    k: cython.Py_ssize_t
    if (last - first + 1) * cython.cast(cython.double, high - low + 1) > w.segments:  # checking all segments takes less time
        for k in range(w.segments):
            if sees(w, i, k, x, y, far):
                end = put_surface(w, begin, end, cython.cast(int32_t, SIDES + k)) if fill else end + 1
        return end
    for row in range(low, high + 1):
        for column in range(first, last + 1):
            link: int32_t = w.head[head_at(column, row, w.cell_heads)]
            while link >= 0:
                k = w.link[2 * link]
                link = w.link[2 * link + 1]
                if sees(w, i, k, x, y, far):
                    end = put_surface(w, begin, end, cython.cast(int32_t, SIDES + k)) if fill else end + 1
    return end


@kernel
def count_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Count the surfaces near each particle of a block."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    a: cython.Py_ssize_t = block * BLOCK
    total: cython.Py_ssize_t = 0
    touching: cython.Py_ssize_t = 0
    for i in range(a, min(a + BLOCK, w.count)):
        found: cython.Py_ssize_t = see(w, i, 0, False) if w.inverse_mass[i] > 0 else 0
        w.lists.used[i] = cython.cast(uint32_t, total)  # scratch memory of the pair lists
        total += found
        if found > 0:
            w.at_surface[a + touching] = cython.cast(int32_t, i)
            touching += 1
    w.contact_count[block] = total
    w.at_surface_count[block] = cython.cast(int32_t, touching)


@inlined
def leave_empty(w: cython.pointer(Step), k: cython.Py_ssize_t, i: cython.Py_ssize_t) -> cython.void:
    """Make place k one that carries nothing: eights are computed whole."""
    w.contact_particle[k] = cython.cast(uint32_t, i)
    w.contact[row_of(k) + PUSH] = w.contact[row_of(k) + DRAG] = w.contact[row_of(k) + ROLL] = 0


@kernel
def fill_surfaces_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """List the surfaces of a block, with their contact state, from place contact_count on."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    o: cython.Py_ssize_t
    n: cython.Py_ssize_t = block * BLOCK
    last: cython.Py_ssize_t = n + w.at_surface_count[block]
    k: cython.Py_ssize_t
    filled: cython.Py_ssize_t = w.contact_count[block]
    for i in range(block * BLOCK, min((block + 1) * BLOCK, w.count)):
        old_begin: cython.Py_ssize_t = w.contact_begin[i]
        old_end: cython.Py_ssize_t = w.contact_end[i]
        begin: cython.Py_ssize_t = w.contact_count[block] + w.lists.used[i]
        end: cython.Py_ssize_t = begin
        if n < last and w.at_surface[n] == i:
            end = see(w, i, begin, True)
            n += 1
        w.contact_begin[i], w.contact_end[i] = cython.cast(int32_t, begin), cython.cast(int32_t, end)
        for k in range(filled, begin):
            leave_empty(w, k, i)
        filled = end
        for k in range(begin, end):
            w.contact_particle[k] = cython.cast(uint32_t, i)
            w.clear[clear_of(k) + 16] = 0
            w.contact[row_of(k) + PUSH] = w.contact[row_of(k) + DRAG] = w.contact[row_of(k) + ROLL] = 0
            w.contact[row_of(k) + HELD] = 0
            w.contact[row_of(k) + SEEN] = FARAWAY  # not measured yet
            w.contact[row_of(k) + EVENT_SPEED] = w.contact[row_of(k) + EVENT_BOUNCES] = w.contact[row_of(k) + EVENT] = 0
            w.contact[row_of(k) + EVENT_IMPULSE] = 0
            if w.surface[k] < 0:
                w.contact[row_of(k) + PUSH] = w.impulse[pinned_lane(w, k)]
                w.contact[row_of(k) + DRAG] = -w.tangent_impulse[pinned_lane(w, k)] if w.rough else 0
                if w.rolls:
                    w.contact[row_of(k) + ROLL] = pinned_sign(w, pinned_lane(w, k)) * w.roll_impulse[pinned_lane(w, k)]
                continue
            for o in range(old_begin, old_end):
                if w.old_surface[o] == w.surface[k]:
                    w.contact[row_of(k) + PUSH] = w.old_contact[row_of(o) + PUSH]
                    w.contact[row_of(k) + DRAG] = w.old_contact[row_of(o) + DRAG]
                    w.contact[row_of(k) + ROLL] = w.old_contact[row_of(o) + ROLL]
                    if w.surface[k] >= SIDES and is_one_way(w, SEGMENT * (cython.cast(int64_t, w.surface[k]) - SIDES)):
                        w.contact[row_of(k) + HELD] = w.old_contact[row_of(o) + HELD]
    for k in range(filled, (filled + 7) & -8):
        leave_empty(w, k, block * BLOCK)


@kernel
def chain_pinned(w: cython.pointer(Step)) -> cython.void:
    """Add pairs with a pinned circle to a chain of the free one; the chains were used when the list was made."""
    i: cython.Py_ssize_t
    k: cython.Py_ssize_t
    for i in range(w.count):
        w.lists.head[i] = -1
    for s in range(w.groups):
        for k in range(w.begin[s] + w.swept[s], w.begin[s] + w.lanes[s]):
            i = w.j[k] if w.inverse_mass[w.i[k]] == 0 else w.i[k]
            w.lists.kept_next[INDEX_WORDS * k] = w.lists.head[i]
            w.lists.head[i] = cython.cast(int32_t, k)


@kernel
def swap_surfaces(w: cython.pointer(Step)) -> cython.void:
    """Make the current list the previous one."""
    w.side = 1 - w.side
    w.surface, w.old_surface = w.old_surface, w.surface
    w.contact, w.old_contact = w.old_contact, w.contact


@kernel
def list_surfaces(w: cython.pointer(Step)) -> cython.bint:
    """List the surfaces near all particles. False: there are too few places."""
    blocks: cython.int = cython.cast(cython.int, (w.count + BLOCK - 1) // BLOCK)
    w.surfaces_good = False
    if not w.surfaces_kept:
        swap_surfaces(w)
        w.surfaces_kept = True
    if w.pins:
        chain_pinned(w)
    team_stage(w.team, count_stage, w, blocks)
    total: int64_t = 0
    for block in range(blocks):
        here: int64_t = w.contact_count[block]
        w.contact_count[block] = total
        total += (here + 7) & -8  # the eights of a block are its own
    if total > w.contact_capacity:
        w.contact_count[0] = total
        return False
    team_stage(w.team, fill_surfaces_stage, w, blocks)
    w.surfaces_good, w.surfaces_kept = True, False
    return True
