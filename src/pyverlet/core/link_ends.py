# mypy: ignore-errors
"""Makes velocities at the end of a frame consistent with links."""

from __future__ import annotations

import cython
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, sqrt

from pyverlet.core.kernels import kernel
from pyverlet.core.link_arrays import DISTANCE, MOTOR, Links
from pyverlet.core.link_blocks import push_row, solve_block
from pyverlet.core.link_chains import give
from pyverlet.core.link_pins import pin_speed
from pyverlet.core.link_shapes import LinkWay, measure_row, mobility, way_between
from pyverlet.core.link_softness import force_gained
from pyverlet.core.step import Step

SWEEPS = cython.declare(cython.int, 3)


@kernel
def turn_impulses(k: cython.pointer(Links), share: cython.double, half: cython.double) -> cython.void:
    """Turn the last impulses of rows, of which `share` counts, to the current directions, and update springs to their current
    force. half: seconds for which it counts.
    """
    for r in range(k.rows):
        now: cython.double = measure_row(k, r, 0)
        k.target[r] = k.impulse[r]
        given: cython.double = share * k.impulse[r]
        if k.impulse[r] != 0:
            given += half * force_gained(k, k.stiffness[r], mobility(k, r), k.value[r], now)
        if k.kind[r] == DISTANCE:
            d: LinkWay = way_between(k, k.node[k.first[r]], k.node[k.first[r] + 1], 0)
            length: cython.double = sqrt(d.x * d.x + d.y * d.y)
            x: cython.double = d.x / length if length > 0 else 0
            y: cython.double = d.y / length if length > 0 else 0
            k.end_way[2 * r], k.end_way[2 * r + 1], k.chord_speed[r] = x, y, 0
            if k.intact[r]:
                give(k, r, given * x - share * k.given[2 * r], given * y - share * k.given[2 * r + 1])
        elif k.intact[r]:
            if k.kind[r] == MOTOR:  # since the drift it acts along current directions
                given = share * k.given[2 * r]
                push_row(k, r, -given, k.gradient)
            else:
                push_row(k, r, -share * k.impulse[r], k.gradient)
            push_row(k, r, given, k.slope)


@kernel
def project(w: cython.pointer(Step)) -> cython.void:
    """Project velocities so that no rigid row changes and rigid pins follow their points; stored impulses stay unchanged."""
    k: cython.pointer(Links) = w.link_table
    b: cython.Py_ssize_t
    _: cython.int
    for p in range(k.pins):
        if k.pin_intact[p] and k.pin_stiffness[p] == INFINITY:
            i: cython.Py_ssize_t = k.pin_node[p]
            k.weight[i] = 0
            k.u[2 * i], k.u[2 * i + 1] = pin_speed(k, p, 0), pin_speed(k, p, 1)
    for _ in range(1 if k.colours == 1 else SWEEPS):
        for b in range(k.chunk[k.colour[k.colours]]):
            if k.kind[k.block[b]] != MOTOR:
                solve_block(w, b, False)
    for r in range(k.rows):
        k.impulse[r] = k.target[r]


@kernel
def show_links(w: cython.pointer(Step), half: cython.double, kick: cython.double) -> cython.void:
    """End a frame: velocities that satisfy rigid links at the time of the positions (RATTLE, Andersen 1983).

    Half a substep's share of link impulses was along the directions at its start. The correction counts as `given`, which the
    next frame removes. half: seconds by which velocities were advanced; kick: seconds that `given` corresponds to.
    """
    k: cython.pointer(Links) = w.link_table
    axis: cython.int
    for i in range(k.count):
        for axis in range(2):
            k.x[2 * i + axis] = w.position[2 * k.sorted_index[i] + axis]
            k.u[2 * i + axis] = w.velocity[2 * k.sorted_index[i] + axis]
        k.own[i] = k.weight[i] = w.inverse_mass[k.sorted_index[i]]
        k.held[i] = -1
    turn_impulses(k, half / kick, half)
    project(w)
    for i in range(k.count):
        for axis in range(2):
            at: cython.Py_ssize_t = 2 * k.sorted_index[i] + axis
            shown: real = cython.cast(real, k.u[2 * i + axis])
            change: real = shown - w.velocity[at]
            w.given[at] += cython.cast(real, change * kick / half)
            w.acceleration[at] += cython.cast(real, change / half)
            w.velocity[at] = shown
