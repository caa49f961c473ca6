# mypy: ignore-errors
"""What links gave in the last substep, given again before contacts and impacts are solved."""

from __future__ import annotations

import cython
from cython.cimports.libc.math import INFINITY, sqrt

from pyverlet.core.link_arrays import DISTANCE, MOTOR, Links
from pyverlet.core.link_chains import AHEAD, give, turn_share
from pyverlet.core.link_motors import warm_motor
from pyverlet.core.link_shapes import mobility, push_row
from pyverlet.core.link_softness import kept_share
from pyverlet.core.step import Step


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def lend(k: cython.pointer(Links), i: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Of what linked particle i was given, this impulse is taken back before rows are solved."""
    if k.own[i] > 0:
        k.loaned[2 * i] += k.weight[i] * x
        k.loaned[2 * i + 1] += k.weight[i] * y


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def lend_between(k: cython.pointer(Links), r: cython.Py_ssize_t, x: cython.double, y: cython.double) -> cython.void:
    """Of what the ends of row r were given, this impulse, of the second end, is taken back."""
    lend(k, k.node[k.first[r]], -x, -y)
    lend(k, k.node[k.first[r] + 1], x, y)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def warm_block(w: cython.pointer(Step), b: cython.Py_ssize_t) -> cython.void:
    """What rows of a block gave in the last substep, along the gradients of now.

    A chain gives one share of all of it: what its light particles get is a small difference of large impulses. Impacts act on
    velocities with it, and are not taken back, so that a chain that nothing else joins turns as it will when it is solved.
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
        lent: cython.double = 1 - k.keeps[r]
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
                lend_between(k, r, lent * x, lent * y)
        else:
            push_row(k, r, k.impulse[r], k.gradient)
            for e in range(k.first[r], k.first[r + 1]):
                lend(k, k.node[e], lent * k.impulse[r] * k.gradient[2 * e], lent * k.impulse[r] * k.gradient[2 * e + 1])
