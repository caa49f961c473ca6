# mypy: ignore-errors
"""Solves blocks of rows: chains directly, single rows (angles, areas) one by one; colours of blocks chunk by chunk."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, fabs, sqrt

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import ANGLE, DISTANCE, MOTOR, Links
from pyverlet.core.link_chains import STEEP
from pyverlet.core.link_holds import WEDGED, hold_node, mobility_along
from pyverlet.core.link_lengths import relax_chain, solve_chain
from pyverlet.core.link_motors import turn_motor
from pyverlet.core.link_shapes import LinkWay, measure_row, mobility, way_between
from pyverlet.core.link_softness import Softness, averaged, before_that, softness
from pyverlet.core.step import Step

FARTHEST = cython.declare(cython.double, 0.5)
"""Most that a link is assumed to turn in a substep, and that an angle is corrected in a pass, rad."""

LEAP = cython.declare(cython.double, 0.05)
"""rad, most correction per substep of an angle beyond its limits, or a rigid one."""

RIGHTED = cython.declare(cython.double, 0.0625)
"""Fraction of a rigid chain's length error corrected per substep; errors below the separation of overlaps vanish at once."""

AVERAGED = cython.declare(cython.double, 120.0)
"""1/s: rate of the running mean of the tension, which is shown and breaks links."""

YIELDING = cython.declare(cython.double, 3e-4)
TAUT = cython.declare(cython.double, 0.1)
"""Rows of nets act along the directions at the start of a substep, which is stable while s = 4 T h^2 / (m L) < 4, T being the
tension, and a straight row between two pins would pull without bound. So from about s = TAUT on a link yields by YIELDING s / 2
of its length, like a spring whose stiffness is independent of h. Without yielding, cloths that hang by their corners kept moving
at 2 to 9 m/s."""

STRAIGHT = cython.declare(cython.double, 0.96)
"""Square of the cosine of half the angle that a link may turn by in a substep: 0.4 rad in all."""


@kernel
def begin_row(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """Measure row r, compute its coefficients, and how it turns."""
    e: cython.Py_ssize_t = k.first[r]
    k.impact[r] = k.ahead[3 * r] = k.ahead[3 * r + 1] = k.ahead[3 * r + 2] = 0
    if k.intact[r] == 0:
        return
    value: cython.double = measure_row(k, r, 0)
    before: cython.double = before_that(value, k.value[r], k.next[r], k.rest[r])
    if k.kind[r] == DISTANCE:
        i: cython.Py_ssize_t = k.node[e]
        j: cython.Py_ssize_t = k.node[e + 1]
        d: LinkWay = way_between(k, i, j, 0)
        square: cython.double = d.x * d.x + d.y * d.y
        turning: cython.double = 0
        if square > 0:
            turning = (2 * k.kick - k.h) * ((k.u[2 * j + 1] - k.u[2 * i + 1]) * d.x - (k.u[2 * j] - k.u[2 * i]) * d.y) / square
        k.way[2 * r], k.way[2 * r + 1] = d.x, d.y
        k.turning[r] = max(min(turning, FARTHEST), -FARTHEST)
        k.given[2 * r] = k.given[2 * r + 1] = 0
    else:
        for e in range(k.first[r], k.first[r + 1]):
            k.gradient[2 * e], k.gradient[2 * e + 1] = k.slope[2 * e], k.slope[2 * e + 1]
    soft: Softness = softness(k, k.stiffness[r], k.damping[r], mobility(k, r), value, before)
    k.soft[r], k.target[r], k.value[r] = soft.soft, soft.target, value
    if k.kind[r] == ANGLE and soft.soft == 0 and k.acts[r] * value > LEAP:
        k.target[r] = value - LEAP * k.acts[r]
    if soft.soft == INFINITY:
        k.impulse[r] = 0


@inlined
def length_error(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.double:
    """Length error of a rigid link, m; 0 for slack ropes and all other rows."""
    acts: cython.bint = k.kind[r] == DISTANCE and k.stiffness[r] == INFINITY and k.intact[r] != 0
    return k.value[r] if acts and (k.upper[r] > 0 or k.value[r] > 0) else 0.0


@kernel
def begin_block(k: cython.pointer(Links), b: cython.Py_ssize_t) -> cython.void:
    """Begin the rows of a block. A rigid chain far too long is corrected over several substeps, or it would throw particles."""
    r: cython.Py_ssize_t
    off: cython.double = 0
    for r in range(k.block[b], k.block[b + 1]):
        begin_row(k, r)
        if k.kind[r] == DISTANCE and k.stiffness[r] == INFINITY and not k.alone[b] and k.rest[r] > 0:
            gives: cython.double = k.spring_h * k.spring_h * mobility(k, r)
            tense: cython.double = 2 * gives * k.pull[r] / k.rest[r]
            k.soft[r] = YIELDING * gives / k.h * tense * tense / (tense * tense + TAUT * TAUT)
        off += fabs(length_error(k, r))
    most: cython.double = max(k.pushed_out, RIGHTED * off)
    if off > most:
        for r in range(k.block[b], k.block[b + 1]):
            if length_error(k, r) != 0:
                k.target[r] = k.value[r] * (1 - most / off)


@kernel
def undo_row(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """Reduce row r to the part of its impulse that stays when it is solved."""
    k.impulse[r] *= k.keeps[r]
    if k.kind[r] == DISTANCE:
        d: LinkWay = way_between(k, k.node[k.first[r]], k.node[k.first[r] + 1], 0)  # impacts may have moved its ends
        k.way[2 * r], k.way[2 * r + 1] = d.x, d.y
        k.given[2 * r] *= k.keeps[r]
        k.given[2 * r + 1] *= k.keeps[r]


@kernel
def let_go_of_row(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """Ignore the surfaces at the particles of row r if they leave no motion along its slope."""
    e: cython.Py_ssize_t
    left: cython.double = 0
    free: cython.double = 0
    for e in range(k.first[r], k.first[r + 1]):
        x: cython.double = k.slope[2 * e]
        y: cython.double = k.slope[2 * e + 1]
        left += mobility_along(k, k.node[e], x, y, x, y)
        free += k.weight[k.node[e]] * (x * x + y * y)
    if left < WEDGED * free:
        for e in range(k.first[r], k.first[r + 1]):
            k.held[k.node[e]] = -1


@kernel
def solve_row(w: cython.pointer(Step), r: cython.Py_ssize_t) -> cython.void:
    """Solve a single row: a Newton step for its value after the drift, along its gradient at the start.

    If the gradient turns or changes length too much, it is useless as a direction: then the one after the drift is used, also for
    impulses already given.
    """
    k: cython.pointer(Links) = w.link_table
    e: cython.Py_ssize_t
    if k.intact[r] == 0 or k.soft[r] == INFINITY:
        return
    left: cython.double = k.target[r] - k.soft[r] * k.impulse[r] - measure_row(k, r, k.h)
    along: cython.double = 0
    square: cython.double = 0
    at_start: cython.double = 0
    let_go_of_row(k, r)
    for e in range(k.first[r], k.first[r + 1]):
        x: cython.double = k.slope[2 * e]
        y: cython.double = k.slope[2 * e + 1]
        gx: cython.double = k.gradient[2 * e]
        gy: cython.double = k.gradient[2 * e + 1]
        along += mobility_along(k, k.node[e], gx, gy, x, y)
        square += mobility_along(k, k.node[e], x, y, x, y)
        at_start += mobility_along(k, k.node[e], gx, gy, gx, gy)
    if along < STEEP * square or along * along < STEEP * STEEP * square * at_start:
        push_row(k, r, -k.impulse[r], k.gradient)
        k.impulse[r] = 0
        left = k.target[r] - measure_row(k, r, k.h)
        along = 0
        for e in range(k.first[r], k.first[r + 1]):
            k.gradient[2 * e], k.gradient[2 * e + 1] = k.slope[2 * e], k.slope[2 * e + 1]
            along += mobility_along(k, k.node[e], k.slope[2 * e], k.slope[2 * e + 1], k.slope[2 * e], k.slope[2 * e + 1])
    change: cython.double = k.soft[r] + k.h * along
    if change > 0:
        change = left / change
        if k.kind[r] == ANGLE:
            most: cython.double = FARTHEST / (k.h * along)
            change = min(max(change, -most), most)
        if k.upper[r] <= 0 and k.acts[r] * (k.impulse[r] + change) > 0:  # an angle within its limits
            change = -k.impulse[r]
        k.impulse[r] += change
        push_row(k, r, change, k.gradient)
        for e in range(k.first[r], k.first[r + 1]):
            hold_node(w, k.node[e])


@kernel
def relax_row(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """After the drift: stop the change of a rigid single row, along the mean of its gradients before and after."""
    e: cython.Py_ssize_t
    rate: cython.double = 0
    square: cython.double = 0
    if k.intact[r] == 0 or k.stiffness[r] < INFINITY or (k.upper[r] <= 0 and k.impulse[r] == 0):
        return
    let_go_of_row(k, r)
    for e in range(k.first[r], k.first[r + 1]):
        i: cython.Py_ssize_t = k.node[e]
        x: cython.double = k.slope[2 * e]
        y: cython.double = k.slope[2 * e + 1]
        rate += x * k.u[2 * i] + y * k.u[2 * i + 1]
        square += mobility_along(k, i, x, y, x, y)
    if square > 0:
        change: cython.double = -rate / square
        if k.upper[r] <= 0 and k.acts[r] * (k.impulse[r] + change) > 0:
            change = -k.impulse[r]
        k.impulse[r] += change
        push_row(k, r, change, k.slope)


@kernel
def solve_block(w: cython.pointer(Step), b: cython.Py_ssize_t, drifts: cython.bint) -> cython.void:
    """Solve a chain or a single row."""
    k: cython.pointer(Links) = w.link_table
    r: cython.Py_ssize_t = k.block[b]
    e: cython.Py_ssize_t
    if r == k.block[b + 1]:
        return
    if k.kind[r] == DISTANCE:
        if drifts:
            solve_chain(w, r, k.block[b + 1], k.alone[b] != 0)
        else:
            relax_chain(w, r, k.block[b + 1])
    elif k.kind[r] == MOTOR:
        turn_motor(w, r, k.gradient if drifts else k.slope)
        for e in range(k.first[r], k.first[r + 1] if drifts else k.first[r]):
            hold_node(w, k.node[e])
    elif drifts:
        solve_row(w, r)
    else:
        relax_row(k, r)


@kernel
def finish_row(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """Before the drift: store the expected value and direction of row r after it; for other rows the mean of their gradients.

    With m along the mean direction before and after the drift, a link that only turns has the velocity s across m. If it turns
    far, as in a cracking chain, contacts change s afterwards, and m represents it.
    """
    e: cython.Py_ssize_t = k.first[r]
    if k.intact[r] == 0:
        return
    k.next[r] = measure_row(k, r, k.h)
    k.impulse[r] += k.ahead[3 * r]
    k.given[2 * r] += k.ahead[3 * r + 1]
    k.given[2 * r + 1] += k.ahead[3 * r + 2]
    if k.kind[r] == DISTANCE:
        p: LinkWay = way_between(k, k.node[e], k.node[e + 1], k.h)
        length: cython.double = sqrt(p.x * p.x + p.y * p.y)
        x: cython.double = p.x / length if length > 0 else 0
        y: cython.double = p.y / length if length > 0 else 0
        mx: cython.double = p.x + k.way[2 * r]
        my: cython.double = p.y + k.way[2 * r + 1]
        square: cython.double = mx * mx + my * my
        s: cython.double = (p.y - k.way[2 * r + 1]) * mx - (p.x - k.way[2 * r]) * my
        k.end_way[2 * r], k.end_way[2 * r + 1] = x, y
        k.chord_speed[r] = s * (y * mx - x * my) / (square * k.h) if square > 0 else 0
        along: cython.double = x * mx + y * my
        if not (along > 0 and along * along > STRAIGHT * square):
            length = sqrt(square)
            k.end_way[2 * r], k.end_way[2 * r + 1] = mx / length if length > 0 else 0, my / length if length > 0 else 0
            k.chord_speed[r] = 0
    else:
        k.given[2 * r] = k.impulse[r]
        # After the drift, motors act along the arm at that time.
        for e in range(k.first[r], k.first[r] if k.kind[r] == MOTOR else k.first[r + 1]):
            k.slope[2 * e] = (k.slope[2 * e] + k.gradient[2 * e]) / 2
            k.slope[2 * e + 1] = (k.slope[2 * e + 1] + k.gradient[2 * e + 1]) / 2


@kernel
def end_row(k: cython.pointer(Links), r: cython.Py_ssize_t, mean: cython.double) -> cython.void:
    """Update the mean tension of row r; if it is too large, the row breaks."""
    if k.intact[r] == 0:
        return
    k.pull[r] = averaged(k.pull[r], -(k.impulse[r] + k.impact[r]) / k.kick, mean)
    if k.pull[r] > k.strength[r] or -k.pull[r] > k.strength[r]:
        k.intact[r] = 0
        k.impulse[r] = 0
