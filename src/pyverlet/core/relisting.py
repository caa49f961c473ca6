# mypy: ignore-errors
"""Builds the pair list, stage by stage, within a frame. One thread decides; the stages run on all."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, isnan, sqrt
from cython.cimports.libc.stdint import int64_t, uint32_t
from cython.cimports.team import team_give_number, team_reserved, team_stage, team_take_number

from pyverlet.core.all_pairs import list_all
from pyverlet.core.cell_grids import Extent, fit_cells, measure_extent, whole_extent
from pyverlet.core.cell_sorting import buckets_of, sort_cells, spots_stage
from pyverlet.core.cells import BLOCK, Cells, reach_of
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.list_age import WORTH_LOOKING, adapt_skin, bound_moves, lay_patches, slack_left, way_of
from pyverlet.core.pair_batches import count_far, place_lanes, put_batches
from pyverlet.core.pair_groups import cut_rows, each_group, find_busy, kept_groups, lay_groups, mark_dirty, most_in_group
from pyverlet.core.pair_lists import Lists, list_alone, list_rows
from pyverlet.core.pair_materials import fill_alike, fill_lanes
from pyverlet.core.pair_memory import GONE, clear_chains, find_sources, keep_impulses, take_over
from pyverlet.core.step import Step

FAST = cython.declare(cython.double, 2.2)
MOST_FAST = cython.declare(cython.double, 2.0)
"""The skin is at least FAST times the largest displacement per substep, but for this reason at most so many mean diameters.

Faster particles get an extended reach, for the single substep that such a list lasts."""

MOST_FAR = cython.declare(cython.double, 4.0)
"""Most pairs per particle that the extended reach may add, estimated from the mean density. Beyond it, pairs that approach by
more than the skin in a substep may pass through each other."""

OCTAVES = cython.declare(cython.int, 16)

FEW_FAR = cython.declare(cython.Py_ssize_t, 16)
FAR_ALONE = cython.declare(cython.Py_ssize_t, 256)
"""So many particles, or one in so many, may reach farther than all others and get no cell: each searches neighbours by itself,
and they are compared with each other."""

ROUNDINGS = cython.declare(cython.double, 8.0)
"""Possible rounding of an image in a periodic room, in units in the last place of its largest coordinate."""


@kernel
def keep_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Store the contact state of a group in chains."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = 2 * item + w.parity
    if w.lists.dirty[s]:
        keep_impulses(w, w.lists, s)
        w.lanes[s] = 0


@kernel
def store_impulses(w: cython.pointer(Step), kept: cython.Py_ssize_t) -> cython.void:
    """Store contact state in chains, except for the first `kept` groups that are not dirty; other chains are empty."""
    ls: cython.pointer(Lists) = w.lists
    s: cython.Py_ssize_t
    for s in range(kept, w.groups):
        ls.dirty[s] = 1
    if not ls.impulses_stored:
        clear_chains(w, ls)
    if ls.listed:
        each_group(w, keep_stage)
    ls.impulses_stored, ls.listed = True, kept > 0


@kernel
def extent_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Compute the bounds of a block of particles."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    measure_extent(w.cells, item)


@kernel
def momenta_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Sum the velocities of free particles of a block."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    c: cython.pointer(Cells) = w.cells
    x: cython.double = 0
    y: cython.double = 0
    free: cython.double = 0
    i: cython.Py_ssize_t
    for i in range(item * BLOCK, min((item + 1) * BLOCK, w.count)):
        if w.inverse_mass[i] > 0:
            x, y, free = x + c.velocity[c.stride * i], y + c.velocity[c.stride * i + 1], free + 1
    w.lists.momenta[3 * item], w.lists.momenta[3 * item + 1], w.lists.momenta[3 * item + 2] = x, y, free


@kernel
def speeds_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Compute the largest squared speed in a block relative to the mean."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    c: cython.pointer(Cells) = w.cells
    most: real = 0
    i: cython.Py_ssize_t
    for i in range(item * BLOCK, min((item + 1) * BLOCK, w.count)):
        x: real = c.velocity[c.stride * i] - c.common_x
        y: real = c.velocity[c.stride * i + 1] - c.common_y
        most = x * x + y * y if x * x + y * y > most else most
    w.lists.speeds[item] = most


@kernel
def fastest_in_common(w: cython.pointer(Step), c: cython.pointer(Cells), blocks: cython.int) -> cython.double:
    """Largest speed relative to the mean of free particles, m/s: a common velocity brings no pair closer."""
    b: cython.int
    x: cython.double = 0
    y: cython.double = 0
    free: cython.double = 0
    most: cython.double = 0
    team_stage(w.team, momenta_stage, w, blocks)
    for b in range(blocks):
        x, y, free = x + w.lists.momenta[3 * b], y + w.lists.momenta[3 * b + 1], free + w.lists.momenta[3 * b + 2]
    c.common_x, c.common_y = cython.cast(real, x / max(free, 1)), cython.cast(real, y / max(free, 1))
    team_stage(w.team, speeds_stage, w, blocks)
    for b in range(blocks):
        most = max(most, w.lists.speeds[b])
    return sqrt(most)


@kernel
def list_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """List the pairs of a group, arrange batches, and fill in materials and contact state."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    ls: cython.pointer(Lists) = w.lists
    s: cython.Py_ssize_t = 2 * item + w.parity
    alone: cython.bint = s == ls.rows
    found: int64_t
    if not ls.dirty[s]:
        return
    number: cython.int = team_take_number(w.team)
    low: int64_t = number * ls.scratch_capacity
    capacity: int64_t = low + ls.scratch_capacity
    if ls.brute and alone:
        found = list_all(w.cells, ls, w.inverse_mass, low, capacity)
    elif alone:
        found = list_alone(w.cells, ls, w.inverse_mass, low, capacity)
    else:
        found = list_rows(w.cells, ls, w.inverse_mass, s, low, capacity)
    ls.found[s] = found - low
    w.lanes[s] = w.swept[s] = 0
    if found <= capacity:
        w.lanes[s] = put_batches(w, ls, w.cells, s, alone, low, found, capacity) - low
        if w.lanes[s] <= ls.scratch_capacity and place_lanes(w, ls, s, low):
            fill_lanes(w, ls, s)
            find_sources(w, ls, s)
            count_far(w, ls, w.cells, s)
    team_give_number(w.team, number)


@kernel
def fill_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Fill in the materials of a group's pairs."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    fill_lanes(w, w.lists, 2 * item + w.parity)


@kernel
def listed_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Store the positions of a block at which it is listed."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    k: cython.Py_ssize_t
    for k in range(2 * item * BLOCK, min(2 * (item + 1) * BLOCK, 2 * w.count)):
        w.listed[k] = w.checked[k] = w.cells.position[k]
        w.moved[k] = 0


@kernel
def checked_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Store the expected positions of a block, which have been checked against the list."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    i: cython.Py_ssize_t
    if w.still_known and w.still[item]:
        return
    for i in range(item * BLOCK, min((item + 1) * BLOCK, w.count)):
        w.checked[2 * i] = w.listed[2 * i] + way_of(w, i, 0)
        w.checked[2 * i + 1] = w.listed[2 * i + 1] + way_of(w, i, 1)


@kernel
def bound_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Compute the bounds of displacements in a row of patches."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    bound_moves(w, w.cells, item)


@kernel
def widen_cells(c: cython.pointer(Cells), blocks: cython.int) -> cython.double:
    """Set `widest` to the reach of all but a few of the particles that move farther than the skin.

    Returns an estimate of the number of pairs between these and what they may meet.
    """
    i: cython.Py_ssize_t
    octave: cython.int
    farther: cython.Py_ssize_t[16]  # OCTAVES: number of particles that reach farther than 2^k times the largest in cells
    e: Extent = whole_extent(c, blocks)
    pairs: cython.double = 0
    for octave in range(OCTAVES):
        farther[octave] = 0
    for i in range(c.count):
        reach: cython.double = reach_of(c, i)
        if reach > c.radius[i]:
            pairs += c.count * min(1.0, 2 * reach / (e.x1 - e.x0 + reach)) * min(1.0, 2 * reach / (e.y1 - e.y0 + reach))
        if c.radius[i] <= c.bulk:
            octave = 0
            while octave < OCTAVES and reach > c.widest * (1 << octave):
                farther[octave] += 1
                octave += 1
    octave = 0
    while octave < OCTAVES - 1 and farther[octave] > max(FEW_FAR, c.count // FAR_ALONE):
        octave += 1
    c.widest = c.widest * (1 << octave)
    return pairs


@kernel
def shorter_period(c: cython.pointer(Cells)) -> cython.double:
    """The shorter period of a periodic room, m; infinite otherwise."""
    return min(c.period_x if c.period_x > 0 else INFINITY, c.period_y if c.period_y > 0 else INFINITY)


@kernel
def thickest_skin(c: cython.pointer(Cells), ls: cython.pointer(Lists)) -> cython.double:
    """Largest skin for which pairs in a periodic room have one near image only, m."""
    return max(0.5 * shorter_period(c) - 2 * ls.largest, 0.0)


@kernel
def choose_skin(w: cython.pointer(Step), c: cython.pointer(Cells), ls: cython.pointer(Lists), blocks: cython.int) -> cython.void:
    """Choose the skin of the next list: the adapted one, or more if particles are fast."""
    fastest: cython.double = fastest_in_common(w, c, blocks)
    skin: cython.double = ls.diameters * 2 * ls.mean_radius
    if ls.adapts:
        skin = max(skin, min(FAST * w.h * fastest, MOST_FAST * 2 * ls.mean_radius))
    rounding: cython.double = 0
    if c.period_x > 0 or c.period_y > 0:
        skin = min(skin, thickest_skin(c, ls))
        x: cython.double = abs(c.low_x) + 2 * c.period_x
        y: cython.double = abs(c.low_y) + 2 * c.period_y
        rounding = ROUNDINGS * (2.3e-16 if cython.sizeof(real) == 8 else 1.2e-7) * max(x, y)
    ls.half_skin = 0.5 * skin
    c.skin = cython.cast(real, skin + rounding)
    c.pace = cython.cast(real, 0.5 * FAST * w.h)
    c.farthest, c.widest = cython.cast(real, 0.5 * (shorter_period(c) - c.skin) - ls.largest), c.bulk
    if c.pace * fastest <= 0.5 * c.skin or ls.brute or widen_cells(c, blocks) > MOST_FAR * w.count + 1000:
        c.pace, c.widest = 0, c.bulk


@kernel
def make_list(w: cython.pointer(Step), again: cython.bint) -> cython.bint:
    """Make the pair list for the current positions. False: arrays are too small; call again with larger ones.

    again: with the same skin and the positions at the last listing: the same list, but for particles added or removed. Groups
    without such changes are kept.
    """
    c: cython.pointer(Cells) = w.cells
    ls: cython.pointer(Lists) = w.lists
    blocks: cython.int = cython.cast(cython.int, (w.count + BLOCK - 1) // BLOCK)
    s: cython.Py_ssize_t
    same: cython.bint = again and ls.listed and not ls.anew
    ls.good, ls.short = False, ls.lanes_capacity == 0
    if ls.short:
        return False
    c.velocity, c.stride = (w.motion, 4) if w.rough else (w.velocity, 2)
    team_stage(w.team, extent_stage, w, blocks)
    if again:
        c.pace, c.widest = 0, c.bulk
    else:
        choose_skin(w, c, ls, blocks)
    same &= fit_cells(c, blocks)
    lay_patches(c)
    sort_cells(w)
    groups: cython.Py_ssize_t = cut_rows(c, ls)
    kept: cython.Py_ssize_t = kept_groups(ls, groups) if same else 0
    while True:
        store_impulses(w, kept)
        ls.tied = ls.tied and kept > 0
        lay_groups(w, c, ls, kept, groups)
        each_group(w, list_stage)
        ls.most = most_in_group(w, ls)
        ls.short = ls.most > ls.scratch_capacity or team_reserved(w.team) > ls.lanes_capacity
        if not ls.short:
            break
        for s in range(w.groups):
            w.lanes[s] = 0 if ls.dirty[s] else w.lanes[s]  # their state is still stored in chains
        if kept == 0:
            return False
        kept = 0
        team_stage(w.team, spots_stage, w, buckets_of(c))  # no longer in batches
    take_over(w)
    for s in range(w.groups):
        ls.dirty[s] = 0
    fill_alike(w, ls)
    looked: int64_t = 0
    beyond: int64_t = 0
    pairs: int64_t = 0
    for s in range(w.groups):
        looked, beyond, pairs = looked + ls.looked[s], beyond + ls.beyond[s], pairs + ls.found[s]
    ls.excess = cython.cast(cython.double, beyond) / max(looked, 1) * pairs / max(w.count, 1)
    if not again:
        team_stage(w.team, listed_stage, w, blocks)
        w.allowed = cython.cast(real, ls.half_skin * ls.half_skin)
        ls.age = 0
    ls.rebuilds += kept == 0
    ls.listed, ls.good, ls.impulses_stored, ls.refill = True, True, False, ls.refill and kept > 0
    ls.patching = ls.anew = w.pins = False
    for s in range(w.groups):
        w.pins |= w.lanes[s] > w.swept[s]
    find_busy(w)
    return True


@kernel
def remake_list(what: cython.p_void, item: cython.int) -> cython.void:
    """Make the list for the positions at the last listing; new particles are listed at their current ones.

    If the list has been checked since, the next substep must check again whether others have moved relative to new ones.
    """
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    c: cython.pointer(Cells) = w.cells
    ls: cython.pointer(Lists) = w.lists
    i: cython.Py_ssize_t
    come: cython.bint = False
    for i in range(w.count):
        if isnan(w.listed[2 * i]):
            w.listed[2 * i] = w.checked[2 * i] = w.position[2 * i]
            w.listed[2 * i + 1] = w.checked[2 * i + 1] = w.position[2 * i + 1]
            come = True
            if ls.listed:
                mark_dirty(c, ls, i, w.position[2 * i], w.position[2 * i + 1])
    if come and w.allowed != cython.cast(real, ls.half_skin * ls.half_skin):
        w.allowed = -1
    ls.good = 2 * ls.half_skin <= thickest_skin(c, ls)  # a new particle may be larger than all others
    c.position = w.listed
    if w.collides and ls.good:
        make_list(w, True)
    c.position = w.position


@inlined
def renumbered(ls: cython.pointer(Lists), sorted_index: uint32_t) -> uint32_t:
    """The new number of a row."""
    if sorted_index == GONE or ls.place[sorted_index] < 0:
        return GONE
    return cython.cast(uint32_t, ls.place[sorted_index])


@kernel
def renumber_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Renumber the rows of a group's pairs, after particles were added or removed."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    s: cython.Py_ssize_t = 2 * item + w.parity
    k: int64_t
    for k in range(w.begin[s], w.begin[s] + w.lanes[s]):
        w.i[k], w.j[k] = renumbered(w.lists, w.i[k]), renumbered(w.lists, w.j[k])


@kernel
def renumber_lanes(what: cython.p_void, item: cython.int) -> cython.void:
    """Renumber the rows of all pairs."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    each_group(w, renumber_stage)


@kernel
def renew_list(w: cython.pointer(Step)) -> cython.bint:
    """After particles have moved far: rebuild the list if neighbours have moved relative to each other."""
    ls: cython.pointer(Lists) = w.lists
    team_stage(w.team, bound_stage, w, cython.cast(cython.int, w.cells.patches_v))
    slack: cython.double = slack_left(w, w.cells, 2 * ls.half_skin)
    if slack > WORTH_LOOKING * ls.half_skin:
        team_stage(w.team, checked_stage, w, cython.cast(cython.int, (w.count + BLOCK - 1) // BLOCK))
        w.allowed = cython.cast(real, 0.25 * slack * slack)
        return True
    adapt_skin(w, ls)
    return make_list(w, False)
