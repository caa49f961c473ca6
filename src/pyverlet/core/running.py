# mypy: ignore-errors
"""Substeps one after the other, with a list of pairs that is good in each."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.team import team_stage

from pyverlet.core.cells import BLOCK
from pyverlet.core.frame import substep
from pyverlet.core.frame_ends import begin_stage, end_stage
from pyverlet.core.list_age import adapt_skin, has_paid
from pyverlet.core.pair_lists import Lists
from pyverlet.core.pair_materials import fill_alike
from pyverlet.core.relisting import each_group, fill_stage, make_list, renew_list
from pyverlet.core.step import Step


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def strays(w: cython.pointer(Step)) -> cython.bint:
    """Whether a particle may leave where the list of pairs is good in the first substep."""
    i: cython.Py_ssize_t
    found: cython.bint = False
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    for i in range(w.count):
        dx: real = w.position[2 * i] + w.h * v[width * i] - w.checked[2 * i]
        dy: real = w.position[2 * i + 1] + w.h * v[width * i + 1] - w.checked[2 * i + 1]
        found |= not (dx * dx + dy * dy <= w.allowed)
    return found


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def refresh(w: cython.pointer(Step)) -> cython.bint:
    """Have a list of pairs that is good for the first substep. False: arrays are too small for it."""
    ls: cython.pointer(Lists) = w.lists
    if not w.collides:
        return True
    if not ls.good:
        return make_list(w, False)
    if w.substep == 0 and has_paid(w, ls):
        adapt_skin(w, ls)
        return make_list(w, False)
    if ls.refill:
        fill_alike(w, ls)
        each_group(w, fill_stage)
        ls.refill = False
    stale: cython.bint = ls.stale if w.substep > 0 else False
    if not stale and (w.substep == 0 or not w.falls_free):
        stale = strays(w)
    return renew_list(w) if stale else True


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def run_substeps(what: cython.p_void, item: cython.int) -> cython.void:
    """Substeps until all are done, or arrays are too small for a list of pairs."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    blocks: cython.int = cython.cast(cython.int, (w.count + BLOCK - 1) // BLOCK)
    if w.substep == w.first:
        team_stage(w.team, begin_stage, w, blocks)
    going: cython.bint = refresh(w)
    while going and w.substep < w.substeps:
        w.lists.stale = substep(w, blocks)
        w.substep += 1
        w.lists.age += 1
        if w.lists.stale and w.collides and w.substep < w.substeps:
            going = renew_list(w)
    if going:
        team_stage(w.team, end_stage, w, blocks)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def remake_list(what: cython.p_void, item: cython.int) -> cython.void:
    """The list of pairs for saved positions, with the skin of then."""
    make_list(cython.cast(cython.pointer(Step), what), True)
