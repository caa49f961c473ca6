# mypy: ignore-errors
"""How far pairs overlap, and how small particles must be not to.

Pairs are listed by cell rows: those of row s are `count[s]` from `first[s]` on. A period is that of a room, m; 0 for none.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_indices, const_integers, const_octets, const_reals, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import rint, sqrt
from cython.cimports.libc.stdint import int64_t, uint8_t, uint32_t


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def nearest_image(difference: cython.double, period: cython.double) -> cython.double:
    """The image of a difference that is nearest to 0; the difference itself where the period is 0."""
    return difference - period * rint(difference / period) if period > 0 else difference


def shrink_to_fit(position, radius, period_x: real, period_y: real, pairs, fresh, least: real, grown):
    """Shrink fresh particles, and those they overlap, until they just touch: grown = distance / (r_i + r_j), at least `least`."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    first: cython.pointer[cython.const[int64_t]] = const_integers(pairs[0])
    count: cython.pointer[cython.const[int64_t]] = const_integers(pairs[1])
    pair_i: cython.pointer[cython.const[uint32_t]] = const_indices(pairs[2])
    pair_j: cython.pointer[cython.const[uint32_t]] = const_indices(pairs[3])
    new: cython.pointer[cython.const[uint8_t]] = const_octets(fresh)
    size: cython.pointer[real] = reals(grown)
    rows: int64_t = len(pairs[0])
    s: int64_t
    k: int64_t
    for s in range(rows):
        for k in range(first[s], first[s] + count[s]):
            i: uint32_t = pair_i[k]
            j: uint32_t = pair_j[k]
            if new[i] or new[j]:
                dx: real = x[2 * j] - x[2 * i]
                dy: real = x[2 * j + 1] - x[2 * i + 1]
                if period_x > 0:
                    dx = dx - period_x * cython.cast(real, rint(dx / period_x))
                if period_y > 0:
                    dy = dy - period_y * cython.cast(real, rint(dy / period_y))
                square: real = dx * dx + dy * dy
                part: real = cython.cast(real, sqrt(square)) / (r[i] + r[j])
                part = max(part, least)
                size[i] = min(size[i], part)
                size[j] = min(size[j], part)


def overlaps(position, radius, period_x: cython.double, period_y: cython.double, pairs):
    """(number of touching pairs, sum and maximum of depth / (r_i + r_j)), in float64."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    first: cython.pointer[cython.const[int64_t]] = const_integers(pairs[0])
    count: cython.pointer[cython.const[int64_t]] = const_integers(pairs[1])
    pair_i: cython.pointer[cython.const[uint32_t]] = const_indices(pairs[2])
    pair_j: cython.pointer[cython.const[uint32_t]] = const_indices(pairs[3])
    rows: int64_t = len(pairs[0])
    number: int64_t = 0
    total: cython.double = 0.0
    largest: cython.double = 0.0
    s: int64_t
    k: int64_t
    for s in range(rows):
        for k in range(first[s], first[s] + count[s]):
            i: uint32_t = pair_i[k]
            j: uint32_t = pair_j[k]
            dx: cython.double = nearest_image(cython.cast(cython.double, x[2 * j]) - x[2 * i], period_x)
            dy: cython.double = nearest_image(cython.cast(cython.double, x[2 * j + 1]) - x[2 * i + 1], period_y)
            depth: cython.double = 1.0 - sqrt(dx * dx + dy * dy) / (cython.cast(cython.double, r[i]) + r[j])
            if depth > 0.0:
                number += 1
                total += depth
                largest = max(largest, depth)
    return number, total, largest
