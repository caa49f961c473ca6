# mypy: ignore-errors
"""Motors: rows that keep the spin of a disc, relative to an arm or the world, at a speed, with a torque of at most `upper`.

With s the spin and A the angle of the arm, from its first particle to its second, the row is dA/dt - s = -speed. Its accumulated
angular impulse J, which turns the disc by -J, stays between -upper K and upper K, K being the seconds of acceleration of the
substep; it is warm-started whole, like rolling resistance. Arms get a couple along grad A, so the angular momentum of disc and
arm together is conserved.
"""

from __future__ import annotations

import cython
from cython.cimports.lanes import real

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.link_arrays import MOTOR, Links
from pyverlet.core.link_holds import mobility_along
from pyverlet.core.link_shapes import push
from pyverlet.core.step import Step
from pyverlet.core.work import BY_MOTORS, WORK


@inlined
def spin_mobility(w: cython.pointer(Step), i: cython.Py_ssize_t) -> cython.double:
    """1 / I of linked particle i, 1/(kg m^2)."""
    k: cython.pointer(Links) = w.link_table
    r: cython.double = w.radius[k.sorted_index[i]]
    return k.own[i] * k.ease[i] / (r * r)


@kernel
def give_turn(
    w: cython.pointer(Step), r: cython.Py_ssize_t, change: cython.double, along: cython.pointer(cython.double)
) -> cython.void:
    """Apply the angular impulse -change to the disc of motor r, and `change` to its arm along that gradient."""
    k: cython.pointer(Links) = w.link_table
    i: cython.Py_ssize_t = k.node[k.first[r]]
    e: cython.Py_ssize_t
    k.impulse[r] += change
    if k.own[i] > 0:
        turned: cython.double = change * spin_mobility(w, i)
        k.spun[i] -= turned
        k.rim[i] -= turned * w.radius[k.sorted_index[i]]
    for e in range(k.first[r], k.first[r + 1]):
        push(k, k.node[e], change * along[2 * e], change * along[2 * e + 1])


@kernel
def warm_motor(w: cython.pointer(Step), r: cython.Py_ssize_t) -> cython.void:
    """Warm start of motor r: repeat its last impulse, limited by its current torque."""
    k: cython.pointer(Links) = w.link_table
    most: cython.double = k.upper[r] * k.kick
    k.load[r] = max(min(k.scale * k.impulse[r], most), -most)
    k.keeps[r] = 1
    k.impulse[r] = 0
    give_turn(w, r, k.load[r], k.gradient)


@kernel
def turn_motor(w: cython.pointer(Step), r: cython.Py_ssize_t, along: cython.pointer(cython.double)) -> cython.void:
    """Drive the disc of motor r to its speed, within its torque."""
    k: cython.pointer(Links) = w.link_table
    i: cython.Py_ssize_t = k.node[k.first[r]]
    e: cython.Py_ssize_t
    free: cython.double = spin_mobility(w, i)
    rate: cython.double = -k.rim[i] / w.radius[k.sorted_index[i]]
    most: cython.double = k.upper[r] * k.kick
    if k.intact[r] == 0:
        return
    for e in range(k.first[r], k.first[r + 1]):
        x: cython.double = along[2 * e]
        y: cython.double = along[2 * e + 1]
        rate += x * k.u[2 * k.node[e]] + y * k.u[2 * k.node[e] + 1]
        free += mobility_along(k, k.node[e], x, y, x, y)
    if free > 0:
        wanted: cython.double = k.impulse[r] - (rate + k.rest[r]) / free
        give_turn(w, r, max(min(wanted, most), -most) - k.impulse[r], along)


@kernel
def add_motor_work(w: cython.pointer(Step)) -> cython.void:
    """Book the work of motors in this substep, J dA/dt - J s with means of before and after, as in `core.work`."""
    k: cython.pointer(Links) = w.link_table
    e: cython.Py_ssize_t
    axis: cython.int
    for r in range(k.rows):
        if k.kind[r] == MOTOR and k.impulse[r] != 0:
            i: cython.Py_ssize_t = k.sorted_index[k.node[k.first[r]]]
            rate: cython.double = -0.5 * (cython.cast(cython.double, w.free_spin[i]) + w.motion[4 * i + 2])
            for e in range(k.first[r], k.first[r + 1]):
                for axis in range(2):
                    at: cython.Py_ssize_t = k.sorted_index[k.node[e]]
                    before: cython.double = w.free[2 * at + axis]
                    after: cython.double = w.motion[4 * at + axis] - w.acceleration[2 * at + axis] * w.h
                    rate += k.gradient[2 * e + axis] * 0.5 * (before + after)
            w.work[WORK * i + BY_MOTORS] += k.impulse[r] * rate


@kernel
def keep_motor_spin(w: cython.pointer(Step)) -> cython.void:
    """Count spins by motors as free motion for contacts: they are not impacts, which are limited."""
    k: cython.pointer(Links) = w.link_table
    for i in range(k.count):
        if k.powered[i] > 0:
            w.free_spin[k.sorted_index[i]] += cython.cast(real, k.spun[i])


@cython.cfunc
def work_of_last_motors(w: cython.pointer(Step), share: cython.double) -> cython.double:
    """Energy that `share` of the last motor impulses gave at the end of a frame, J."""
    k: cython.pointer(Links) = w.link_table
    e: cython.Py_ssize_t
    axis: cython.int
    half: cython.double = 0.5 * share
    total: cython.double = 0
    if not w.linked or not k.motors:
        return 0.0
    for r in range(k.rows):
        if k.kind[r] == MOTOR:
            i: cython.Py_ssize_t = k.sorted_index[k.node[k.first[r]]]
            rate: cython.double = half * w.given_spin[i] - w.spin[i]
            for e in range(k.first[r], k.first[r + 1]):
                for axis in range(2):
                    at: cython.Py_ssize_t = 2 * cython.cast(cython.Py_ssize_t, k.sorted_index[k.node[e]]) + axis
                    rate += k.slope[2 * e + axis] * (w.velocity[at] - half * w.given[at])
            total += share * k.impulse[r] * rate
    return total
