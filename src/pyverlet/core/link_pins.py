# mypy: ignore-errors
"""Pins: implicit springs to points, or rigid ones. Rows see a pinned particle with the inertia of its pin."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.link_softness import Softness, averaged, before_that, kept_share, softness
from pyverlet.core.periodic import nearest_in_double

CHANGED = cython.declare(cython.double, 2e300)
"""As in `laws.links`: marks a rigid pin on its way to a new point, until the last substep of the frame."""


@kernel
def pin_value(k: cython.pointer(Links), p: cython.Py_ssize_t, axis: cython.int, ahead: cython.double) -> cython.double:
    """Displacement of the particle from its pin along an axis, m, `ahead` s from now."""
    i: cython.Py_ssize_t = k.pin_node[p]
    away: cython.double = k.x[2 * i + axis] - k.pin_point[2 * p + axis]
    return nearest_in_double(away, k.period_y if axis else k.period_x) + ahead * k.u[2 * i + axis]


@inlined
def pin_speed(k: cython.pointer(Links), p: cython.Py_ssize_t, axis: cython.int) -> cython.double:
    """Speed of a rigid pin in this substep along an axis, m/s."""
    return (k.pin_target[2 * p + axis] - k.pin_value[2 * p + axis]) / k.h


@kernel
def begin_pin(k: cython.pointer(Links), p: cython.Py_ssize_t) -> cython.void:
    """Begin a pin: its coefficients, and warm start."""
    i: cython.Py_ssize_t = k.pin_node[p]
    axis: cython.int
    if k.pin_intact[p] == 0 or k.own[i] == 0:
        return
    for axis in range(2):
        at: cython.Py_ssize_t = 2 * p + axis
        value: cython.double = pin_value(k, p, axis, 0)
        before: cython.double = before_that(value, k.pin_value[at], k.pin_next[at], k.pin_point[at])
        soft: Softness = softness(k, k.pin_stiffness[p], k.pin_damping[p], k.own[i], value, before)
        k.pin_soft[p], k.pin_target[at] = soft.soft, soft.target
        k.pin_value[at] = value
        if k.pin_stiffness[p] == INFINITY:
            on_its_way: cython.bint = k.pin_next[at] == CHANGED
            k.pin_target[at] = value - value / k.left if on_its_way else 0
            k.pin_value[at] = value if on_its_way else 0
        if soft.soft == INFINITY:
            k.pin_impulse[at] = 0
        k.pin_impulse[at] *= k.scale * kept_share(k, k.pin_impulse[at], k.pin_load[at], k.own[i])
        k.pin_load[at] = k.pin_impulse[at]
        k.u[2 * i + axis] += k.own[i] * k.pin_impulse[at]


@kernel
def hold_pin(k: cython.pointer(Links), p: cython.Py_ssize_t) -> cython.void:
    """Before rows are solved: move the particle to its pin as if alone; afterwards rows see it with the inertia of the pin."""
    i: cython.Py_ssize_t = k.pin_node[p]
    axis: cython.int
    if k.pin_intact[p] == 0 or k.own[i] == 0 or k.pin_soft[p] == INFINITY:
        return
    gives: cython.double = k.pin_soft[p] + k.h * k.own[i]
    for axis in range(2):
        at: cython.Py_ssize_t = 2 * p + axis
        change: cython.double = (k.pin_target[at] - k.pin_soft[p] * k.pin_impulse[at] - pin_value(k, p, axis, k.h)) / gives
        k.pin_impulse[at] += change
        k.u[2 * i + axis] += k.own[i] * change
    k.weight[i] = k.own[i] * k.pin_soft[p] / gives


@kernel
def finish_pin(k: cython.pointer(Links), p: cython.Py_ssize_t) -> cython.void:
    """After rows are solved: add the pin's reaction to them."""
    i: cython.Py_ssize_t = k.pin_node[p]
    axis: cython.int
    if k.pin_intact[p] == 0 or k.own[i] == 0:
        return
    share: cython.double = k.weight[i] / k.own[i] - 1
    for axis in range(2):
        at: cython.Py_ssize_t = 2 * p + axis
        k.pin_impulse[at] += share * k.react[2 * i + axis]
        if k.pin_next[at] != CHANGED or k.left == 1:
            k.pin_next[at] = pin_value(k, p, axis, k.h)
    k.react[2 * i] = k.react[2 * i + 1] = 0
    k.weight[i] = 0 if k.pin_stiffness[p] == INFINITY else k.own[i]


@kernel
def hold_rigid_pin(k: cython.pointer(Links), p: cython.Py_ssize_t) -> cython.void:
    """After the drift: particles of rigid pins move with them."""
    i: cython.Py_ssize_t = k.pin_node[p]
    axis: cython.int
    if k.pin_intact[p] == 0 or k.own[i] == 0 or k.pin_stiffness[p] < INFINITY:
        return
    for axis in range(2):
        speed: cython.double = pin_speed(k, p, axis)
        k.pin_impulse[2 * p + axis] += (speed - k.u[2 * i + axis]) / k.own[i]
        k.u[2 * i + axis] = speed
    k.weight[i] = 0


@kernel
def finish_rigid_pin(k: cython.pointer(Links), p: cython.Py_ssize_t) -> cython.void:
    """After rows are solved after the drift: add the reaction of rigid pins."""
    i: cython.Py_ssize_t = k.pin_node[p]
    if k.pin_intact[p] != 0 and k.own[i] > 0 and k.weight[i] == 0:
        k.pin_impulse[2 * p] -= k.react[2 * i]
        k.pin_impulse[2 * p + 1] -= k.react[2 * i + 1]
        k.react[2 * i] = k.react[2 * i + 1] = 0


@kernel
def end_pin(k: cython.pointer(Links), p: cython.Py_ssize_t, mean: cython.double) -> cython.void:
    """Update the mean force of a pin; if it is too large, the pin breaks."""
    i: cython.Py_ssize_t = k.pin_node[p]
    axis: cython.int
    for axis in range(2):
        at: cython.Py_ssize_t = 2 * p + axis
        k.pin_pull[at] = averaged(k.pin_pull[at], -k.pin_impulse[at] / k.kick, mean)
    square: cython.double = k.pin_pull[2 * p] * k.pin_pull[2 * p] + k.pin_pull[2 * p + 1] * k.pin_pull[2 * p + 1]
    if square > k.pin_strength[p] * k.pin_strength[p]:
        k.pin_intact[p] = 0
        k.pin_impulse[2 * p] = k.pin_impulse[2 * p + 1] = 0
    k.weight[i] = k.own[i]
