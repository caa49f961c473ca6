"""Circles at rest against each other lend each other inertia, so that light ones can carry heavy ones.

What one circle can do to another in a substep goes with the lighter mass of the two: many small pushes hold a heavy circle on
light ones, late and softly. But within a heap at rest nobody can tell which of the circles has the mass, as long as each keeps
its weight. So those that touch even out their inertia m', the sum of which stays the same, and solve contacts with it:

- The weight of what walls hold is still m a, not m' a: before contacts are solved, the integration's a h becomes a h m / m', and
  of how far that has moved the circle only the part PUSHED / FED, for the velocities with which circles at rest end a substep
  stay as they are.
- Who touches nobody has that undone, and falls as everything does; what was lent goes back within LOAN_S.
- Impacts go by the true masses (`kernels.bounce`). Who has bounced has its own from the next substep on, and lends and borrows
  nothing for LOAN_S.

To change the masses of particles that hardly move is common in calculations of granular matter (Thornton and Antony 1998,
Quasi-static deformation of particulate media, have more of it everywhere); here the sum is kept, and kernels.balance sees to it
that momentum is.
"""

from __future__ import annotations

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    ANY,
    LANES,
    larger,
    load,
    load_rows,
    smaller,
    spread,
    where_above,
    where_set,
    where_zero,
    which_above,
    which_set,
)
from pyverlet.compile.rows import put_four, store_four, store_rows, take_four
from pyverlet.ground.constants import LENT

# What a circle touches: another that has not bounced off; a pinned one.
TOUCHED, PINNED = 1, 2

# Whether a circle lends: yes; not for now; never, and who touches it is told so.
_LENDS, _WAITS, _PINNED = 0, 1, 2

# Circles one thread takes at a time.
_CHUNK = 1024

# Of the own mass: less than this is no loan but the rounding of one.
_NOTHING = 1e-7


@kernel
def _inertia(mass, lent, i):
    """m + lent, at least what nobody may lend: the mass may have been changed since."""
    return max(mass[i] + lent[i], mass.dtype.type(1 - LENT) * mass[i])


@kernel
def weigh(mass, inverse_mass, lent, busy, sunk, lighter, calm):
    """lighter: 1 / m' of each circle, 1/kg. calm: `sunk`, m/s, for who lends, or may not yet, else 0."""
    none, one = mass.dtype.type(0), mass.dtype.type(1)
    for i in range(mass.shape[0]):
        w = inverse_mass[i]
        lighter[i] = w if w == none or lent[i] == none else one / _inertia(mass, lent, i)
        calm[i] = none if lent[i] == none and busy[i] == none else sunk


@kernel
def pull(position, acceleration, inverse_mass, lighter, held, fall):
    """Move each circle that walls hold, through others, by what a (m / m' - 1) does to its position: so its weight
    is that of its own mass. fall: s^2.
    """
    one, by = spread(lighter.dtype.type(1)), spread(fall)
    packed = len(lighter) - len(lighter) % LANES
    for k in range(0, packed, LANES):
        light, w = load(lighter, k), load(inverse_mass, k)
        x, y = load_rows(position, k)
        ax, ay = load_rows(acceleration, k)
        more, bits = (light / w - one) * by, which_set(held, k, ANY)
        px, py = where_zero(light - w, x, x + more * ax), where_zero(light - w, y, y + more * ay)
        store_rows(position, k, where_set(bits, px, x), where_set(bits, py, y))
    for i in range(packed, len(lighter)):
        w = inverse_mass[i]
        if held[i] and lighter[i] != w:
            more = (lighter[i] / w - lighter.dtype.type(1)) * fall
            position[i, 0] += more * acceleration[i, 0]
            position[i, 1] += more * acceleration[i, 1]


@kernel
def take_up(position, velocity, acceleration, inverse_mass, lighter, held, touched, kick, fall):
    """After `pull`, and contacts: do the same to velocities, kick (s), of who has touched another; take it back for the others.

    Not before contacts: to those it is no motion, and would be an impact.
    """
    one, kicks, falls = spread(lighter.dtype.type(1)), spread(kick), spread(fall)
    packed = len(lighter) - len(lighter) % LANES
    for k in range(0, packed, LANES):
        light, w = load(lighter, k), load(inverse_mass, k)
        bits, met = which_set(held, k, ANY), which_set(touched, k, ANY)
        ax, ay = load_rows(acceleration, k)
        more = light / w - one
        vx, vy = load_rows(velocity, k)
        ux, uy = where_zero(light - w, vx, vx + more * kicks * ax), where_zero(light - w, vy, vy + more * kicks * ay)
        store_rows(velocity, k, where_set(bits & met, ux, vx), where_set(bits & met, uy, vy))
        if bits & ~met != 0:
            x, y = load_rows(position, k)
            px, py = where_zero(light - w, x, x - more * falls * ax), where_zero(light - w, y, y - more * falls * ay)
            store_rows(position, k, where_set(bits & ~met, px, x), where_set(bits & ~met, py, y))
    for i in range(packed, len(lighter)):
        w = inverse_mass[i]
        if held[i] and lighter[i] != w:
            more = lighter[i] / w - lighter.dtype.type(1)
            if touched[i]:
                velocity[i, 0] += more * kick * acceleration[i, 0]
                velocity[i, 1] += more * kick * acceleration[i, 1]
            else:
                position[i, 0] -= more * fall * acceleration[i, 0]
                position[i, 1] -= more * fall * acceleration[i, 1]


@kernel
def _gather(mass, inverse_mass, lent, busy, rows, a, b):
    """rows: what each of the circles from a up to b has lent, kg, its mass, whether it lends; and that it touches nobody."""
    none, packed = lent.dtype.type(0), b - (b - a) % LANES
    zero, waiting, pinned = spread(none), spread(lent.dtype.type(_WAITS)), spread(lent.dtype.type(_PINNED))
    for k in range(a, packed, LANES):
        waits = where_zero(load(inverse_mass, k), pinned, where_above(load(busy, k), zero, waiting, zero))
        store_four(rows, k, load(lent, k), load(mass, k), waits, zero)
    for i in range(packed, b):
        waits_i = _PINNED if inverse_mass[i] == none else _WAITS if busy[i] > none else _LENDS
        rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3] = lent[i], mass[i], waits_i, none


@kernel
def _scatter(rows, lent, touched, a, b):
    """And what each has lent then, and whom it touches."""
    for i in range(a, b):
        lent[i], touched[i] = rows[i, 0], rows[i, 3]


@kernel
def _share_strip(begin, end, lane_i, lane_j, normal, rows):
    """The pairs that touch and have not bounced, in the lanes from `begin` up to `end`."""
    real = rows.dtype.type
    zero, half, least = spread(real(0)), spread(real(0.5)), spread(real(1 - LENT))
    waiting, pinned = spread(real(_WAITS)), spread(real(_PINNED))
    one, both = spread(real(TOUCHED)), spread(real(TOUCHED | PINNED))
    for k in range(begin, end, LANES):
        nx, ny = load(normal[0], k), load(normal[1], k)
        touches = which_above(nx * nx + ny * ny, zero)
        if touches == 0:
            continue
        li, mi, waits_i, touched_i = take_four(rows, lane_i, k)
        lj, mj, waits_j, touched_j = take_four(rows, lane_j, k)
        waits = larger(waits_i, waits_j)
        flow = larger(smaller(half * ((mi + li) - (mj + lj)), (mi + li) - least * mi), least * mj - (mj + lj))
        flow = where_set(touches & which_above(waiting, waits), flow, zero)
        mark = where_set(touches, where_above(pinned, waits, one, both), zero)
        put_four(rows, lane_i, k, li - flow, mi, waits_i, larger(touched_i, mark))
        put_four(rows, lane_j, k, lj + flow, mj, waits_j, larger(touched_j, mark))


@parallel_kernel
def share(begin, lanes, lane_i, lane_j, normal, cut, mass, inverse_mass, lent, busy, touched, rows):
    """Even out the inertia of each touching pair that has not bounced; nobody lends more than the part LENT of the own mass.

    touched[i] becomes TOUCHED for who is in such a pair, with PINNED if one of them is pinned, else 0. cut: as for
    `kernels.sweeps.push`. rows: (n, 4) scratch.
    """
    count = mass.shape[0]
    for c in prange((count + _CHUNK - 1) // _CHUNK):
        _gather(mass, inverse_mass, lent, busy, rows, c * _CHUNK, min((c + 1) * _CHUNK, count))
    for parity in range(2):
        for part in prange(cut.shape[1] - 1):
            for half in range(cut[parity, part], cut[parity, part + 1]):
                a = begin[2 * half + parity]
                _share_strip(a, a + lanes[2 * half + parity], lane_i, lane_j, normal, rows)
    for c in prange((count + _CHUNK - 1) // _CHUNK):
        _scatter(rows, lent, touched, c * _CHUNK, min((c + 1) * _CHUNK, count))


@kernel
def give_back(mass, part, h, lent, busy):
    """Give this part of every loan back; h: s, that have gone by."""
    for i in range(mass.shape[0]):
        busy[i] = max(busy[i] - h, h - h)
        lent[i] -= part * lent[i]
        if abs(lent[i]) < mass.dtype.type(_NOTHING) * mass[i]:
            lent[i] = h - h
