# mypy: ignore-errors
"""Impacts of linked particles: what is recorded of each, so that everything joined by rigid links takes part.

Each surface contact and each pair that had an impact has a row of numbers. Velocities in it are those of the particle away from
the surface, or of j from i, along the normal of the impact.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.step import Step

REBOUND = cython.declare(cython.int, 17)
WAY_OUT = cython.declare(cython.int, 0)  # (2) outward normal
AIM = cython.declare(cython.int, 2)  # target m/s along it; at first what the impact itself has left
ELASTICITY = cython.declare(cython.int, 3)  # e
STRUCK = cython.declare(cython.int, 4)  # impulse of the impact without links, m/s
FORMER = cython.declare(cython.int, 5)  # m/s along the normal before the impact
STRUCK_AT = cython.declare(cython.int, 6)  # s into the substep
STAMP = cython.declare(cython.int, 7)  # as in `Step`: rows with other numbers are outdated
IN_LIST = cython.declare(cython.int, 8)  # for pairs: whether it is in the list of its group
KEPT = cython.declare(cython.int, 9)  # fraction of an impulse that its particles keep; 0: other impacts have made it fast enough
LACKS = cython.declare(cython.int, 10)  # m/s missing
TRIED = cython.declare(cython.int, 11)  # last impulse, m/s
GAINED = cython.declare(cython.int, 12)  # change of velocity by it
LAST = cython.declare(cython.int, 13)  # velocity after it
IMPACT_WAY = cython.declare(cython.int, 14)  # (2) the normal at the time of the whole impact, which STRUCK_AT is then
ADDED = cython.declare(cython.int, 16)  # impulses beyond STRUCK, m/s

FIRST_LACK = cython.declare(cython.int, 0)
MEASURE_GAIN = cython.declare(cython.int, 1)
LACK_LESS = cython.declare(cython.int, 2)
STRIKE_MORE = cython.declare(cython.int, 3)
UNDO_ALL = cython.declare(cython.int, 4)
"""Tasks for rows: see `core.shared_impacts`."""

IMPACT = cython.declare(cython.int, 4)
"""Columns of a linked particle: its velocity change by impacts (2), and what links remove from its velocity before them."""

LEAST_KEPT = cython.declare(cython.double, 1.0 / 64)
"""Least fraction of an impulse kept: nets are taken to be no heavier than that."""

NO_GAIN = cython.declare(cython.double, 1e-4)
"""Impulses that change their own velocity by less than this fraction are ignored."""

GOOD = cython.declare(cython.double, 1e-9 if cython.sizeof(real) == 8 else 1e-5)
"""Relative tolerance of the missing velocities."""


@inlined
def node_of(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Number of particle i among linked ones, if a rigid link or pin acts on it; -1: none."""
    k: cython.pointer(Links) = w.link_table
    n: cython.Py_ssize_t = w.node[i]
    return n if n < k.count and cython.cast(cython.Py_ssize_t, k.sorted_index[n]) == i and k.stiff[n] != 0 else -1


@kernel
def store_rebound(
    w: cython.pointer(Step), row: cython.pointer(cython.double), at: cython.Py_ssize_t, x: cython.double, y: cython.double,
    speed: cython.double, given: cython.double, e: cython.double, t: cython.double,
) -> cython.void:  # fmt: skip
    """Record an impact at time t with the impulse `given` along (x, y), after which the velocity there is `speed`."""
    if row[at + STAMP] != w.stamp:
        row[at + IN_LIST] = 0
    row[at + WAY_OUT], row[at + WAY_OUT + 1], row[at + AIM], row[at + ELASTICITY] = x, y, speed, e
    row[at + STRUCK], row[at + FORMER], row[at + STRUCK_AT], row[at + STAMP] = given, speed - given, t, w.stamp


@inlined
def take_aim(
    row: cython.pointer(cython.double), at: cython.Py_ssize_t, speed: cython.double, taken: cython.double, extra: cython.double,
    at_once: cython.bint,
) -> cython.void:  # fmt: skip
    """Compute the target velocity of a row after all impacts, which have left `speed`.

    Links remove `taken` from the velocity before, which therefore did not hit the surface; nor did `extra`, which links were
    assumed to give from the middle of the substep to the impact. at_once: `speed` excludes `taken`. Reductions by other impacts
    are kept. Particles that would not approach once links have acted have no impact.
    """
    since: cython.double = speed - row[at + AIM] - (taken if at_once else 0.0)
    row[at + KEPT] = 0 if since > GOOD * row[at + STRUCK] else 1
    row[at + AIM] += min(since, 0.0) - (1 + row[at + ELASTICITY]) * (taken - extra)
    parts: cython.bint = row[at + FORMER] + taken - extra > 0  # links alone separate them
    if at_once:
        row[at + AIM] += taken
        row[at + FORMER] += taken
    if parts:
        row[at + AIM] = row[at + FORMER] + min(since, 0.0)


@kernel
def advance_row(
    w: cython.pointer(Step), row: cython.pointer(cython.double), at: cython.Py_ssize_t, speed: cython.double,
    mass: cython.double, part: cython.Py_ssize_t,
) -> cython.double:  # fmt: skip
    """The impulse for a row of this mass in the current task, m/s; its sums are added to those of a part."""
    if w.rebound_task == FIRST_LACK:
        lacks: cython.double = row[at + AIM] - speed
        kept: cython.double = min(max((speed - row[at + FORMER]) / row[at + STRUCK], LEAST_KEPT), 1.0)
        row[at + KEPT] = 0 if row[at + KEPT] == 0 and lacks <= 0 else kept
        row[at + LACKS] = lacks if row[at + KEPT] > 0 else 0
        row[at + TRIED] = row[at + GAINED] = row[at + ADDED] = 0
        row[at + LAST] = speed
        w.rebound_sum[2 * part] += mass * row[at + LACKS] * row[at + LACKS] / kept
        w.rebound_sum[2 * part + 1] += mass * row[at + STRUCK] * row[at + STRUCK]
    elif w.rebound_task == UNDO_ALL:
        return -row[at + ADDED]
    elif w.rebound_task == MEASURE_GAIN:
        row[at + GAINED] = speed - row[at + LAST] - (w.rebound_step - 1) * row[at + GAINED]
        row[at + LAST] = speed
        if fabs(row[at + GAINED]) <= NO_GAIN * fabs(row[at + TRIED]):
            row[at + KEPT] = row[at + LACKS] = row[at + TRIED] = 0
        else:
            w.rebound_sum[2 * part] += mass * row[at + TRIED] * row[at + GAINED]
            w.rebound_sum[2 * part + 1] += (
                mass * row[at + LACKS] * row[at + LACKS] / row[at + KEPT] if row[at + KEPT] > 0 else 0.0
            )
    elif row[at + KEPT] > 0:
        if w.rebound_task == LACK_LESS:
            row[at + LACKS] -= w.rebound_step * row[at + GAINED]
            w.rebound_sum[2 * part] += mass * row[at + LACKS] * row[at + LACKS] / row[at + KEPT]
        else:
            more: cython.double = (w.rebound_step - 1) * row[at + TRIED]
            row[at + TRIED] = row[at + LACKS] / row[at + KEPT] + w.rebound_turn * row[at + TRIED] if w.rebound_turn >= 0 else 0
            row[at + ADDED] += more + row[at + TRIED]
            return more + row[at + TRIED]
    return 0.0
