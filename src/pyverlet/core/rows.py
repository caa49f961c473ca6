# mypy: ignore-errors
"""Rows of particles between the user's order and that of the slots, and whether columns have changed."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_indices, const_reals, const_small_integers, doubles, reals
from cython.cimports.lanes import real
from cython.cimports.libc.stdint import int32_t, uint32_t


def take_motion(position, velocity, acceleration, spin, from_position, from_velocity, from_acceleration, from_spin, index):
    """Row k of the first four arrays becomes row index[k] of the others."""
    x: cython.pointer(real) = reals(position)
    v: cython.pointer(real) = reals(velocity)
    a: cython.pointer(real) = reals(acceleration)
    s: cython.pointer(real) = reals(spin)
    x_from: cython.pointer[cython.const[real]] = const_reals(from_position)
    v_from: cython.pointer[cython.const[real]] = const_reals(from_velocity)
    a_from: cython.pointer[cython.const[real]] = const_reals(from_acceleration)
    s_from: cython.pointer[cython.const[real]] = const_reals(from_spin)
    order: cython.pointer[cython.const[int32_t]] = const_small_integers(index)
    count: cython.Py_ssize_t = len(index)
    k: cython.Py_ssize_t
    for k in range(count):
        i: cython.Py_ssize_t = order[k]
        x[2 * k], x[2 * k + 1] = x_from[2 * i], x_from[2 * i + 1]
        v[2 * k], v[2 * k + 1] = v_from[2 * i], v_from[2 * i + 1]
        a[2 * k], a[2 * k + 1] = a_from[2 * i], a_from[2 * i + 1]
        s[k] = s_from[i]


def put_motion(
    position,
    velocity,
    acceleration,
    spin,
    to_position,
    to_velocity,
    to_acceleration,
    to_spin,
    angle,
    half_dt: cython.double,
    index,
):
    """The way back. Angles turn by the mean of the spins before and now."""
    x: cython.pointer[cython.const[real]] = const_reals(position)
    v: cython.pointer[cython.const[real]] = const_reals(velocity)
    a: cython.pointer[cython.const[real]] = const_reals(acceleration)
    s: cython.pointer[cython.const[real]] = const_reals(spin)
    x_to: cython.pointer(real) = reals(to_position)
    v_to: cython.pointer(real) = reals(to_velocity)
    a_to: cython.pointer(real) = reals(to_acceleration)
    s_to: cython.pointer(real) = reals(to_spin)
    turned: cython.pointer(cython.double) = doubles(angle)
    order: cython.pointer[cython.const[int32_t]] = const_small_integers(index)
    count: cython.Py_ssize_t = len(index)
    k: cython.Py_ssize_t
    for k in range(count):
        i: cython.Py_ssize_t = order[k]
        spins: cython.double = cython.cast(cython.double, s_to[i]) + cython.cast(cython.double, s[k])
        if spins != 0:
            turned[i] += half_dt * spins
        x_to[2 * i], x_to[2 * i + 1] = x[2 * k], x[2 * k + 1]
        v_to[2 * i], v_to[2 * i + 1] = v[2 * k], v[2 * k + 1]
        a_to[2 * i], a_to[2 * i + 1] = a[2 * k], a[2 * k + 1]
        s_to[i] = s[k]


@cython.cfunc
def reals_differ(one, other) -> cython.bint:
    """Whether two columns differ; `one` may be one number in place of equal ones."""
    a: cython.pointer[cython.const[real]] = const_reals(one)
    b: cython.pointer[cython.const[real]] = const_reals(other)
    count: cython.Py_ssize_t = len(other)
    step: cython.Py_ssize_t = 0 if len(one) == 1 else 1
    found: cython.bint = step == 1 and len(one) != count
    k: cython.Py_ssize_t
    if not found:
        for k in range(count):
            found |= a[k * step] != b[k]
    return found


@cython.cfunc
def marks_differ(one, other) -> cython.bint:
    """The same for marks."""
    a: cython.pointer[cython.const[uint32_t]] = const_indices(one)
    b: cython.pointer[cython.const[uint32_t]] = const_indices(other)
    count: cython.Py_ssize_t = len(other)
    step: cython.Py_ssize_t = 0 if len(one) == 1 else 1
    found: cython.bint = step == 1 and len(one) != count
    k: cython.Py_ssize_t
    if not found:
        for k in range(count):
            found |= a[k * step] != b[k]
    return found


def any_differs(numbers, now, marks, marks_now) -> bool:
    """Whether any of these columns of numbers, or of marks, differs from what it is now."""
    found: cython.bint = False
    for one, other in zip(numbers, now, strict=True):
        found = found or reals_differ(one, other)
    for one, other in zip(marks, marks_now, strict=True):
        found = found or marks_differ(one, other)
    return found
