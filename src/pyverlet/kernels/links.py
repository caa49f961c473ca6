"""Links: constraints between particles, solved once a substep on the positions the integrator predicts.

A row has a value C(x), its gradient g, a stiffness k and a damping d (kernels.shapes measures them). It acts with the force
F = -(k C + d dC/dt) along g. What is solved for is lam = F h^2; then x moves by w g lam and the velocity by that over h (Macklin
et al. 2019, Small Steps in Physics Simulation). Two things differ from there, both for the sake of energy:

The force acts along g at the start of the substep, not at its end. For a rigid link that is SHAKE (Ryckaert, Ciccotti, Berendsen
1977): with an integrator of Stormer's kind symplectic, where projection along the new direction brakes whatever turns. Only where
the pull makes particles swing sideways faster than substeps can follow (a light rope, a heavy ball) the new direction is taken.

For a soft link the C of the force is a C+ + b C0 + c C-, of the end, the start and the substep before. (1/4, 1/2, 1/4) neither
damps nor explodes, (1, 0, 0) is XPBD and settles links stiffer than the substep can follow; `blend` goes from one to the other.

Rows are solved colour by colour (Gauss-Seidel); those of one colour share no particle. `kernels.chains` solves whole chains of
distances at once, `kernels.link_rows` all other rows.

All of that is done on a compact copy of the linked particles, in the dtype of the world: where a substep starts, where the
integrator has put them, and by how much links have moved them since, which is little and keeps its digits.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    LANES,
    larger,
    load,
    load_rows,
    pick,
    place,
    put,
    spread,
    square_root,
    store,
    take,
    where_above,
    where_zero,
)
from pyverlet.compile.rows import store_rows
from pyverlet.ground.constants import FED, LINK_LEAST_N, LINK_MEMORY_S, LINK_RESOLVED, PUSHED, REST_ACCELERATIONS
from pyverlet.kernels.seam import apart_lanes

_CARRIED = 1.0 - PUSHED / FED
"""Part of an acceleration, times h, that a contact at rest has in the velocity."""

_CHUNK = 1024
"""Particles that one thread takes at a time."""


@kernel
def share_settled(s):
    """From 0, follow the motion, to 1, settle it; s = (frequency * h)^2."""
    return s * s / (s * s + LINK_RESOLVED * LINK_RESOLVED)


@kernel
def blend(stiffness, damping, ww, h):
    """(K+, K0, K-): the force is -(K+ C+ + K0 C0 + K- C-). ww: sum of w |g|^2, 1/kg for a distance."""
    s = h * h * stiffness * ww  # (natural frequency * h)^2
    q = share_settled(s)
    kp, k0, km = stiffness * (1.0 + 3.0 * q) / 4.0, stiffness * (1.0 - q) / 2.0, stiffness * (1.0 - q) / 4.0
    # The rate of C likewise: (C+ - C-) / 2h where the substep resolves the damping, (C+ - C0) / h where it does not.
    s = h * damping * ww
    p = 0.5 + 0.5 * s / (1.0 + s)
    rate = damping / h
    return kp + rate * p, k0 + rate * (1.0 - 2.0 * p), km - rate * (1.0 - p)


@kernel
def note_force(force, last, lam, intact, h):
    """last = -lam / h^2, the pull in N, which for rigid links is noisy; let `force` follow it, but for the broken."""
    part = h / (h + LINK_MEMORY_S)
    for r in range(force.shape[0]):
        last[r] = -lam[r] / (h * h)
        if intact[r]:
            force[r] += part * (last[r] - force[r])
            if abs(force[r]) < LINK_LEAST_N:
                force[r] = 0.0


@kernel
def snap(force, strength, intact):
    """Break every row that pulls or pushes harder than its strength, N."""
    for r in range(force.shape[0]):
        if abs(force[r]) > strength[r]:
            intact[r] = 0


@parallel_kernel
def remember(past_start, past_left, past_calm, position, particle, start, calm):
    """A frame is over: what `recall` takes up. position: of all, in the user's order."""
    for c in prange((particle.shape[0] + _CHUNK - 1) // _CHUNK):
        for k in range(c * _CHUNK, min((c + 1) * _CHUNK, particle.shape[0])):
            p = particle[k]
            past_start[k, 0], past_start[k, 1], past_calm[k] = start[k, 0], start[k, 1], calm[k]
            past_left[k, 0], past_left[k, 1] = position[p, 0], position[p, 1]


@kernel
def pins_differ(mass, particle, pinned):
    """Whether anybody among these particles has been pinned since, or let go."""
    differ = False
    for k in range(particle.shape[0]):
        differ |= (mass[particle[k]] == np.inf) != pinned[k]
    return differ


@parallel_kernel
def recall_all(past_start, past_left, past_calm, position, particle, start, calm):
    """`recall`, if the same particles are linked as then, and none has come or gone."""
    for c in prange((particle.shape[0] + _CHUNK - 1) // _CHUNK):
        for k in range(c * _CHUNK, min((c + 1) * _CHUNK, particle.shape[0])):
            p = particle[k]
            calm[k] = np.nan
            if past_left[k, 0] == position[p, 0] and past_left[k, 1] == position[p, 1]:
                start[k, 0], start[k, 1], calm[k] = past_start[k, 0], past_start[k, 1], past_calm[k]


@kernel
def recall(past_number, past_start, past_left, past_calm, number, position, particle, start, calm):
    """A frame begins: what is remembered of each `particle`, in `start` and `calm`, if it is where it was left; NaN if not.

    number, position: of all, in the user's order; `particle` and both numbers are ascending.
    """
    r = 0
    for k in range(particle.shape[0]):
        p = particle[k]
        calm[k] = np.nan
        while r < past_number.shape[0] and past_number[r] < number[p]:
            r += 1
        if r == past_number.shape[0]:
            continue
        if past_number[r] == number[p] and past_left[r, 0] == position[p, 0] and past_left[r, 1] == position[p, 1]:
            start[k, 0], start[k, 1], calm[k] = past_start[r, 0], past_start[r, 1], past_calm[r]


@kernel
def _look_back(
    begin, end, slot, position, velocity, inverse_mass, period_x, period_y, calm, h, start, back, weight,
):  # fmt: skip
    """`look_back` of those from `begin` to `end`, eight at a time."""
    step = spread(start.dtype.type(h))
    for k in range(begin, end, LANES):
        x, y = take(position, slot, k)
        vx, vy = take(velocity, slot, k)
        before_x, before_y = load_rows(start, k)
        store_rows(start, k, x, y)
        vx, vy, most = step * vx, step * vy, step * load(calm, k)
        gone_x, gone_y = apart_lanes(before_x, x, period_x, start), apart_lanes(before_y, y, period_y, start)
        dx, dy = vx - gone_x, vy - gone_y
        off, most = dx * dx + dy * dy, most * most
        store_rows(back, k, where_above(most, off, gone_x, vx), where_above(most, off, gone_y, vy))
        store(weight, k, pick(inverse_mass, slot, k))


@parallel_kernel
def look_back(slot, position, velocity, inverse_mass, period_x, period_y, calm, h, start, back, weight):
    """Copy who is linked: where a substep starts; the way `back` to where everybody was a substep ago; the inverse mass.

    That is by the velocity, or, by memory of `start`, where rest has put another velocity in. Contacts at rest carry weight by
    small velocities that move nobody, and links would take them for motion. calm: (k,) m/s, by how much the velocity may differ
    from the way gone and still be of that kind; beyond it there was an impact. NaN: unknown. In a periodic room what is
    remembered may be another image of where they were.

    Here and below, `slot` has a multiple of LANES of entries: the last one is repeated, and so is what belongs to it.
    """
    for c in prange((slot.shape[0] + _CHUNK - 1) // _CHUNK):
        _look_back(
            c * _CHUNK, min((c + 1) * _CHUNK, slot.shape[0]), slot, position, velocity, inverse_mass, period_x, period_y, calm,
            h, start, back, weight,
        )  # fmt: skip


@kernel
def _set_out(begin, end, predicted, shift, source, slot):
    zero = spread(shift.dtype.type(0))
    for k in range(begin, end, LANES):
        x, y = take(source, slot, k)
        store_rows(predicted, k, x, y)
        store_rows(shift, k, zero, zero)


@parallel_kernel
def set_out(predicted, shift, source, slot):
    """Where the integrator has put who is linked, and that links have not moved them yet."""
    for c in prange((slot.shape[0] + _CHUNK - 1) // _CHUNK):
        _set_out(c * _CHUNK, min((c + 1) * _CHUNK, slot.shape[0]), predicted, shift, source, slot)


@kernel
def _hand_back(begin, end, position, velocity, slot, predicted, shift, rate):
    per = spread(shift.dtype.type(rate))
    for k in range(begin, end, LANES):
        x, y = load_rows(predicted, k)
        dx, dy = load_rows(shift, k)
        vx, vy = take(velocity, slot, k)
        put(position, slot, k, x + dx, y + dy)
        put(velocity, slot, k, vx + dx * per, vy + dy * per)


@parallel_kernel
def hand_back(position, velocity, slot, count, predicted, shift, rate):
    """Give the `count` particles in `slot` their solved positions, and their velocities what that came to."""
    for k in range(count, shift.shape[0]):
        shift[k, 0], shift[k, 1] = shift[count - 1, 0], shift[count - 1, 1]
    for c in prange((slot.shape[0] + _CHUNK - 1) // _CHUNK):
        _hand_back(c * _CHUNK, min((c + 1) * _CHUNK, slot.shape[0]), position, velocity, slot, predicted, shift, rate)


@kernel
def _tell_calm(begin, end, slot, calm, slow, keep):
    zero, keep = spread(slow.dtype.type(0)), spread(slow.dtype.type(keep))
    for k in range(begin, end, LANES):
        felt = load(calm, k)
        place(slow, slot, k, larger(keep * pick(slow, slot, k), where_above(felt, zero, felt, zero)))


@parallel_kernel
def tell_calm(slot, calm, slow, keep):
    """slow[slot[k]] = calm[k], or if `keep` is 1 the larger of both: contacts of linked circles are at rest up to there, m/s."""
    for c in prange((slot.shape[0] + _CHUNK - 1) // _CHUNK):
        _tell_calm(c * _CHUNK, min((c + 1) * _CHUNK, slot.shape[0]), slot, calm, slow, keep)


@kernel
def _set_down(begin, end, velocity, slot, shift, rate, calm, burden, kept):
    per, most = spread(shift.dtype.type(_CARRIED * rate)), spread(shift.dtype.type(_CARRIED / REST_ACCELERATIONS))
    zero, one = spread(shift.dtype.type(0)), spread(shift.dtype.type(1))
    for k in range(begin, end, LANES):
        vx, vy = take(velocity, slot, k)
        x, y = load_rows(shift, k)
        x, y, limit = per * x, per * y, most * load(calm, k)
        size, limit = square_root(x * x + y * y), where_above(limit, zero, limit, zero)
        part = where_above(size, limit, limit / size, one)
        x, y = part * x, part * y
        store_rows(burden, k, x, y)
        store_rows(kept, k, vx, vy)
        put(velocity, slot, k, vx + x, vy + y)


@parallel_kernel
def set_down(velocity, slot, shift, rate, calm, burden, kept):
    """Links have pulled: from here on velocities are without what carries that, the `burden`, until `shoulder`.

    A contact at rest holds against the acceleration a of a circle with a push c = -PUSHED / FED a h^2 in each substep, and ends
    it with the velocity -(1 - PUSHED / FED) a h, so that nobody moves (docs/design/contact-law.md). For gravity that is the same
    for all, and the second sweep sees no difference; what links pull with, shift / h^2, is another for each circle. Walls and
    the second sweep would take it for motion, pass it on, and heaps of linked circles would not rest.

    A jerk is motion: what is set down is no more than was felt in the substep before, by what `calm` says (0 if unknown).
    rate: 1 / h. burden: becomes (k, 2) m/s; kept: (k, 2) the velocities of before.
    """
    for c in prange((slot.shape[0] + _CHUNK - 1) // _CHUNK):
        _set_down(c * _CHUNK, min((c + 1) * _CHUNK, slot.shape[0]), velocity, slot, shift, rate, calm, burden, kept)


@kernel
def _shoulder(begin, end, velocity, slot, burden, kept):
    for k in range(begin, end, LANES):
        vx, vy = take(velocity, slot, k)
        x, y = load_rows(burden, k)
        before_x, before_y = load_rows(kept, k)
        # To the bit what it was, where nobody has touched it.
        vx = where_zero(vx - (before_x + x), before_x, vx - x)
        vy = where_zero(vy - (before_y + y), before_y, vy - y)
        put(velocity, slot, k, vx, vy)


@parallel_kernel
def shoulder(velocity, slot, burden, kept):
    """The burden of `set_down` is taken up again."""
    for c in prange((slot.shape[0] + _CHUNK - 1) // _CHUNK):
        _shoulder(c * _CHUNK, min((c + 1) * _CHUNK, slot.shape[0]), velocity, slot, burden, kept)


@kernel
def _add_pull(begin, end, acceleration, slot, shift, rate, calm, rest):
    per, most = spread(shift.dtype.type(rate * rate)), spread(shift.dtype.type(rest))
    for k in range(begin, end, LANES):
        ax, ay = take(acceleration, slot, k)
        px, py = load_rows(shift, k)
        px, py = per * px, per * py
        store(calm, k, most * (square_root(ax * ax + ay * ay) + square_root(px * px + py * py)))
        put(acceleration, slot, k, ax + px, ay + py)


@parallel_kernel
def add_pull(acceleration, slot, shift, rate, calm, rest):
    """acceleration[slot[k]] += shift[k] / h^2, what links pull with, m/s^2; no slot comes twice. rate: 1 / h. calm[k] becomes
    what both are in `rest` seconds, m/s.
    """
    for c in prange((slot.shape[0] + _CHUNK - 1) // _CHUNK):
        _add_pull(c * _CHUNK, min((c + 1) * _CHUNK, slot.shape[0]), acceleration, slot, shift, rate, calm, rest)
