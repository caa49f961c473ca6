# mypy: ignore-errors
"""How long particles have been at rest, and which islands may fall asleep."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_integers, const_reals, const_singles, integers, octets, singles
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int64_t, uint8_t

from pyverlet.core.islands import find_root, join_listed
from pyverlet.core.rest_timers import longer_at_rest


def time_at_rest(velocity, spin, radius, free, limit: real, dt: cython.float, after: cython.float, sleep_timer) -> bool:
    """sleep_timer[i] += dt for rows `free` whose speed, with the rim's, is at most sqrt(limit radius); otherwise set to 0.

    Returns whether any of them has been at rest for `after` seconds.
    """
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    w: cython.pointer[cython.const[real]] = const_reals(spin)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    sorted_index: cython.pointer[cython.const[int64_t]] = const_integers(free)
    timer: cython.p_float = singles(sleep_timer)
    count: cython.Py_ssize_t = len(free)
    found: cython.int = 0
    with cython.nogil:
        for k in range(count):
            i: cython.Py_ssize_t = sorted_index[k]
            timer[i] = longer_at_rest(v, w, r, i, limit, dt, timer[i])
            found |= timer[i] >= after
    return found != 0


def find_islands(
    position, radius, period_x: real, period_y: real, inverse_mass, sleep_timer, pairs, near: real, after: cython.float, root
):
    """root[i]: the lowest row of the island of i, if all of it has been at rest for `after` seconds; else -1.

    An island is connected by pairs closer than `near` times their contact distance. Pinned circles and sleepers (inverse mass 0)
    belong to none. pairs: as in `join_near_pairs`.
    """
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    timer: cython.pointer[cython.const[cython.float]] = const_singles(sleep_timer)
    to: cython.pointer(int64_t) = integers(root)
    count: cython.Py_ssize_t = len(root)
    marks = np.zeros(count, np.uint8)
    restless: cython.pointer(uint8_t) = octets(marks)
    k: int64_t
    n: cython.Py_ssize_t
    for n in range(count):
        to[n] = n
    join_listed(position, None, radius, period_x, period_y, inverse_mass, pairs, near, to)
    with cython.nogil:
        for n in range(count):
            if timer[n] < after or w[n] <= 0:
                restless[find_root(to, n)] = 1
        for k in range(count):  # downwards, as roots are below their members
            n = count - 1 - k
            i: int64_t = find_root(to, n)
            to[n] = -1 if restless[i] else i
