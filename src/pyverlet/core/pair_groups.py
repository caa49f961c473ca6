# mypy: ignore-errors
"""Groups of cell rows, and the room that each has for its pairs."""

from __future__ import annotations

import cython
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.cells import Cells
from pyverlet.core.pair_lists import Lists
from pyverlet.core.step import Step

GROUP = cython.declare(cython.int, 256)
"""Least particles of a group of rows: below it, a meeting of threads costs more than it saves."""


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def cut_rows(w: cython.pointer(Step), c: cython.pointer(Cells), ls: cython.pointer(Lists)) -> cython.bint:
    """Cut the rows into groups of at least GROUP particles, with room for their pairs; whether all the room is there.

    Across the seam the last group writes to the first: it is an odd one, or the only.
    """
    groups: cython.Py_ssize_t = 0
    before: int64_t = 0
    row: int64_t
    level: cython.int
    ls.row[0] = 0
    for row in range(1, c.height[0] + 1):
        held: int64_t = -before
        for level in range(c.levels):
            base: int64_t = c.base[level]
            held += c.start[base + (row << c.shift[level]) * c.width[level]] - c.start[base]
        if held >= GROUP or row == c.height[0]:
            ls.found[groups] = held
            groups += 1
            ls.row[groups] = row
            before += held
    if c.wraps_v and groups > 1 and groups % 2 == 1:
        groups -= 1
        ls.row[groups] = c.height[0]
        ls.found[groups - 1] += ls.found[groups]
    lanes: int64_t = 0
    s: cython.Py_ssize_t
    for s in range(groups):
        w.begin[s] = lanes
        lanes += cython.cast(int64_t, ls.per_particle * ls.found[s]) // 8 * 8 + 192
    ls.rows = w.groups = groups
    if c.celled < c.count:
        w.begin[groups] = lanes
        lanes += 8 * cython.cast(int64_t, ls.alone_room)
        w.groups = groups + 1
    w.begin[w.groups] = lanes
    return lanes <= ls.lanes_room


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def has_room(w: cython.pointer(Step), ls: cython.pointer(Lists)) -> cython.bint:
    """Whether all pairs that were found had room; if not, how much there is to be is noted."""
    s: cython.Py_ssize_t
    for s in range(w.groups):
        room: int64_t = w.begin[s + 1] - w.begin[s]
        needed: int64_t = max(ls.found[s], w.lanes[s])
        if needed > room:
            factor: cython.double = 1.25 * needed / room
            if s == ls.rows:
                ls.alone_room *= factor
            else:
                ls.per_particle *= factor
            return False
    return True
