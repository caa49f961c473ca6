# mypy: ignore-errors
"""Groups of cell rows whose pairs are listed and solved together."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int64_t
from cython.cimports.team import team_function, team_reserve_from, team_stage

from pyverlet.core.cells import Cells, cell_number, level_of
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pair_lists import Lists
from pyverlet.core.periodic import wrapped
from pyverlet.core.step import Step

GROUP = cython.declare(cython.int, 256)
"""Least particles per group: below it, synchronising threads costs more than it saves."""


@kernel
def cut_rows(c: cython.pointer(Cells), ls: cython.pointer(Lists)) -> cython.Py_ssize_t:
    """Cut the rows into groups of at least GROUP particles; returns the number of groups.

    In a periodic room the last group writes to the first, so it must be an odd one, or the only one.
    """
    groups: cython.Py_ssize_t = 0
    before: int64_t = 0
    row: int64_t
    level: cython.int
    ls.cut[0] = 0
    for row in range(1, c.height[0] + 1):
        held: int64_t = -before
        for level in range(c.levels):
            base: int64_t = c.base[level]
            held += c.start[base + (row << c.shift[level]) * c.width[level]] - c.start[base]
        if held >= GROUP or row == c.height[0]:
            ls.held[groups] = held
            groups += 1
            ls.cut[groups] = row
            before += held
    if c.wraps_v and groups > 1 and groups % 2 == 1:
        groups -= 1
        ls.cut[groups] = c.height[0]
        ls.held[groups - 1] += ls.held[groups]
    return groups


@kernel
def kept_groups(ls: cython.pointer(Lists), groups: cython.Py_ssize_t) -> cython.Py_ssize_t:
    """How many of the new groups, from the first on, are unchanged."""
    s: cython.Py_ssize_t = 0
    while s < groups and s < ls.rows and ls.cut[s + 1] == ls.row[s + 1]:
        s += 1
    if ls.cut[groups] != ls.row[ls.rows]:  # particles beyond all rows are in the last
        s = max(min(s, ls.rows - 2, groups - 2), 0)
    return s


@kernel
def lay_groups(
    w: cython.pointer(Step),
    c: cython.pointer(Cells),
    ls: cython.pointer(Lists),
    kept: cython.Py_ssize_t,
    groups: cython.Py_ssize_t,
) -> cython.void:
    """Set up the new groups without lanes, except for the first ones, which are kept."""
    s: cython.Py_ssize_t
    for s in range(kept, groups):
        ls.row[s], ls.row[s + 1] = ls.cut[s], ls.cut[s + 1]
    ls.rows = groups
    w.groups = groups + 1 if c.celled < c.count else groups
    for s in range(kept, w.groups):
        ls.dirty[s], w.lanes[s], ls.held_lanes[s] = 1, 0, 0
    if kept == 0:
        team_reserve_from(w.team, 0)


@kernel
def mark_dirty(c: cython.pointer(Cells), ls: cython.pointer(Lists), i: cython.Py_ssize_t, x: real, y: real) -> cython.void:
    """Mark the groups that contain pairs of particle i, which was added or removed at its listed position (x, y)."""
    level: cython.int = level_of(c, c.radius[i]) if c.levels > 1 else 0
    low_v: cython.double = c.low_x if c.swapped else c.low_y
    v: real = wrapped(x if c.swapped else y, low_v, c.period_v)
    row: int64_t = cell_number((v - c.v0) * c.along[level], c.height[level]) >> c.shift[level]
    s: cython.Py_ssize_t = 0
    while s + 1 < ls.rows and ls.row[s + 1] <= row:
        s += 1
    ls.dirty[s] = ls.dirty[ls.rows] = 1
    if row == ls.row[s]:
        if s > 0:
            ls.dirty[s - 1] = 1
        elif c.wraps_v:
            ls.dirty[ls.rows - 1] = 1


@inlined
def most_in_group(w: cython.pointer(Step), ls: cython.pointer(Lists)) -> int64_t:
    """Pairs, or lanes, for which each thread needs scratch memory."""
    most: int64_t = 0
    s: cython.Py_ssize_t
    for s in range(w.groups):
        most = max(most, ls.found[s], w.lanes[s])
    return most


@kernel
def each_group(w: cython.pointer(Step), function: team_function) -> cython.void:
    """Call `function(w, item)` for all groups; it handles group 2 item + w.parity: even ones, odd ones, and the last."""
    rows: cython.Py_ssize_t = w.lists.rows
    w.parity = 0
    team_stage(w.team, function, w, cython.cast(cython.int, (rows + 1) // 2))
    if rows > 1:
        w.parity = 1
        team_stage(w.team, function, w, cython.cast(cython.int, rows // 2))
    if w.groups > rows:
        w.parity = rows
        team_stage(w.team, function, w, 1)


@inlined
def busy_group(w: cython.pointer(Step), item: cython.int) -> cython.Py_ssize_t:
    """The group of an item of `each_busy`."""
    return w.busy[w.busy_from + item]


@kernel
def each_busy(w: cython.pointer(Step), function: team_function) -> cython.void:
    """Call `function(w, item)` for all groups that have pairs; the group is `busy_group(w, item)`."""
    w.busy_from = 0
    team_stage(w.team, function, w, w.evens)
    w.busy_from = w.evens
    team_stage(w.team, function, w, w.odds)
    w.busy_from = w.evens + w.odds
    team_stage(w.team, function, w, w.alone)


@kernel
def find_busy(w: cython.pointer(Step)) -> cython.void:
    """List the groups that have pairs."""
    s: cython.Py_ssize_t
    found: cython.int = 0
    for s in range(0, w.lists.rows, 2):
        w.busy[found] = s
        found += w.lanes[s] > 0
    w.evens = found
    for s in range(1, w.lists.rows, 2):
        w.busy[found] = s
        found += w.lanes[s] > 0
    w.odds = found - w.evens
    w.alone = w.groups > w.lists.rows and w.lanes[w.lists.rows] > 0
    w.busy[found] = w.lists.rows
    for s in range(w.groups):
        w.bounced[s] = 0  # groups without pairs never change it
