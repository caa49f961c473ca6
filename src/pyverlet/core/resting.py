# mypy: ignore-errors
"""How long particles have been at rest, which islands may fall asleep, and which sleepers are touched or edited."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import (
    const_indices,
    const_integers,
    const_reals,
    const_singles,
    const_small_integers,
    integers,
    octets,
    singles,
)
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, int64_t, uint8_t, uint32_t

from pyverlet.core.islands import find_root, join_listed


def time_at_rest(velocity, spin, radius, free, limit: real, dt: cython.float, after: cython.float, calm) -> bool:
    """calm[i] += dt of slots `free` where the speed, that of the rim included, is at most sqrt(limit radius); else it becomes 0.

    Returns whether any of these has been at rest for `after` seconds.
    """
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    w: cython.pointer[cython.const[real]] = const_reals(spin)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    slot: cython.pointer[cython.const[int64_t]] = const_integers(free)
    timer: cython.p_float = singles(calm)
    count: cython.Py_ssize_t = len(free)
    zero: cython.float = 0
    found: cython.int = 0
    with cython.nogil:
        for k in range(count):
            i: cython.Py_ssize_t = slot[k]
            rim: real = w[i] * r[i]
            speed2: real = v[2 * i] * v[2 * i] + v[2 * i + 1] * v[2 * i + 1] + rim * rim
            longer: cython.float = timer[i] + dt
            longer = longer if speed2 <= limit * r[i] else zero
            timer[i] = longer
            found |= longer >= after
    return found != 0


def find_islands(
    position, radius, period_x: real, period_y: real, inverse_mass, calm, pairs, near: real, after: cython.float, root
):
    """root[i]: the lowest slot of the island of i, if all of it has been at rest for `after` seconds; else -1.

    An island is what hangs together by pairs nearer than `near` times their contact distance. Pinned circles and sleepers
    (inverse mass 0) belong to none. pairs: as in `join_near_pairs`.
    """
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    timer: cython.pointer[cython.const[cython.float]] = const_singles(calm)
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
        for k in range(count):  # from above: roots are below what they are the roots of
            n = count - 1 - k
            i: int64_t = find_root(to, n)
            to[n] = -1 if restless[i] else i


def find_edited(given, held, particle, island, edited) -> int:
    """Set edited[k] = 1 for sleepers that the user has written to; returns how many there are.

    given: what the user has, in the user's order: position, velocity, spin, radius, mass, restitution, friction,
    rolling resistance, inertia, category, mask, material, fixed rotation.
    held: what the slots hold of it, without velocity and spin, which are 0; categories and masks are empty where all are default.
    """
    x: cython.pointer[cython.const[real]] = const_reals(given[0])
    v: cython.pointer[cython.const[real]] = const_reals(given[1])
    spin: cython.pointer[cython.const[real]] = const_reals(given[2])
    radius: cython.pointer[cython.const[real]] = const_reals(given[3])
    mass: cython.pointer[cython.const[real]] = const_reals(given[4])
    bounce: cython.pointer[cython.const[real]] = const_reals(given[5])
    rub: cython.pointer[cython.const[real]] = const_reals(given[6])
    roll: cython.pointer[cython.const[real]] = const_reals(given[7])
    inertia: cython.pointer[cython.const[real]] = const_reals(given[8])
    category: cython.pointer[cython.const[uint32_t]] = const_indices(given[9])
    mask: cython.pointer[cython.const[uint32_t]] = const_indices(given[10])
    material: cython.pointer[cython.const[uint32_t]] = const_indices(given[11])
    fixed: cython.pointer[cython.const[uint32_t]] = const_indices(given[12])
    was_x: cython.pointer[cython.const[real]] = const_reals(held[0])
    was_radius: cython.pointer[cython.const[real]] = const_reals(held[1])
    was_mass: cython.pointer[cython.const[real]] = const_reals(held[2])
    was_bounce: cython.pointer[cython.const[real]] = const_reals(held[3])
    was_rub: cython.pointer[cython.const[real]] = const_reals(held[4])
    was_roll: cython.pointer[cython.const[real]] = const_reals(held[5])
    was_inertia: cython.pointer[cython.const[real]] = const_reals(held[6])
    was_category: cython.pointer[cython.const[uint32_t]] = const_indices(held[7])
    was_mask: cython.pointer[cython.const[uint32_t]] = const_indices(held[8])
    was_material: cython.pointer[cython.const[uint32_t]] = const_indices(held[9])
    was_fixed: cython.pointer[cython.const[uint32_t]] = const_indices(held[10])
    order: cython.pointer[cython.const[int32_t]] = const_small_integers(particle)
    asleep: cython.pointer[cython.const[int64_t]] = const_integers(island)
    to: cython.pointer(uint8_t) = octets(edited)
    sorted_out: cython.bint = len(held[7]) > 0
    masked: cython.bint = len(held[8]) > 0
    made: cython.bint = len(held[9]) > 0
    holds: cython.bint = len(held[10]) > 0
    none: uint32_t = 0
    one: uint32_t = 1
    every: uint32_t = 0xFFFFFFFF
    count: cython.Py_ssize_t = len(island)
    found: cython.Py_ssize_t = 0
    with cython.nogil:
        for k in range(count):
            if asleep[k] < 0:
                continue
            i: int32_t = order[k]
            if (
                x[2 * i] != was_x[2 * k]
                or x[2 * i + 1] != was_x[2 * k + 1]
                or v[2 * i] != 0
                or v[2 * i + 1] != 0
                or spin[i] != 0
                or radius[i] != was_radius[k]
                or mass[i] != was_mass[k]
                or bounce[i] != was_bounce[k]
                or rub[i] != was_rub[k]
                or roll[i] != was_roll[k]
                or inertia[i] != was_inertia[k]
                or category[i] != (was_category[k] if sorted_out else one)
                or mask[i] != (was_mask[k] if masked else every)
                or material[i] != (was_material[k] if made else none)
                or fixed[i] != (was_fixed[k] if holds else none)
            ):
                to[k] = 1
                found += 1
    return found
