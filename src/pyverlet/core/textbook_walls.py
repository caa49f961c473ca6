# mypy: ignore-errors
"""Walls as sketches write them: look at the position after the step, put it back, do something to the velocity.

Kept to be shown, not to be used: when the circle met the wall is never asked. `flip` true: the velocity along the normal is
turned round, times e. False: only the position is put back, by a shift s, and the velocity becomes that of a method whose only
memory is x - x_prev: it gains s / h.
"""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_reals, reals
from cython.cimports.lanes import real
from cython.cimports.libc.math import sqrt

from pyverlet.core.kernels import kernel


@kernel
def put_back(
    i: cython.Py_ssize_t,
    nx: real,
    ny: real,
    depth: real,
    x: cython.pointer(real),
    v: cython.pointer(real),
    h: real,
    e: real,
    flip: cython.bint,
) -> cython.void:
    """Circle i is `depth` > 0 beyond a wall of normal (nx, ny) into the room."""
    x[2 * i] += depth * nx
    x[2 * i + 1] += depth * ny
    vn: real = v[2 * i] * nx + v[2 * i + 1] * ny
    change: real = -(e * vn + vn) if flip else depth / h
    v[2 * i] += change * nx
    v[2 * i + 1] += change * ny


def clamp_to_circle(
    x0: real, y0: real, size: real, position, velocity, radius, inverse_mass, h: real, e: real, flip: cython.bint
):
    """A cage of radius `size` about (x0, y0), m."""
    x: cython.pointer(real) = reals(position)
    v: cython.pointer(real) = reals(velocity)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(radius)
    zero: real = 0
    for i in range(count):
        dx: real = x0 - x[2 * i]
        dy: real = y0 - x[2 * i + 1]
        room: real = size - r[i]
        distance: real = cython.cast(real, sqrt(dx * dx + dy * dy))
        if distance > max(room, zero) and w[i] > zero:
            put_back(i, dx / distance, dy / distance, distance - room, x, v, h, e, flip)


def clamp_to_box(
    x0: real, y0: real, x1: real, y1: real, position, velocity, radius, inverse_mass, h: real, e: real, flip: cython.bint
):
    """Four walls, one after the other."""
    x: cython.pointer(real) = reals(position)
    v: cython.pointer(real) = reals(velocity)
    r: cython.pointer[cython.const[real]] = const_reals(radius)
    w: cython.pointer[cython.const[real]] = const_reals(inverse_mass)
    count: cython.Py_ssize_t = len(radius)
    zero: real = 0
    one: real = 1
    for i in range(count):
        if w[i] > zero:
            left: real = x0 + r[i] - x[2 * i]
            right: real = x[2 * i] + r[i] - x1
            below: real = y0 + r[i] - x[2 * i + 1]
            above: real = x[2 * i + 1] + r[i] - y1
            if left > zero:
                put_back(i, one, zero, left, x, v, h, e, flip)
            if right > zero:
                put_back(i, -one, zero, right, x, v, h, e, flip)
            if below > zero:
                put_back(i, zero, one, below, x, v, h, e, flip)
            if above > zero:
                put_back(i, zero, -one, above, x, v, h, e, flip)
