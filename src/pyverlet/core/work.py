# mypy: ignore-errors
"""Energy changes by contacts, for the ledger; only while `records_work`.

Let u_0 and u be velocities in the middle of a substep before and after contacts, and a the acceleration by forces. Contacts that
change u before x += u h change the energy of a particle at the end of the substep, with the potential of a, by
m (|u - a h/2|^2 - |u_0 - a h/2|^2) / 2, and those after it by the same with + a h/2. An impulse J at time t, which also moves the
end of the path by -J t / m, changes it by J . (mean of u before and after + a (t - h/2)).
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real

from pyverlet.core.cells import BLOCK
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.step import Step
from pyverlet.core.surface_rows import DRAG, NORMAL, NORMAL_Y, ROLL, SIDES, SPEED, SPEED_Y, SPIN, row_of

WORK = cython.declare(cython.int, 6)  # columns per particle, J
BY_IMPACTS = cython.declare(cython.int, 0)  # normal, by impacts
BY_FRICTION = cython.declare(cython.int, 1)
BY_WALLS = cython.declare(cython.int, 2)  # by moving surfaces of the room
BY_PLACES = cython.declare(cython.int, 3)  # against `acceleration`, by moving particles
BY_ROLLING = cython.declare(cython.int, 4)  # by rolling resistance
BY_MOTORS = cython.declare(cython.int, 5)


@inlined
def moment(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.double:
    """Moment of inertia of particle i over m r^2; 1/2, arbitrarily, if its rotation is fixed."""
    ease: cython.double = w.ease[w.mixed * i]
    return 1 / (ease if ease > 0 else 2.0)


@inlined
def energy_at(
    w: cython.pointer(Step), i: cython.Py_ssize_t, rough: cython.bint, kinetic: cython.double, lag: cython.double
) -> cython.double:
    """`kinetic` times the kinetic energy of particle i, spin included, plus m a . u lag, J; 0 if pinned."""
    v: cython.pointer(real) = w.motion if rough else w.velocity
    width: cython.Py_ssize_t = 4 if rough else 2
    ux: cython.double = v[width * i]
    uy: cython.double = v[width * i + 1]
    square: cython.double = ux * ux + uy * uy
    if rough:
        rim: cython.double = w.motion[4 * i + 2] * cython.cast(cython.double, w.radius[i])
        square += moment(w, i) * rim * rim
    sums: cython.double = 0.5 * kinetic * square
    if lag != 0:
        sums += lag * (w.acceleration[2 * i] * ux + w.acceleration[2 * i + 1] * uy)
    inverse: cython.double = w.inverse_mass[i]
    free: cython.double = 1.0 if inverse > 0 else 0.0
    return free * sums / (inverse if inverse > 0 else 1.0)


@inlined
def sum_of_energies(
    w: cython.pointer(Step), a: cython.Py_ssize_t, b: cython.Py_ssize_t, rough: cython.bint, kinetic: cython.double,
    lag: cython.double,
) -> cython.double:  # fmt: skip
    """Sum of `energy_at` from particle a up to b; eight partial sums hide the latency of additions."""
    sums: cython.double[8]
    lane: cython.Py_ssize_t
    k: cython.Py_ssize_t
    whole: cython.Py_ssize_t = b - (b - a) % 8
    for lane in range(8):
        sums[lane] = 0
    for k in range(a, whole, 8):
        for lane in range(8):
            sums[lane] = sums[lane] + energy_at(w, k + lane, rough, kinetic, lag)
    total: cython.double = 0
    for lane in range(8):
        total += sums[lane]
    for k in range(whole, b):
        total += energy_at(w, k, rough, kinetic, lag)
    return total


@kernel
def energy_of(w: cython.pointer(Step), block: cython.int, kinetic: cython.double, lag: cython.double) -> cython.double:
    """Sum of `energy_at` over a block, J."""
    a: cython.Py_ssize_t = block * BLOCK
    b: cython.Py_ssize_t = min(a + BLOCK, w.count)
    if lag == 0:
        return sum_of_energies(w, a, b, True, kinetic, 0) if w.rough else sum_of_energies(w, a, b, False, kinetic, 0)
    return sum_of_energies(w, a, b, True, kinetic, lag) if w.rough else sum_of_energies(w, a, b, False, kinetic, lag)


@kernel
def add_start_work(what: cython.p_void, block: cython.int) -> cython.void:
    """Book the energy before contacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    h: cython.double = w.h
    w.gained[block] -= energy_of(w, block, 1, -0.5 * h)


@kernel
def add_drift_work(w: cython.pointer(Step), block: cython.int) -> cython.void:
    """Book the energy between contacts before and after the drift."""
    h: cython.double = w.h
    w.gained[block] -= energy_of(w, block, 0, h)


@kernel
def add_end_work(what: cython.p_void, block: cython.int) -> cython.void:
    """Book the energy after contacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    h: cython.double = w.h
    w.gained[block] += energy_of(w, block, 1, 0.5 * h)


@kernel
def add_place_work(w: cython.pointer(Step), i: cython.Py_ssize_t, dx: cython.double, dy: cython.double) -> cython.double:
    """Book a displacement of particle i; returns the change of its energy in `acceleration`, J."""
    if w.inverse_mass[i] == 0:
        return 0.0
    gained: cython.double = -(w.acceleration[2 * i] * dx + w.acceleration[2 * i + 1] * dy) / w.inverse_mass[i]
    w.work[WORK * i + BY_PLACES] += gained
    return gained


@kernel
def add_impact_work(
    w: cython.pointer(Step), i: cython.Py_ssize_t, dx: cython.double, dy: cython.double, turn: cython.double, t: cython.double
) -> cython.void:
    """Book an impulse at time t that has changed the velocity of particle i by (dx, dy), and its spin unless it was normal."""
    if w.inverse_mass[i] == 0:
        return
    width: cython.Py_ssize_t = 4 if w.rough else 2
    v: cython.pointer(real) = w.motion if w.rough else w.velocity
    back: cython.double = 0.5 * cython.cast(cython.double, w.h)
    ux: cython.double = v[width * i] - 0.5 * dx - w.acceleration[2 * i] * back
    uy: cython.double = v[width * i + 1] - 0.5 * dy - w.acceleration[2 * i + 1] * back
    work: cython.double = ux * dx + uy * dy
    if turn != 0:
        r: cython.double = w.radius[i]
        spin: cython.double = w.motion[4 * i + 2] - 0.5 * turn
        work += moment(w, i) * r * r * turn * spin
    work = work / w.inverse_mass[i] + add_place_work(w, i, -dx * t, -dy * t)
    w.work[WORK * i + (BY_IMPACTS if turn == 0 else BY_FRICTION)] += work


@kernel
def add_belt_work(
    w: cython.pointer(Step), i: cython.Py_ssize_t, k: cython.Py_ssize_t, jt: cython.double, nx: cython.double, ny: cython.double
) -> cython.void:
    """Book the impulse jt of surface contact k on particle i along (ny, -nx) as far as the surface moves: it is not friction."""
    along: cython.double = w.contact[row_of(k) + SPEED] * ny - w.contact[row_of(k) + SPEED_Y] * nx
    if along != 0 and w.inverse_mass[i] > 0:
        w.work[WORK * i + BY_FRICTION] -= jt * along / w.inverse_mass[i]
        if 0 <= w.surface[k] < SIDES:
            w.work[WORK * i + BY_WALLS] += jt * along / w.inverse_mass[i]


@kernel
def add_grip_work(what: cython.p_void, block: cython.int) -> cython.void:
    """Book the friction work of surfaces on a block in this substep: half the sum of slip before and after contacts."""
    w: cython.pointer(Step) = cython.cast(cython.pointer(Step), what)
    row: cython.pointer(cython.double) = w.contact
    h: cython.double = w.h
    k: cython.Py_ssize_t
    for n in range(block * BLOCK, block * BLOCK + w.at_surface_count[block]):
        i: cython.Py_ssize_t = w.at_surface[n]
        for k in range(w.contact_begin[i], w.contact_end[i]):
            first: cython.Py_ssize_t = row_of(k)
            if row[first + DRAG] != 0 and w.inverse_mass[i] > 0:
                nx: cython.double = row[first + NORMAL]
                ny: cython.double = row[first + NORMAL_Y]
                jt: cython.double = row[first + DRAG]
                ux: cython.double = w.free[2 * i]
                uy: cython.double = w.free[2 * i + 1]
                turn: cython.double = w.free_spin[i]
                ux = 0.5 * (ux + w.motion[4 * i] - w.acceleration[2 * i] * h)
                uy = 0.5 * (uy + w.motion[4 * i + 1] - w.acceleration[2 * i + 1] * h)
                turn = 0.5 * (turn + w.motion[4 * i + 2]) * w.radius[i]
                w.work[WORK * i + BY_FRICTION] += jt * (ux * ny - uy * nx - turn) / w.inverse_mass[i]
                add_belt_work(w, i, k, jt, nx, ny)
            if w.rolls and row[first + ROLL] != 0 and w.inverse_mass[i] > 0:
                turn = 0.5 * (w.free_spin[i] + cython.cast(cython.double, w.motion[4 * i + 2]))
                w.work[WORK * i + BY_ROLLING] += row[first + ROLL] * (turn - row[first + SPIN]) / w.inverse_mass[i]
                if 0 <= w.surface[k] < SIDES:
                    w.work[WORK * i + BY_WALLS] += row[first + ROLL] * row[first + SPIN] / w.inverse_mass[i]


@kernel
def add_friction_work(w: cython.pointer(Step), s: cython.Py_ssize_t) -> cython.void:
    """Book the friction work of the pairs of group s in this substep, with mean slip: independent of the order of contacts."""
    first: cython.Py_ssize_t = w.begin[s]
    for k in range(first, first + w.swept[s]):
        if w.tangent_impulse[k] != 0 or (w.rolls and w.roll_impulse[k] != 0):
            i: cython.Py_ssize_t = w.i[k]
            j: cython.Py_ssize_t = w.j[k]
            if k > first and w.i[k - 1] == w.i[k] and w.j[k - 1] == w.j[k]:
                continue  # repeated to fill a batch
            ux: cython.double = w.free[2 * j]
            uy: cython.double = w.free[2 * j + 1]
            a: cython.double = w.free_spin[i]
            b: cython.double = w.free_spin[j]
            spins: cython.double = b + w.motion[4 * j + 2] - a - w.motion[4 * i + 2]
            ux = ux - w.free[2 * i] + w.motion[4 * j] - w.motion[4 * i]
            uy = uy - w.free[2 * i + 1] + w.motion[4 * j + 1] - w.motion[4 * i + 1]
            a = (a + w.motion[4 * i + 2]) * w.radius[i]
            b = (b + w.motion[4 * j + 2]) * w.radius[j]
            inverse: cython.double = w.inverse_mass[i]
            inverse += w.inverse_mass[j]
            slip: cython.double = 0.5 * (ux * w.normal_y[k] - uy * w.normal_x[k] + a + b)
            w.work[WORK * i + BY_FRICTION] += w.tangent_impulse[k] * slip / inverse
            if w.rolls:
                w.work[WORK * i + BY_ROLLING] += w.roll_impulse[k] * 0.5 * spins / inverse
