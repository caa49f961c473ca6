# mypy: ignore-errors
"""Where there is room for another circle."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_doubles, octets
from cython.cimports.libc.stdint import uint8_t

from pyverlet.core.periodic import nearest_in_double


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def overlap(
    a: cython.pointer[cython.const[cython.double]],
    i: cython.Py_ssize_t,
    b: cython.pointer[cython.const[cython.double]],
    j: cython.Py_ssize_t,
    reach: cython.double,
    period_x: cython.double,
    period_y: cython.double,
) -> cython.bint:
    """Whether row i of a is nearer than `reach` to row j of b."""
    dx: cython.double = nearest_in_double(b[2 * j] - a[2 * i], period_x)
    dy: cython.double = nearest_in_double(b[2 * j + 1] - a[2 * i + 1], period_y)
    return not dx * dx + dy * dy >= reach * reach


def mark_free_places(
    place, size, position, radius, period_x: cython.double, period_y: cython.double, wanted: cython.Py_ssize_t, taken
) -> int:
    """Mark in `taken` (k,) the first `wanted` of the places (k, 2) at which a circle of this size (k,) overlaps no other.

    That is: neither a circle that is there, `position` (n, 2) and `radius` (n,), nor one marked before. Returns how many. All
    arrays but `taken` are of float64.
    """
    at: cython.pointer[cython.const[cython.double]] = const_doubles(place)
    own: cython.pointer[cython.const[cython.double]] = const_doubles(size)
    x: cython.pointer[cython.const[cython.double]] = const_doubles(position)
    r: cython.pointer[cython.const[cython.double]] = const_doubles(radius)
    marked: cython.pointer(uint8_t) = octets(taken)
    places: cython.Py_ssize_t = len(size)
    count: cython.Py_ssize_t = len(radius)
    found: cython.Py_ssize_t = 0
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    with cython.nogil:
        for i in range(places):
            if found == wanted:
                break
            free: cython.bint = True
            for j in range(count):
                if overlap(at, i, x, j, r[j] + own[i], period_x, period_y):
                    free = False
                    break
            for j in range(i):
                if not free:
                    break
                free = not (marked[j] and overlap(at, i, at, j, own[j] + own[i], period_x, period_y))
            if free:
                marked[i] = 1
                found += 1
    return found
