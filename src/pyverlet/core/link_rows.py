# mypy: ignore-errors
"""Links as rows: what each measures (a distance, an angle, an area, a coordinate), now or ahead, and its gradient."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import atan2, rint, sqrt

from pyverlet.core.step import Step

DISTANCE = cython.declare(cython.int, 0)
ANGLE = cython.declare(cython.int, 1)
AREA = cython.declare(cython.int, 2)
PIN_X = cython.declare(cython.int, 3)
PIN_Y = cython.declare(cython.int, 4)

TURN = cython.declare(cython.double, 6.283185307179586)

Way = cython.struct(x=cython.double, y=cython.double)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def way_between(w: cython.pointer(Step), i: cython.Py_ssize_t, j: cython.Py_ssize_t, ahead: cython.double) -> Way:
    """From particle i to the nearest image of j, m, `ahead` seconds from now at the velocities of now."""
    found: Way
    x: cython.double = w.position[2 * j]
    y: cython.double = w.position[2 * j + 1]
    x -= w.position[2 * i]
    y -= w.position[2 * i + 1]
    if w.period_x > 0:
        x -= w.period_x * rint(x / w.period_x)
    if w.period_y > 0:
        y -= w.period_y * rint(y / w.period_y)
    if ahead > 0:
        v: cython.pointer(real) = w.motion if w.rough else w.velocity
        width: cython.Py_ssize_t = 4 if w.rough else 2
        ux: cython.double = v[width * j]
        uy: cython.double = v[width * j + 1]
        ux -= v[width * i]
        uy -= v[width * i + 1]
        x += ahead * ux
        y += ahead * uy
    found.x, found.y = x, y
    return found


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def set_gradient(w: cython.pointer(Step), e: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """The gradient of a row with respect to its particle at entry e."""
    w.link_gradient[2 * e], w.link_gradient[2 * e + 1] = x, y


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def measure_distance(w: cython.pointer(Step), r: cython.Py_ssize_t, ahead: cython.double) -> cython.double:
    """Distance beyond the length, m."""
    e: cython.Py_ssize_t = w.link_first[r]
    d: Way = way_between(w, w.link_node[e], w.link_node[e + 1], ahead)
    distance: cython.double = sqrt(d.x * d.x + d.y * d.y)
    if ahead == 0 and distance > 0:
        set_gradient(w, e, -d.x / distance, -d.y / distance)
        set_gradient(w, e + 1, d.x / distance, d.y / distance)
    return distance - w.link_rest[r]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def measure_angle(w: cython.pointer(Step), r: cython.Py_ssize_t, ahead: cython.double) -> cython.double:
    """Angle at the second of three particles beyond that at rest, rad."""
    e: cython.Py_ssize_t = w.link_first[r]
    a: Way = way_between(w, w.link_node[e + 1], w.link_node[e], ahead)
    b: Way = way_between(w, w.link_node[e + 1], w.link_node[e + 2], ahead)
    aa: cython.double = a.x * a.x + a.y * a.y
    bb: cython.double = b.x * b.x + b.y * b.y
    if ahead == 0 and aa > 0 and bb > 0:
        set_gradient(w, e, a.y / aa, -a.x / aa)
        set_gradient(w, e + 2, -b.y / bb, b.x / bb)
        set_gradient(w, e + 1, b.y / bb - a.y / aa, a.x / aa - b.x / bb)
    value: cython.double = atan2(a.x * b.y - a.y * b.x, a.x * b.x + a.y * b.y) - w.link_rest[r]
    return value - TURN * rint(value / TURN)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def measure_area(w: cython.pointer(Step), r: cython.Py_ssize_t, ahead: cython.double) -> cython.double:
    """Area inside a ring of particles beyond that at rest, m^2: the sum of triangles at its first particle."""
    first: cython.Py_ssize_t = w.link_first[r]
    end: cython.Py_ssize_t = w.link_first[r + 1]
    e: cython.Py_ssize_t
    twice: cython.double = 0
    before: Way = way_between(w, w.link_node[first], w.link_node[end - 1], ahead)
    here: Way = way_between(w, w.link_node[first], w.link_node[first], ahead)
    for e in range(first, end):
        after: Way = way_between(w, w.link_node[first], w.link_node[e + 1 if e + 1 < end else first], ahead)
        twice += here.x * after.y - here.y * after.x
        if ahead == 0:
            set_gradient(w, e, (after.y - before.y) / 2, (before.x - after.x) / 2)
        before.x, before.y = here.x, here.y
        here.x, here.y = after.x, after.y
    return twice / 2 - w.link_rest[r]


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def measure_pin(w: cython.pointer(Step), r: cython.Py_ssize_t, ahead: cython.double) -> cython.double:
    """A coordinate of a particle beyond that of its pin, m."""
    e: cython.Py_ssize_t = w.link_first[r]
    i: cython.Py_ssize_t = w.link_node[e]
    axis: cython.Py_ssize_t = w.link_kind[r] - PIN_X
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    speed: cython.double = v[(4 if w.rough else 2) * i + axis]
    period: cython.double = w.period_y if axis else w.period_x
    value: cython.double = w.position[2 * i + axis]
    value -= w.link_rest[r]
    if period > 0:
        value -= period * rint(value / period)
    if ahead == 0:
        set_gradient(w, e, 1 - axis, axis)
    return value + ahead * speed


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def measure_row(w: cython.pointer(Step), r: cython.Py_ssize_t, ahead: cython.double) -> cython.double:
    """What row r measures beyond its value at rest, `ahead` seconds from now; its gradient, too, if that is 0."""
    kind: cython.int = w.link_kind[r]
    if kind == DISTANCE:
        return measure_distance(w, r, ahead)
    if kind == ANGLE:
        return measure_angle(w, r, ahead)
    if kind == AREA:
        return measure_area(w, r, ahead)
    return measure_pin(w, r, ahead)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def rate_of(w: cython.pointer(Step), r: cython.Py_ssize_t) -> cython.double:
    """How fast the velocities of now change what row r measures, along its gradient."""
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    rate: cython.double = 0
    e: cython.Py_ssize_t
    for e in range(w.link_first[r], w.link_first[r + 1]):
        i: cython.Py_ssize_t = w.link_node[e]
        rate += w.link_gradient[2 * e] * v[width * i] + w.link_gradient[2 * e + 1] * v[width * i + 1]
    return rate


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def coupling(w: cython.pointer(Step), r: cython.Py_ssize_t, s: cython.Py_ssize_t) -> cython.double:
    """How much an impulse of row s changes the rate of row r, through the particles that they share."""
    found: cython.double = 0
    e: cython.Py_ssize_t
    f: cython.Py_ssize_t
    for e in range(w.link_first[r], w.link_first[r + 1]):
        for f in range(w.link_first[s], w.link_first[s + 1]):
            if w.link_node[e] == w.link_node[f]:
                along: cython.double = w.link_gradient[2 * e] * w.link_gradient[2 * f]
                along += w.link_gradient[2 * e + 1] * w.link_gradient[2 * f + 1]
                found += w.inverse_mass[w.link_node[e]] * along
    return found


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def mobility(w: cython.pointer(Step), r: cython.Py_ssize_t) -> cython.double:
    """How much an impulse of row r changes its own rate."""
    found: cython.double = 0
    e: cython.Py_ssize_t
    for e in range(w.link_first[r], w.link_first[r + 1]):
        x: cython.double = w.link_gradient[2 * e]
        y: cython.double = w.link_gradient[2 * e + 1]
        found += w.inverse_mass[w.link_node[e]] * (x * x + y * y)
    return found


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def push_row(w: cython.pointer(Step), r: cython.Py_ssize_t, impulse: cython.double) -> cython.void:
    """Give an impulse along the gradient of row r."""
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    width: cython.Py_ssize_t = 4 if w.rough else 2
    e: cython.Py_ssize_t
    for e in range(w.link_first[r], w.link_first[r + 1]):
        i: cython.Py_ssize_t = w.link_node[e]
        if w.inverse_mass[i] > 0:  # pinned particles may belong to several threads
            given: cython.double = w.inverse_mass[i] * impulse
            x: cython.double = v[width * i] + given * w.link_gradient[2 * e]
            y: cython.double = v[width * i + 1] + given * w.link_gradient[2 * e + 1]
            v[width * i], v[width * i + 1] = cython.cast(real, x), cython.cast(real, y)
