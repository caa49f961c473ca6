# mypy: ignore-errors
"""Solves chains of distances directly: a Newton step is a block tridiagonal system with a 2 x 2 block per link.

Link r gives the impulse P to its second end and -P to its first. After a substep of length h it is p = way + h (u_2 - u_1) long.
With J = P d along its direction d the condition is |p| - L + soft J = target. So the missing part F of P solves

    (C_r + h (w_1 + w_2)) F_r - h w_1 F_(r-1) - h w_2 F_(r+1) = e d + (-P t / b) t,    C = soft d d^T + t t^T / b,

with t across d. d is the direction d_0 at the start of the substep (SHAKE), so that motion is reversible and conserves energy.
But that is stable only for s = 4 T h^2 / (m L) < 4, T being the tension (leapfrog); a light chain with a heavy end exceeds it.
Where s is not small, the force is that of d = d_0 + q (d_1 - 2 d_0 + d_-1), which is stable at any s if q > 1/4, and conserves
energy (Newmark with beta = q); d_0 - d_-1 follows from the velocities of the last substep, and b = q J / |p| is the turning of P
with p. In nets d is d_0: tensions that have not converged would hold links where they are.
"""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, sqrt

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import Links
from pyverlet.core.link_holds import Mobility, let_go_of_wedged, moved_by, pulled_off
from pyverlet.core.link_lines import SINGULAR, eliminate_line, substitute_line
from pyverlet.core.link_shapes import LinkWay, push, way_between

MOST_RELEASES = cython.declare(cython.int, 8)
WAVES = cython.declare(cython.int, 0)
CHORDS = cython.declare(cython.int, 1)
LOST_WAY = cython.declare(cython.int, 2)
"""Directions of impulses: as described above; those at the start, whatever the tension; the current ones."""

AHEAD = cython.declare(cython.double, 0.3)
"""Weight q of the direction ahead where s is large. Values from 1/4 on are stable at any s (Newmark 1959)."""

DAMPED = cython.declare(cython.double, 0.05)
"""Part of it that damps, as in the backward Euler method."""

STEEP = cython.declare(cython.double, 0.5)
"""Cosine between the directions before and after a substep: below it the Newton step is that of a linear row."""


@inlined
def turn_share(
    k: cython.pointer(Links), r: cython.Py_ssize_t, pulled: cython.double, length: cython.double
) -> cython.double:  # fmt: skip
    """q of row r, with this length and tension impulse."""
    e: cython.Py_ssize_t = k.first[r]
    s: cython.double = 2 * k.h * pulled * (k.weight[k.node[e]] + k.weight[k.node[e + 1]]) / length
    return AHEAD * s * s / (s * s + 4)


@kernel
def aim_at_length(k: cython.pointer(Links), r: cython.Py_ssize_t, how: cython.int) -> cython.void:
    """Set what row r lacks after the drift: `along`, `wanted` and `turned`; and whether it acts.

    how: WAVES, CHORDS, or LOST_WAY, if only the current direction is useful.
    """
    e: cython.Py_ssize_t = k.first[r]
    p: LinkWay = way_between(k, k.node[e], k.node[e + 1], k.h)
    length: cython.double = sqrt(p.x * p.x + p.y * p.y)
    start: cython.double = sqrt(k.way[2 * r] * k.way[2 * r] + k.way[2 * r + 1] * k.way[2 * r + 1])
    error: cython.double = length - k.rest[r]
    pulled: cython.double = max(-k.impulse[r], -k.load[r], 0.0)
    k.acts[r] = k.intact[r] != 0 and k.soft[r] < INFINITY and length > 0 and start > 0
    if k.upper[r] <= 0 and k.impulse[r] >= 0 and k.load[r] >= 0 and error < k.target[r]:
        k.acts[r] = 0
    if not k.acts[r]:
        return
    q: cython.double = turn_share(k, r, pulled, length) if how == WAVES else 0
    lost: cython.bint = how == LOST_WAY
    x: cython.double = p.x / length
    y: cython.double = p.y / length
    dx: cython.double = k.way[2 * r] / start
    dy: cython.double = k.way[2 * r + 1] / start
    cosine: cython.double = dx * x + dy * y
    across: cython.double = 0
    turning: cython.double = q * (1 - DAMPED) * k.turning[r]
    k.turned[r] = q * pulled / length
    if lost:
        dx, dy = x, y
        k.turned[r] = 0
        cosine = 1
    elif cosine < STEEP:  # far from the solution: linearise about the start
        k.turned[r] = q * pulled / start
        error = p.x * dx + p.y * dy - k.rest[r]
        across = k.turned[r] * (p.y * dx - p.x * dy) - turning * pulled
        cosine = 1
    else:
        x0: cython.double = dx
        y0: cython.double = dy
        dx += q * (x - dx) + turning * y0
        dy += q * (y - dy) - turning * x0
        unit: cython.double = sqrt(dx * dx + dy * dy)
        dx /= unit
        dy /= unit
        cosine = x * dx + y * dy
    k.along[2 * r], k.along[2 * r + 1] = dx, dy
    let_go_of_wedged(k, k.node[e], k.node[e + 1], dx, dy)
    k.impulse[r] = k.given[2 * r] * dx + k.given[2 * r + 1] * dy
    k.wanted[2 * r] = (k.target[r] - k.soft[r] * k.impulse[r] - error) / cosine
    # -P t with t = (-dy, dx)
    k.wanted[2 * r + 1] = 0 if lost else k.given[2 * r] * dy - k.given[2 * r + 1] * dx - across


@kernel
def aim_at_rest(k: cython.pointer(Links), r: cython.Py_ssize_t) -> cython.void:
    """After the drift: rigid links may only turn. Along the current directions, their impulses have no net torque."""
    e: cython.Py_ssize_t = k.first[r]
    i: cython.Py_ssize_t = k.node[e]
    j: cython.Py_ssize_t = k.node[e + 1]
    k.acts[r] = k.intact[r] != 0 and k.stiffness[r] == INFINITY and (k.upper[r] > 0 or k.impulse[r] < 0)
    x: cython.double = k.end_way[2 * r]
    y: cython.double = k.end_way[2 * r + 1]
    k.along[2 * r], k.along[2 * r + 1] = x, y
    let_go_of_wedged(k, i, j, x, y)
    k.turned[r] = 0
    k.wanted[2 * r] = k.h * (k.chord_speed[r] - (k.u[2 * j] - k.u[2 * i]) * x - (k.u[2 * j + 1] - k.u[2 * i + 1]) * y)
    k.wanted[2 * r + 1] = 0


@kernel
def eliminate(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t, softly: cython.bint) -> cython.void:
    """Forward elimination: `answer` of each row without what follows, and the `inverse` of its block."""
    before: Mobility  # of the particle shared with the previous row
    fx: cython.double = 0
    fy: cython.double = 0
    gxx: cython.double = 0
    gxy: cython.double = 0
    gyy: cython.double = 0
    for r in range(first, end):
        e: cython.Py_ssize_t = k.first[r]
        before = moved_by(k, k.node[e])
        after: Mobility = moved_by(k, k.node[e + 1])
        free: cython.double = k.weight[k.node[e]] + k.weight[k.node[e + 1]]
        if r == first:
            gxx = gxy = gyy = fx = fy = 0
        if k.acts[r] == 0:
            fx = fy = gxx = gxy = gyy = 0
        else:
            dx: cython.double = k.along[2 * r]
            dy: cython.double = k.along[2 * r + 1]
            # Subtract B G B, with B = h times the mobility of the particle shared with the previous row.
            bxx: cython.double = k.h * before.xx
            bxy: cython.double = k.h * before.xy
            byy: cython.double = k.h * before.yy
            px: cython.double = gxx * bxx + gxy * bxy
            py: cython.double = gxx * bxy + gxy * byy
            qx: cython.double = gxy * bxx + gyy * bxy
            qy: cython.double = gxy * bxy + gyy * byy
            xx: cython.double = bxx + k.h * after.xx - bxx * px - bxy * qx
            xy: cython.double = bxy + k.h * after.xy - bxx * py - bxy * qy
            yy: cython.double = byy + k.h * after.yy - bxy * py - byy * qy
            # In the basis of d and t.
            dd: cython.double = xx * dx * dx + 2 * xy * dx * dy + yy * dy * dy + (k.soft[r] if softly else 0)
            dt: cython.double = (yy - xx) * dx * dy + xy * (dx * dx - dy * dy)
            tt: cython.double = xx * dy * dy - 2 * xy * dx * dy + yy * dx * dx
            b: cython.double = k.turned[r]
            zx: cython.double = bxx * fx + bxy * fy
            zy: cython.double = bxy * fx + byy * fy
            zd: cython.double = zx * dx + zy * dy + k.wanted[2 * r]
            zt: cython.double = zy * dx - zx * dy
            stiff: cython.double = b * tt + 1
            pivot: cython.double = dd * stiff - b * dt * dt
            if pivot <= SINGULAR * k.h * free or free <= 0:
                k.acts[r] = 0
                fx = fy = gxx = gxy = gyy = 0
            else:
                turn: cython.double = k.wanted[2 * r + 1]
                fd: cython.double = (stiff * zd - dt * (b * zt + turn)) / pivot
                ft: cython.double = (dd * (b * zt + turn) - b * dt * zd) / pivot
                fx = fd * dx - ft * dy
                fy = fd * dy + ft * dx
                gdd: cython.double = stiff / pivot
                gdt: cython.double = -b * dt / pivot
                gtt: cython.double = b * dd / pivot
                gxx = gdd * dx * dx - 2 * gdt * dx * dy + gtt * dy * dy
                gyy = gdd * dy * dy + 2 * gdt * dx * dy + gtt * dx * dx
                gxy = (gdd - gtt) * dx * dy + gdt * (dx * dx - dy * dy)
        k.answer[2 * r], k.answer[2 * r + 1] = fx, fy
        k.inverse[3 * r], k.inverse[3 * r + 1], k.inverse[3 * r + 2] = gxx, gxy, gyy


@kernel
def substitute(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.bint:
    """Back substitution: the `answer` of each row. Returns True if ropes would push; they are released, to be solved again."""
    fx: cython.double = 0
    fy: cython.double = 0
    pushes: cython.bint = False
    for r in range(end - 1, first - 1, -1):
        if r + 1 < end:
            shared: Mobility = moved_by(k, k.node[k.first[r] + 1])
            x: cython.double = k.h * (shared.xx * fx + shared.xy * fy)
            y: cython.double = k.h * (shared.xy * fx + shared.yy * fy)
            fx = k.answer[2 * r] + k.inverse[3 * r] * x + k.inverse[3 * r + 1] * y
            fy = k.answer[2 * r + 1] + k.inverse[3 * r + 1] * x + k.inverse[3 * r + 2] * y
        else:
            fx, fy = k.answer[2 * r], k.answer[2 * r + 1]
        k.answer[2 * r], k.answer[2 * r + 1] = fx, fy
        if k.acts[r] and k.upper[r] <= 0:
            all_of_it: cython.double = k.impulse[r] + fx * k.along[2 * r] + fy * k.along[2 * r + 1]
            if all_of_it > 0:
                k.acts[r] = 0
                pushes = True
    return pushes


@kernel
def give(k: cython.pointer(Links), r: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Apply an impulse between the ends of row r, N s."""
    e: cython.Py_ssize_t = k.first[r]
    k.given[2 * r] += x
    k.given[2 * r + 1] += y
    push(k, k.node[e], -x, -y)
    push(k, k.node[e + 1], x, y)


@kernel
def lets_go(k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t) -> cython.bint:
    """Release particles that `answer` pulls off surfaces; returns True if any, as the chain must then be solved again."""
    x: cython.double = 0
    y: cython.double = 0
    found: cython.bint = False
    for r in range(first, end):
        fx: cython.double = k.answer[2 * r] if k.acts[r] else 0.0
        fy: cython.double = k.answer[2 * r + 1] if k.acts[r] else 0.0
        found |= pulled_off(k, k.node[k.first[r]], x - fx, y - fy)
        x, y = fx, fy
    return pulled_off(k, k.node[k.first[end - 1] + 1], x, y) or found


@kernel
def step_chain(
    k: cython.pointer(Links), first: cython.Py_ssize_t, end: cython.Py_ssize_t, drifts: cython.bint, how: cython.int,
    share: cython.double,
) -> cython.void:  # fmt: skip
    """One Newton step: lengths after the drift; or (not drifts) their rates. Ropes do not push."""
    pushes: cython.bint
    tries: cython.int = 0
    for r in range(first, end):
        if drifts:
            aim_at_length(k, r, how)
            if not k.acts[r] and (k.given[2 * r] != 0 or k.given[2 * r + 1] != 0):
                give(k, r, -k.given[2 * r], -k.given[2 * r + 1])
                k.impulse[r] = 0
        else:
            aim_at_rest(k, r)
    while True:
        tries += 1
        if how == CHORDS:
            eliminate_line(k, first, end, drifts)
            pushes = substitute_line(k, first, end)
            pushes |= k.surfaces and lets_go(k, first, end)
        else:
            eliminate(k, first, end, drifts)
            pushes = substitute(k, first, end)
        if not pushes or tries > MOST_RELEASES:
            break
        if drifts:
            for r in range(first, end):  # released rows give nothing
                if not k.acts[r] and k.impulse[r] != 0:
                    give(k, r, -k.given[2 * r], -k.given[2 * r + 1])
                    k.impulse[r] = 0
            for r in range(first, end):
                if k.acts[r]:
                    aim_at_length(k, r, how)
    for r in range(first, end):
        if k.acts[r]:
            k.answer[2 * r] *= share
            k.answer[2 * r + 1] *= share
            give(k, r, k.answer[2 * r], k.answer[2 * r + 1])
            k.impulse[r] += k.answer[2 * r] * k.along[2 * r] + k.answer[2 * r + 1] * k.along[2 * r + 1]
