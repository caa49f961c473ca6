# mypy: ignore-errors
"""Operations on sorted keys of contacts."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_integers, integers, octets
from cython.cimports.libc.stdint import int64_t, uint8_t


def drop_repeated(keys) -> int:
    """Move the distinct keys, which ascend, to the front; returns their number."""
    a: cython.pointer(int64_t) = integers(keys)
    count: cython.Py_ssize_t = len(keys)
    n: cython.Py_ssize_t = 0
    with cython.nogil:
        for k in range(count):
            if n == 0 or a[k] != a[n - 1]:
                a[n] = a[k]
                n += 1
    return n


def mark_absent(keys, others, absent) -> int:
    """Set absent (n,) bool for keys that are not among the others; both ascend. Returns their number."""
    a: cython.pointer[cython.const[int64_t]] = const_integers(keys)
    b: cython.pointer[cython.const[int64_t]] = const_integers(others)
    to: cython.pointer(uint8_t) = octets(absent)
    count: cython.Py_ssize_t = len(keys)
    stop: cython.Py_ssize_t = len(others)
    at: cython.Py_ssize_t = 0
    n: cython.Py_ssize_t = 0
    with cython.nogil:
        for k in range(count):
            while at < stop and b[at] < a[k]:
                at += 1
            to[k] = at == stop or b[at] != a[k]
            n += to[k]
    return n
