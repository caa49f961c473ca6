# mypy: ignore-errors
"""Values of link rows (a distance, an angle, an area), now or ahead, and their gradients."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import atan2, rint, sqrt

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import ANGLE, DISTANCE, MOTOR, Links
from pyverlet.core.link_holds import move
from pyverlet.core.periodic import nearest_in_double

TURN = cython.declare(cython.double, 6.283185307179586)

LinkWay = cython.struct(x=cython.double, y=cython.double)


@inlined
def way_between(k: cython.pointer(Links), i: cython.Py_ssize_t, j: cython.Py_ssize_t, ahead: cython.double) -> LinkWay:
    """From linked particle i to the nearest image of j, m, `ahead` seconds from now at current velocities."""
    found: LinkWay
    found.x = nearest_in_double(k.x[2 * j] - k.x[2 * i], k.period_x) + ahead * (k.u[2 * j] - k.u[2 * i])
    found.y = nearest_in_double(k.x[2 * j + 1] - k.x[2 * i + 1], k.period_y) + ahead * (k.u[2 * j + 1] - k.u[2 * i + 1])
    return found


@inlined
def set_slope(k: cython.pointer(Links), e: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Set the gradient of a row with respect to its particle at entry e."""
    k.slope[2 * e], k.slope[2 * e + 1] = x, y


@kernel
def measure_angle(k: cython.pointer(Links), r: cython.Py_ssize_t, ahead: cython.double) -> cython.double:
    """Angle at the second of three particles beyond the nearer end of its range, rad; `acts`: which end that is."""
    e: cython.Py_ssize_t = k.first[r]
    a: LinkWay = way_between(k, k.node[e + 1], k.node[e], ahead)
    b: LinkWay = way_between(k, k.node[e + 1], k.node[e + 2], ahead)
    aa: cython.double = a.x * a.x + a.y * a.y
    bb: cython.double = b.x * b.x + b.y * b.y
    if aa > 0 and bb > 0:
        set_slope(k, e, a.y / aa, -a.x / aa)
        set_slope(k, e + 2, -b.y / bb, b.x / bb)
        set_slope(k, e + 1, b.y / bb - a.y / aa, a.x / aa - b.x / bb)
    half: cython.double = k.slack[r] / 2
    value: cython.double = atan2(a.x * b.y - a.y * b.x, a.x * b.x + a.y * b.y) - k.rest[r] - half
    value -= TURN * rint(value / TURN)
    k.acts[r] = 1 if value >= 0 else -1
    return value - half if value >= 0 else value + half


@kernel
def measure_arm(k: cython.pointer(Links), r: cython.Py_ssize_t, ahead: cython.double) -> cython.void:
    """Set the gradient of the angle of the arm against which a motor turns a disc: the last two of its particles."""
    e: cython.Py_ssize_t = k.first[r]
    last: cython.Py_ssize_t = k.first[r + 1] - 1
    set_slope(k, e, 0, 0)
    if last > e:
        d: LinkWay = way_between(k, k.node[last - 1], k.node[last], ahead)
        square: cython.double = d.x * d.x + d.y * d.y
        if square > 0:
            set_slope(k, last, -d.y / square, d.x / square)
            set_slope(k, last - 1, d.y / square, -d.x / square)


@kernel
def measure_area(k: cython.pointer(Links), r: cython.Py_ssize_t, ahead: cython.double) -> cython.double:
    """Area of a ring of particles minus its rest area, m^2: the sum of triangles at its first particle."""
    first: cython.Py_ssize_t = k.first[r]
    end: cython.Py_ssize_t = k.first[r + 1]
    twice: cython.double = 0
    before: LinkWay = way_between(k, k.node[first], k.node[end - 1], ahead)
    here: LinkWay = way_between(k, k.node[first], k.node[first], ahead)
    for e in range(first, end):
        after: LinkWay = way_between(k, k.node[first], k.node[e + 1 if e + 1 < end else first], ahead)
        twice += here.x * after.y - here.y * after.x
        set_slope(k, e, (after.y - before.y) / 2, (before.x - after.x) / 2)
        before.x, before.y = here.x, here.y
        here.x, here.y = after.x, after.y
    return twice / 2 - k.rest[r]


@kernel
def measure_row(k: cython.pointer(Links), r: cython.Py_ssize_t, ahead: cython.double) -> cython.double:
    """Value of row r minus its rest value, `ahead` seconds from now, and its `slope` then (not for distances)."""
    if k.kind[r] == DISTANCE:
        e: cython.Py_ssize_t = k.first[r]
        d: LinkWay = way_between(k, k.node[e], k.node[e + 1], ahead)
        return sqrt(d.x * d.x + d.y * d.y) - k.rest[r]
    if k.kind[r] == ANGLE:
        return measure_angle(k, r, ahead)
    if k.kind[r] == MOTOR:
        measure_arm(k, r, ahead)
        return 0.0
    return measure_area(k, r, ahead)


@kernel
def mobility(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.double:
    """Change of row r's rate by its own unit impulse, along its gradient at the start of the substep, 1/kg."""
    e: cython.Py_ssize_t = k.first[r]
    found: cython.double = 0
    if k.kind[r] == DISTANCE:
        return k.weight[k.node[e]] + k.weight[k.node[e + 1]]
    for e in range(k.first[r], k.first[r + 1]):
        x: cython.double = k.gradient[2 * e]
        y: cython.double = k.gradient[2 * e + 1]
        found += k.weight[k.node[e]] * (x * x + y * y)
    return found


@inlined
def push(k: cython.pointer(Links), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Apply an impulse to linked particle i, N s. Particles of infinite mass, shared by rows of a colour, are not written."""
    if k.own[i] == 0:
        return
    move(k, i, k.weight[i] * x, k.weight[i] * y)
    k.react[2 * i] += x
    k.react[2 * i + 1] += y


@kernel
def push_row(
    k: cython.pointer(Links), r: cython.Py_ssize_t, impulse: cython.double, gradient: cython.pointer(cython.double)
) -> cython.void:
    """Apply an impulse along a gradient of row r."""
    e: cython.Py_ssize_t
    for e in range(k.first[r], k.first[r + 1]):
        push(k, k.node[e], impulse * gradient[2 * e], impulse * gradient[2 * e + 1])
