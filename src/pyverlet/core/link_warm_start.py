# mypy: ignore-errors
"""Warm start of links: their impulses of the last substep are repeated before contacts and impacts are solved."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, sqrt

from pyverlet.core.kernels import kernel
from pyverlet.core.link_arrays import DISTANCE, MOTOR, Links
from pyverlet.core.link_chains import AHEAD, give, turn_share
from pyverlet.core.link_motors import warm_motor
from pyverlet.core.link_shapes import mobility, push_row
from pyverlet.core.link_softness import kept_share
from pyverlet.core.step import Step

HEATED = cython.declare(cython.double, 2)
COOL = cython.declare(cython.double, 10)
"""Speed limit of a particle after the warm start of links and contacts: times its speed, plus times that of rest."""


@kernel
def add_warm(k: cython.pointer(Links), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Mark this impulse on linked particle i for removal before rows are solved."""
    if k.own[i] > 0:
        k.warmed[2 * i] += k.weight[i] * x
        k.warmed[2 * i + 1] += k.weight[i] * y


@kernel
def add_warm_between(k: cython.pointer(Links), r: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Mark this impulse between the ends of row r, given for the second end, for removal."""
    add_warm(k, k.node[k.first[r]], -x, -y)
    add_warm(k, k.node[k.first[r] + 1], x, y)


@kernel
def warm_block(w: cython.pointer(Step), b: cython.Py_ssize_t) -> cython.void:
    """Repeat the impulses of a block's rows along current gradients.

    A chain scales all impulses by one factor: those on its light particles are small differences of large ones. Impacts act on
    velocities that include them, so that an isolated chain turns as it will when it is solved.
    """
    k: cython.pointer(Links) = w.link_table
    r: cython.Py_ssize_t = k.block[b]
    e: cython.Py_ssize_t
    share: cython.double = 1
    if k.kind[r] == MOTOR:
        warm_motor(w, r)
        return
    for r in range(k.block[b], k.block[b + 1]):
        if k.intact[r] and not (k.lively and k.stiff[k.node[k.first[r]]] != 0):
            share = min(share, kept_share(k, k.impulse[r], k.load[r], mobility(k, r)))
    for r in range(k.block[b], k.block[b + 1]):
        k.impulse[r] *= k.scale * share
        k.load[r] = k.impulse[r]
        moves: cython.double = k.h * mobility(k, r)
        k.keeps[r] = k.soft[r] / (k.soft[r] + moves) if k.soft[r] < INFINITY and k.soft[r] + moves > 0 else 1
        extra: cython.double = 1 - k.keeps[r]
        if k.kind[r] == DISTANCE:
            x: cython.double = k.way[2 * r]
            y: cython.double = k.way[2 * r + 1]
            length: cython.double = sqrt(x * x + y * y)
            if length > 0:
                back: cython.double = 0
                if k.alone[b] and k.impulse[r] < 0:
                    back = -0.5 * k.turning[r] * turn_share(k, r, -k.impulse[r], length) / AHEAD
                x, y = x - back * y, y + back * x
                scale: cython.double = k.impulse[r] / sqrt(x * x + y * y)
                x *= scale
                y *= scale
                give(k, r, x, y)
                add_warm_between(k, r, extra * x, extra * y)
        else:
            push_row(k, r, k.impulse[r], k.gradient)
            for e in range(k.first[r], k.first[r + 1]):
                add_warm(k, k.node[e], extra * k.impulse[r] * k.gradient[2 * e], extra * k.impulse[r] * k.gradient[2 * e + 1])


@kernel
def limit_warm(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.void:
    """Reduce the warm start of linked particle i if it becomes much faster than before, contacts included.

    A light particle at the kink of a loaded chain gets two large impulses that no longer cancel, and would be shot at what it
    touches. Only contacts lack what is removed: rows begin from zero.
    """
    k: cython.pointer(Links) = w.link_table
    axis: cython.int
    x: cython.double = k.warmed[2 * i]
    y: cython.double = k.warmed[2 * i + 1]
    extra: cython.double = x * x + y * y
    before: cython.double = sqrt(k.begun[3 * i] * k.begun[3 * i] + k.begun[3 * i + 1] * k.begun[3 * i + 1])
    most: cython.double = HEATED * before + COOL * k.least
    square: cython.double = k.u[2 * i] * k.u[2 * i] + k.u[2 * i + 1] * k.u[2 * i + 1]
    if k.own[i] == 0 or square <= most * most or extra == 0:
        return
    # Choose t so that |u - t warmed| equals `most`, or is as small as possible.
    along: cython.double = (k.u[2 * i] * x + k.u[2 * i + 1] * y) / extra
    rest: cython.double = along * along - (square - most * most) / extra
    t: cython.double = min(max(along - sqrt(max(rest, 0.0)), 0.0), 1.0)
    at: cython.Py_ssize_t = 2 * cython.cast(cython.Py_ssize_t, k.sorted_index[i])
    for axis in range(2):
        excess: cython.double = t * k.warmed[2 * i + axis]
        k.warmed[2 * i + axis] -= excess
        k.u[2 * i + axis] -= excess
        w.acceleration[at + axis] -= cython.cast(real, excess / k.kick)
