# mypy: ignore-errors
"""A number for each group of cell rows: in which of them, or next to it, something has happened."""

from __future__ import annotations

import cython
from cython.cimports.libc.stdint import int32_t

from pyverlet.core.kernels import kernel
from pyverlet.core.step import Step


@kernel
def any_beyond(
    number: cython.pointer(int32_t), begin: cython.Py_ssize_t, end: cython.Py_ssize_t, bound: int32_t
) -> cython.bint:  # fmt: skip
    """Whether the number of any group from `begin` to `end` is above the bound."""
    found: cython.bint = False
    k: cython.Py_ssize_t
    for k in range(begin, end):
        found |= number[k] > bound
    return found


@kernel
def any_around(w: cython.pointer(Step), s: cython.Py_ssize_t, number: cython.pointer(int32_t), bound: int32_t) -> cython.bint:
    """Whether the number of group s is above the bound, or that of a group that shares particles with it."""
    rows: cython.Py_ssize_t = w.lists.rows
    if s == rows:  # circles that stand in no cell may meet any
        return any_beyond(number, 0, w.groups, bound)
    found: cython.bint = any_beyond(number, max(s - 1, 0), min(s + 2, rows), bound)
    if w.cells.wraps_v and (s == 0 or s + 1 == rows):
        found |= number[rows - 1 if s == 0 else 0] > bound
    return found or (w.groups > rows and number[rows] > bound)
