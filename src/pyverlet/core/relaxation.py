# mypy: ignore-errors
"""Relaxation: sweeps without springs after the drift, which remove the speed at which overlaps were separated.

Two sweeps suffice for resting contacts. But the warm-start impulses of a jam still push after its impact is over, and two sweeps
do not remove that: blocks of discs separated with up to 15 % more energy than they had fallen with. So sweeps continue while
kinetic energy exceeds that before contacts, unless moving surfaces, or links, have added it.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY
from cython.cimports.team import team_enter, team_stage

from pyverlet.core.cells import BLOCK
from pyverlet.core.contacts import relax_contacts
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.links import relax_links
from pyverlet.core.pair_groups import busy_group, each_busy
from pyverlet.core.spans import RELAX
from pyverlet.core.step import Step
from pyverlet.core.surface_batches import TASK_RELAX, TASK_RELAX_AGAIN, solve_surfaces
from pyverlet.core.surface_rows import NORMAL, NORMAL_Y, PUSH, SPEED, SPEED_Y, row_of
from pyverlet.core.work import energy_of

MOST_SWEEPS = cython.declare(cython.int, 100)

LIVELY = cython.declare(cython.double, 4.0)
"""If no particle is faster than this multiple of the speed of resting contacts, two sweeps suffice."""

LEAST_GAIN = cython.declare(cython.double, 1e-5)
LINKED_GAIN = cython.declare(cython.double, 3e-3)
"""Allowed relative gain of kinetic energy. Eight substeps add no more than a frame may (`common.constants.SURPLUS`). With links,
velocities in the middle of a substep differ from those at its ends by the square of the angle turned."""

DEEP_PAIR = cython.declare(real, 0.1)
MANY_DEEP = cython.declare(cython.double, 0.03)
"""Overlap over contact distance, and fraction of touching pairs: beyond, it is a crowd, which separates by the speed that sweeps
would remove."""

STALLED = cython.declare(cython.double, 0.01)
"""Stop if a sweep removes less than this fraction of the excess energy, for example after contacts have opened."""


@inlined
def is_driven(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.bint:
    """Whether a moving surface has pushed particle i in this substep; motion along the surface counts only with friction."""
    row: cython.pointer(cython.double) = w.contact
    for k in range(w.contact_begin[i], w.contact_end[i]):
        at: cython.Py_ssize_t = row_of(k)
        if row[at + PUSH] != 0 or w.since[i] > 0:
            x: cython.double = row[at + SPEED]
            y: cython.double = row[at + SPEED_Y]
            if x * row[at + NORMAL] + y * row[at + NORMAL_Y] != 0 or (w.rough and (x != 0 or y != 0)):
                return True
    return False


@kernel
def motion_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Kinetic energy of a block of particles, J; after contacts -infinity if a moving surface has pushed any."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    block: cython.int = w.awake[item]
    n: cython.Py_ssize_t
    w.energy[block] = energy_of(w, block, 1, 0)
    if w.sweep >= 0:
        for n in range(block * BLOCK, block * BLOCK + w.at_surface_count[block]):
            if is_driven(w, w.at_surface[n]):
                w.energy[block] = -INFINITY
                break


@kernel
def energy_of_motion(w: cython.pointer(Step)) -> cython.double:
    """Kinetic energy of all awake particles, J."""
    total: cython.double = 0
    n: cython.int
    team_stage(w.team, motion_stage, w, w.awake_count)
    for n in range(w.awake_count):
        total += w.energy[w.awake[n]]
    return total


@kernel
def energy_before(w: cython.pointer(Step), fastest: cython.double) -> cython.double:
    """Limit for the kinetic energy after contacts, J: that before; infinite if no check is needed or possible."""
    w.sweep = -1
    if w.relaxes == 0 or w.restless or not fastest > LIVELY * w.rest_speed or (w.linked and w.link_table.gives):
        return INFINITY
    return energy_of_motion(w) * (1 + (LINKED_GAIN if w.linked else LEAST_GAIN))


@kernel
def is_crowded(w: cython.pointer(Step)) -> cython.bint:
    """Whether so many pairs overlap so much that they must be separated first."""
    k: cython.Py_ssize_t
    deep: cython.Py_ssize_t = 0
    touching: cython.Py_ssize_t = 0
    for s in range(w.groups):
        for k in range(w.begin[s], w.begin[s] + w.swept[s]):
            touching += w.depth[k] > 0
            deep += w.depth[k] > DEEP_PAIR * w.reach[k * w.sized]
    return deep > MANY_DEEP * touching


@kernel
def relax_surfaces_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Relax surface contacts of a block, in sweeps after the first."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    solve_surfaces(w, w.awake[item], TASK_RELAX if w.linked else TASK_RELAX_AGAIN)


@kernel
def relax_stage(what: cython.p_void, item: cython.int) -> cython.void:
    """Relax the contacts of a group."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    relax_contacts(w, busy_group(w, item))


@kernel
def relax(w: cython.pointer(Step), surfaces: cython.bint, most: cython.double) -> cython.void:
    """Run the relaxation sweeps, and more while the kinetic energy exceeds `most` J."""
    team_enter(w.team, RELAX)
    last: cython.double = INFINITY
    w.sweep = 0
    while w.sweep < MOST_SWEEPS:
        if w.sweep >= w.relaxes:
            now: cython.double = energy_of_motion(w) if most < INFINITY else 0
            if now <= most or (w.sweep == w.relaxes and is_crowded(w)) or last - now < STALLED * (now - most):
                break
            last = now
        if w.sweep > 0 and surfaces:
            team_stage(w.team, relax_surfaces_stage, w, w.awake_count)
        each_busy(w, relax_stage)
        if w.linked:
            relax_links(w, w.sweep % 2 == 1)
        w.sweep += 1
