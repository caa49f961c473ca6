# mypy: ignore-errors
"""Impacts of linked particles: what is stored of each, for it to become that of all that hangs on the particle.

A row of numbers stands for each contact of a particle with a surface, and for each pair, that has bounced. The velocity that it
is about is that of the particle away from the surface, or of j from i, along the normal of the impact.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import fabs

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.step import Step

REBOUND = cython.declare(cython.int, 17)
WAY_OUT = cython.declare(cython.int, 0)  # (2) the normal
AIM = cython.declare(cython.int, 2)  # m/s along it, after all; at first what the impact itself has left
ELASTICITY = cython.declare(cython.int, 3)  # e
STRUCK = cython.declare(cython.int, 4)  # what the impact gave, as if nothing hung on its particles, m/s
FORMER = cython.declare(cython.int, 5)  # m/s along the normal before it
STRUCK_AT = cython.declare(cython.int, 6)  # s into the substep
STAMP = cython.declare(cython.int, 7)  # as in `Step`: others are of the past
IN_LIST = cython.declare(cython.int, 8)  # of pairs: whether it is in the list of its group
KEPT = cython.declare(cython.int, 9)  # share of an impact that its particles keep; 0: others have made it fast enough since
LACKS = cython.declare(cython.int, 10)  # m/s that it lacks
TRIED = cython.declare(cython.int, 11)  # what it has been given last, m/s
GAINED = cython.declare(cython.int, 12)  # what that changed of its velocity
LAST = cython.declare(cython.int, 13)  # its velocity then
IMPACT_WAY = cython.declare(cython.int, 14)  # (2) the normal at the time of the whole impact, which STRUCK_AT is then
ADDED = cython.declare(cython.int, 16)  # what it has been given beside STRUCK, m/s

FIRST_LACK = cython.declare(cython.int, 0)
MEASURE_GAIN = cython.declare(cython.int, 1)
LACK_LESS = cython.declare(cython.int, 2)
STRIKE_MORE = cython.declare(cython.int, 3)
UNDO_ALL = cython.declare(cython.int, 4)
"""What is done with rows: see `core.shared_impacts`."""

IMPACT = cython.declare(cython.int, 4)
"""Numbers of a linked particle: what impacts have changed of its velocity (2), and what links take from that of before them."""

LEAST_KEPT = cython.declare(cython.double, 1.0 / 64)
"""Of an impact: as heavy as what makes less of it is no net taken to be."""

NO_GAIN = cython.declare(cython.double, 1e-4)
"""Of an impact: what changes its own velocity less is of no use."""

GOOD = cython.declare(cython.double, 1e-9 if cython.sizeof(real) == 8 else 1e-5)
"""Of impacts: what may be missing."""


@inlined
def node_of(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """Which linked particle i is, by its number among these, if what links or pins it is rigid; -1: none."""
    k: cython.pointer(Links) = w.link_table
    n: cython.Py_ssize_t = w.node[i]
    return n if n < k.count and cython.cast(cython.Py_ssize_t, k.sorted_index[n]) == i and k.stiff[n] != 0 else -1


@kernel
def store_rebound(
    w: cython.pointer(Step), row: cython.pointer(cython.double), at: cython.Py_ssize_t, x: cython.double, y: cython.double,
    speed: cython.double, given: cython.double, e: cython.double, t: cython.double,
) -> cython.void:  # fmt: skip
    """An impact at time t has just given `given` along (x, y), along which its particles have `speed` now."""
    if row[at + STAMP] != w.stamp:
        row[at + IN_LIST] = 0
    row[at + WAY_OUT], row[at + WAY_OUT + 1], row[at + AIM], row[at + ELASTICITY] = x, y, speed, e
    row[at + STRUCK], row[at + FORMER], row[at + STRUCK_AT], row[at + STAMP] = given, speed - given, t, w.stamp


@inlined
def take_aim(
    row: cython.pointer(cython.double), at: cython.Py_ssize_t, speed: cython.double, taken: cython.double, extra: cython.double,
    at_once: cython.bint,
) -> cython.void:  # fmt: skip
    """The velocity that a row is to have, now that impacts are over, which have left `speed` of it.

    Links take `taken` from the velocity of before, along themselves: that has not met the surface; nor has `extra`, which they
    were taken to give from the middle of the substep to the impact. at_once: `speed` is without `taken`. What other impacts have
    taken since is theirs. Who would not come near with what links take has no impact.
    """
    since: cython.double = speed - row[at + AIM] - (taken if at_once else 0.0)
    row[at + KEPT] = 0 if since > GOOD * row[at + STRUCK] else 1
    row[at + AIM] += min(since, 0.0) - (1 + row[at + ELASTICITY]) * (taken - extra)
    parts: cython.bint = row[at + FORMER] + taken - extra > 0  # by links alone
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
    """What a row, of so large a mass, is to be given now, m/s; its sums are added to those of a part."""
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
