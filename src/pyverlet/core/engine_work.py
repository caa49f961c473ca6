# mypy: ignore-errors
"""What the ledger asks of the engine when a frame begins and ends."""

from __future__ import annotations

import cython

from pyverlet.core.step import Step
from pyverlet.core.surface_rows import CONTACT, DRAG, NORMAL, PUSH, ROLL, SPEED, SPIN


@cython.cfunc
def energy_of_last(w: cython.pointer(Step), share: cython.double) -> cython.double:
    """By how much kinetic energy is larger than without `share` of what contacts gave in the last substep, J."""
    total: cython.double = 0
    half: cython.double = 0.5 * share
    i: cython.Py_ssize_t
    for i in range(w.count):
        if w.inverse_mass[i] > 0:
            gx: cython.double = w.given[2 * i]
            gy: cython.double = w.given[2 * i + 1]
            turn: cython.double = w.given_spin[i] if w.rough else 0
            r: cython.double = w.radius[i]
            moved: cython.double = gx * (w.velocity[2 * i] - half * gx) + gy * (w.velocity[2 * i + 1] - half * gy)
            total += share * (moved + 0.5 * r * r * turn * (w.spin[i] - half * turn)) / w.inverse_mass[i]
    return total


@cython.cfunc
def friction_of_last(w: cython.pointer(Step), share: cython.double) -> cython.double:
    """The part of that along tangents, J."""
    total: cython.double = 0
    half: cython.double = 0.5 * share
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    k: cython.Py_ssize_t
    s: cython.Py_ssize_t
    if not w.rough:
        return 0.0
    for s in range(w.groups):
        for k in range(w.begin[s], w.begin[s] + w.swept[s]):
            if w.tangent_impulse[k] == 0 or (k > w.begin[s] and w.i[k - 1] == w.i[k] and w.j[k - 1] == w.j[k]):
                continue
            i, j = w.i[k], w.j[k]
            jt: cython.double = w.tangent_impulse[k]
            x: cython.double = w.velocity[2 * j] - half * w.given[2 * j]
            y: cython.double = w.velocity[2 * j + 1] - half * w.given[2 * j + 1]
            x -= w.velocity[2 * i] - half * w.given[2 * i]
            y -= w.velocity[2 * i + 1] - half * w.given[2 * i + 1]
            rim_speed: cython.double = w.radius[i] * (w.spin[i] - half * w.given_spin[i])
            rim_speed += w.radius[j] * (w.spin[j] - half * w.given_spin[j])
            inverse: cython.double = w.inverse_mass[i]
            inverse += w.inverse_mass[j]
            total += jt * (x * w.normal_y[k] - y * w.normal_x[k] + rim_speed) / inverse
    row: cython.pointer(cython.double) = w.contact
    if w.surfaces_good:
        for i in range(w.count):
            for k in range(w.contact_begin[i], w.contact_end[i]):
                first: cython.Py_ssize_t = CONTACT * k
                if row[first + PUSH] > 0 and row[first + DRAG] != 0 and w.inverse_mass[i] > 0:
                    x = w.velocity[2 * i] - half * w.given[2 * i] - row[first + SPEED]
                    y = w.velocity[2 * i + 1] - half * w.given[2 * i + 1] - row[first + SPEED + 1]
                    rim_speed = w.radius[i] * (w.spin[i] - half * w.given_spin[i])
                    slip: cython.double = x * row[first + NORMAL + 1] - y * row[first + NORMAL] - rim_speed
                    total += row[first + DRAG] * slip / w.inverse_mass[i]
    return share * total


@cython.cfunc
def rolling_of_last(w: cython.pointer(Step), share: cython.double) -> cython.double:
    """The part of that by what resists rolling, J."""
    total: cython.double = 0
    half: cython.double = 0.5 * share
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    k: cython.Py_ssize_t
    s: cython.Py_ssize_t
    inverse: cython.double
    spin: cython.double
    if not w.rolls:
        return 0.0
    for s in range(w.groups):
        for k in range(w.begin[s], w.begin[s] + w.swept[s]):
            i, j = w.i[k], w.j[k]
            if w.roll_impulse[k] != 0 and not (k > w.begin[s] and w.i[k - 1] == i and w.j[k - 1] == j):
                spin = w.spin[j] - half * w.given_spin[j]
                spin -= w.spin[i] - half * w.given_spin[i]
                inverse = w.inverse_mass[i]
                inverse += w.inverse_mass[j]
                total += w.roll_impulse[k] * spin / inverse
    if w.surfaces_good:
        for i in range(w.count):
            for k in range(w.contact_begin[i], w.contact_end[i]):
                if w.contact[CONTACT * k + PUSH] > 0 and w.inverse_mass[i] > 0:
                    spin = w.spin[i] - half * w.given_spin[i] - w.contact[CONTACT * k + SPIN]
                    total += w.contact[CONTACT * k + ROLL] * spin / w.inverse_mass[i]
    return share * total
