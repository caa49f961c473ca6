# mypy: ignore-errors
"""Brute force: list all pairs, without cells and skin; the reference for the other methods."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int64_t, uint32_t

from pyverlet.core.cells import Cells
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pair_lists import Lists, may_touch
from pyverlet.core.periodic import nearest_of


@inlined
def has_nearest(c: cython.pointer(Cells), a: int64_t, b: int64_t) -> cython.bint:
    """Whether the nearest image of b, seen from a, stays the nearest as long as the list lasts."""
    du: real = nearest_of(c.spot_u[b] - c.spot_u[a], c.period_u)
    dv: real = nearest_of(c.spot_v[b] - c.spot_v[a], c.period_v)
    wide: real = c.spot_r[a] + c.spot_r[b] + c.skin
    return du * du + dv * dv < wide * wide


@kernel
def list_all(
    c: cython.pointer(Cells), ls: cython.pointer(Lists), inverse_mass: cython.pointer(real), found: int64_t, capacity: int64_t
) -> int64_t:
    """Write all pairs from `found` on; returns the end, even if beyond the room.

    Pairs are (a, a + step), step by step: neighbours in the list share no particle, so that they fill batches.
    """
    periodic: cython.bint = c.wraps_u or c.wraps_v
    step: int64_t
    a: int64_t
    for step in range(1, c.count):
        for a in range(c.count - step):
            if ls.tests_pairs and not may_touch(c, ls, inverse_mass, a, a + step):
                continue
            if periodic and not has_nearest(c, a, a + step):
                continue
            if found < capacity:
                ls.raw_i[found] = cython.cast(uint32_t, a)
                ls.raw_j[found] = cython.cast(uint32_t, a + step)
            found += 1
    return found
