# mypy: ignore-errors
"""Energy sums that the ledger reads at the start and end of a frame."""

from __future__ import annotations

import cython

from pyverlet.core.link_motors import work_of_last_motors
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import DRAG, NORMAL, NORMAL_Y, PUSH, ROLL, SPEED, SPEED_Y, SPIN, row_of
from pyverlet.core.work import BY_FRICTION, BY_IMPACTS, BY_MOTORS, BY_PLACES, BY_ROLLING, BY_WALLS, WORK, moment


@cython.cfunc
def work_of_frame(w: cython.pointer(Step)) -> tuple:
    """Sums of `Step.work` over all particles, J."""
    sums: cython.double[6]  # WORK
    k: cython.int
    for k in range(WORK):
        sums[k] = 0
    for i in range(w.count):
        for k in range(WORK):
            sums[k] += w.work[WORK * i + k]
    return sums[BY_IMPACTS], sums[BY_FRICTION], sums[BY_WALLS], sums[BY_PLACES], sums[BY_ROLLING], sums[BY_MOTORS]


@cython.cfunc
def energy_of_last(w: cython.pointer(Step), share: cython.double) -> cython.double:
    """Kinetic energy that `share` of the last contact impulses gave, J."""
    total: cython.double = 0
    half: cython.double = 0.5 * share
    for i in range(w.count):
        if w.inverse_mass[i] > 0:
            gx: cython.double = w.given[2 * i]
            gy: cython.double = w.given[2 * i + 1]
            moved: cython.double = gx * (w.velocity[2 * i] - half * gx) + gy * (w.velocity[2 * i + 1] - half * gy)
            if w.rough:
                turn: cython.double = w.given_spin[i]
                r: cython.double = w.radius[i]
                moved += moment(w, i) * r * r * turn * (w.spin[i] - half * turn)
            total += share * moved / w.inverse_mass[i]
    return total


@cython.cfunc
def friction_of_last(w: cython.pointer(Step), share: cython.double) -> tuple:
    """The parts of that along tangents, by rolling resistance, and by motors, J."""
    by_friction: cython.double = 0
    rolled: cython.double = 0
    half: cython.double = 0.5 * share
    i: cython.Py_ssize_t
    j: cython.Py_ssize_t
    k: cython.Py_ssize_t
    if not w.rough:
        return 0.0, 0.0, 0.0
    for s in range(w.groups):
        for k in range(w.begin[s], w.begin[s] + w.swept[s]):
            i, j = w.i[k], w.j[k]
            jt: cython.double = w.tangent_impulse[k]
            roll: cython.double = w.roll_impulse[k] if w.rolls else 0
            if (jt == 0 and roll == 0) or (k > w.begin[s] and w.i[k - 1] == i and w.j[k - 1] == j):
                continue
            x: cython.double = w.velocity[2 * j] - half * w.given[2 * j]
            y: cython.double = w.velocity[2 * j + 1] - half * w.given[2 * j + 1]
            x -= w.velocity[2 * i] - half * w.given[2 * i]
            y -= w.velocity[2 * i + 1] - half * w.given[2 * i + 1]
            spin: cython.double = w.spin[i] - half * w.given_spin[i]
            other: cython.double = w.spin[j] - half * w.given_spin[j]
            rim_speed: cython.double = w.radius[i] * spin + w.radius[j] * other
            inverse: cython.double = w.inverse_mass[i]
            inverse += w.inverse_mass[j]
            by_friction += jt * (x * w.normal_y[k] - y * w.normal_x[k] + rim_speed) / inverse
            rolled += roll * (other - spin) / inverse
    row: cython.pointer(cython.double) = w.contact
    if w.surfaces_good:
        for i in range(w.count):
            for k in range(w.contact_begin[i], w.contact_end[i]):
                first: cython.Py_ssize_t = row_of(k)
                if row[first + PUSH] > 0 and w.inverse_mass[i] > 0:
                    x = w.velocity[2 * i] - half * w.given[2 * i] - row[first + SPEED]
                    y = w.velocity[2 * i + 1] - half * w.given[2 * i + 1] - row[first + SPEED_Y]
                    spin = w.spin[i] - half * w.given_spin[i]
                    slip: cython.double = x * row[first + NORMAL_Y] - y * row[first + NORMAL] - w.radius[i] * spin
                    by_friction += row[first + DRAG] * slip / w.inverse_mass[i]
                    rolled += row[first + ROLL] * (spin - row[first + SPIN]) / w.inverse_mass[i]
    return share * by_friction, share * rolled, work_of_last_motors(w, share)
