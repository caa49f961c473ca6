# mypy: ignore-errors
"""Runs substeps one after the other, and keeps the lists of pairs and surfaces valid."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.team import team_enter, team_stage

from pyverlet.core.cells import BLOCK
from pyverlet.core.frame import substep
from pyverlet.core.frame_ends import begin_stage, end_stage, find_awake
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.list_age import adapt_skin, has_paid
from pyverlet.core.pair_groups import each_group
from pyverlet.core.pair_lists import Lists
from pyverlet.core.pair_materials import fill_alike
from pyverlet.core.relisting import fill_stage, listed_stage, make_list, renew_list
from pyverlet.core.spans import INTEGRATE, LISTS, OTHER, begin_spans
from pyverlet.core.step import Step
from pyverlet.core.surface_lists import list_surfaces
from pyverlet.core.waking import find_met


@kernel
def moved_far_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Whether the pair list may be invalid for a particle of a block in the first substep."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    i: cython.Py_ssize_t
    found: cython.bint = False
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    if not (w.still_known and w.still[block]):
        for i in range(block * BLOCK, min((block + 1) * BLOCK, w.count)):
            dx: real = w.position[2 * i] + w.h * v[width * i] - w.checked[2 * i]
            dy: real = w.position[2 * i + 1] + w.h * v[width * i + 1] - w.checked[2 * i + 1]
            found |= not (dx * dx + dy * dy <= w.allowed)
    w.stale[block] = found


@kernel
def any_moved_far(w: cython.pointer(Step)) -> cython.bint:
    """Whether the pair list may be invalid in the first substep."""
    found: cython.bint = False
    blocks: cython.int = cython.cast(cython.int, (w.count + BLOCK - 1) // BLOCK)
    team_stage(w.team, moved_far_stage, w, blocks)
    for b in range(blocks):
        found |= w.stale[b] != 0
        w.stale[b] = 0  # later substeps set it for particles that move
    return found


@inlined
def waits(w: cython.pointer(Step)) -> cython.bint:
    """Whether records of the current lists must be saved before they are made anew."""
    w.waiting = (w.records_events or w.records_contacts) and not w.collected
    w.lists.short = w.waiting
    return w.waiting


@kernel
def look_anew(w: cython.pointer(Step), whole: cython.bint) -> cython.bint:
    """Update the pair list after particles have moved far, or make it (`whole`). False: arrays are too small."""
    ls: cython.pointer(Lists) = w.lists
    blocks: cython.int = cython.cast(cython.int, (w.count + BLOCK - 1) // BLOCK)
    if waits(w):
        return False
    w.surfaces_good, ls.stale = False, False
    if w.collides:
        return make_list(w, False) if whole else renew_list(w)
    ls.half_skin = 0.5 * ls.largest
    w.allowed = cython.cast(real, ls.half_skin * ls.half_skin)
    team_stage(w.team, listed_stage, w, blocks)
    ls.good = True
    return True


@kernel
def see_surfaces(w: cython.pointer(Step)) -> cython.bint:
    """List surfaces near particles. False: there are too few places."""
    if waits(w):
        return False
    w.margin = cython.cast(real, 2 * w.lists.half_skin)
    w.lists.short = not list_surfaces(w)
    return not w.lists.short


@kernel
def refresh(w: cython.pointer(Step)) -> cython.bint:
    """Make lists of pairs and surfaces valid for the first substep. False: arrays are too small."""
    ls: cython.pointer(Lists) = w.lists
    if not ls.good:
        if not look_anew(w, True):
            return False
    elif w.collides and w.substep == 0 and has_paid(w, ls):
        adapt_skin(w, ls)
        if not look_anew(w, True):
            return False
    else:
        if ls.refill and w.collides:
            fill_alike(w, ls)
            each_group(w, fill_stage)
            ls.refill = False
        stale: cython.bint = ls.stale if w.substep > 0 else False
        if not stale and (w.substep == 0 or not w.falls_free):
            stale = any_moved_far(w)
        if stale and not look_anew(w, False):
            return False
    return True if w.surfaces_good else see_surfaces(w)


@kernel
def refresh_lists(what: cython.p_void, item: cython.int) -> cython.void:
    """Make lists valid for the coming substep, unless arrays are too small."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    i: cython.Py_ssize_t
    b: cython.Py_ssize_t
    for b in range((w.count + BLOCK - 1) // BLOCK if w.rough else 0):
        if w.still_known and w.still[b]:
            continue
        for i in range(b * BLOCK, min((b + 1) * BLOCK, w.count)):
            w.motion[4 * i], w.motion[4 * i + 1] = w.velocity[2 * i], w.velocity[2 * i + 1]
    refresh(w)


@kernel
def run_substeps(what: cython.p_void, item: cython.int) -> cython.void:
    """Run substeps until all are done, an awake particle touches a sleeper, or arrays are too small for a list."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    blocks: cython.int = cython.cast(cython.int, (w.count + BLOCK - 1) // BLOCK)
    if w.substep == w.first:
        begin_spans(w.team, w.count)
        team_enter(w.team, INTEGRATE)
        w.still_known = w.still_known and w.falls_free
        team_stage(w.team, begin_stage, w, blocks)
        find_awake(w, blocks)
    team_enter(w.team, LISTS)
    going: cython.bint = refresh(w)
    if going and w.substep == w.first:
        w.still_made += not w.still_known
        w.still_known = w.falls_free
    while going and w.substep < w.substeps and not (w.watches and w.falls_free and find_met(w)):
        w.lists.stale = substep(w, blocks) or w.cells.pace > 0
        w.substep += 1
        w.collected = False
        w.lists.age += 1
        if w.lists.stale and w.substep < w.substeps:
            team_enter(w.team, LISTS)
            going = look_anew(w, w.cells.pace > 0) and see_surfaces(w)
    if going:
        team_enter(w.team, INTEGRATE)
        team_stage(w.team, end_stage, w, blocks)
        w.lists.good = w.lists.good and w.cells.pace == 0
    team_enter(w.team, OTHER)
