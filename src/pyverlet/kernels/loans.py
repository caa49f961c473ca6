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

import numpy as np

from pyverlet.compile.bits import store_bits
from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    ANY,
    LANES,
    larger,
    load,
    load_rows,
    put,
    smaller,
    spread,
    store,
    take,
    where_above,
    where_set,
    where_zero,
    which_above,
    which_set,
)
from pyverlet.compile.rows import store_rows
from pyverlet.compile.stealing import claim, none_claimed
from pyverlet.ground.constants import LENT, UNEVEN

CHUNK = 1024
"""Circles one thread takes at a time."""

# Of the own mass: less than this is no loan but the rounding of one.
_NOTHING = 1e-7


@kernel
def _inertia(mass, lent, least):
    """m + lent, at least what nobody may lend: the mass may have been changed since."""
    return max(mass + lent, least * mass)


@kernel
def _begin(a, b, circles, lending, terms, bounces, rubs):
    """What `begin` does, of the circles from a up to b."""
    position, velocity, acceleration, spin = circles.position, circles.velocity, circles.acceleration, circles.spin
    inverse_mass, origin, moved, rows = circles.inverse_mass, circles.origin, circles.moved, circles.inertia
    mass, lent, busy, held = lending.mass, lending.lent, lending.busy, lending.held
    lighter, calm, before, spin_before = lending.lighter, lending.calm, lending.before, lending.spin_before
    real, packed = mass.dtype.type, b - (b - a) % LANES
    zero, one, least, nobody = spread(real(0)), spread(real(1)), spread(real(1 - LENT)), spread(real(-1))
    sunk, kick, fall = spread(terms.sunk), spread(terms.kick), spread(terms.fall)
    for k in range(a, packed, LANES):
        m, w, loan, waits = load(mass, k), load(inverse_mass, k), load(lent, k), load(busy, k)
        keeps = least * m
        inertia = larger(m + loan, keeps)
        light = where_zero(w, w, where_zero(loan, w, one / inertia))
        store(lighter, k, light)
        if bounces:
            store(calm, k, where_zero(loan, where_zero(waits, zero, sunk), sunk))
        store_rows(rows, k, inertia, where_zero(w, nobody, where_above(waits, zero, nobody, keeps)))
        stands = which_set(held, k, ANY)
        ax, ay = load_rows(acceleration, k)
        vx, vy = load_rows(velocity, k)
        x, y = load_rows(position, k)
        startx, starty = load_rows(origin, k)
        if rubs:
            store(spin_before, k, load(spin, k))
        part = where_set(stands, kick, zero)
        store_rows(before, k, vx - part * ax, vy - part * ay)
        more = where_set(stands, where_zero(light - w, zero, (light / w - one) * fall), zero)
        x, y = x + more * ax, y + more * ay
        store_rows(position, k, x, y)
        store_rows(moved, k, x - startx, y - starty)
    for i in range(packed, b):
        w, loan = inverse_mass[i], lent[i]
        rows[i, 0] = _inertia(mass[i], loan, real(1 - LENT))
        rows[i, 1] = real(-1) if w == 0 or busy[i] > 0 else real(1 - LENT) * mass[i]
        lighter[i] = w if w == 0 or loan == 0 else real(1) / rows[i, 0]
        calm[i] = real(0) if loan == 0 and busy[i] == 0 else terms.sunk
        spin_before[i] = spin[i]
        part = terms.kick if held[i] else real(0)
        more = (lighter[i] / w - real(1)) * terms.fall if held[i] and lighter[i] != w else real(0)
        for axis in range(2):
            before[i, axis] = velocity[i, axis] - part * acceleration[i, axis]
            position[i, axis] += more * acceleration[i, axis]
            moved[i, axis] = position[i, axis] - origin[i, axis]


@parallel_kernel
def begin(circles, lending, terms, bounces, rubs):
    """A substep's contacts begin.

    lighter: 1 / m' of each circle, 1/kg. calm, if any pair `bounces` or rubs: `sunk` for who lends, or may not yet, else 0.
    inertia: m', kg, and what of it the circle keeps whatever others ask for, negative if it neither lends nor borrows. before,
    and spin_before if any pair `rubs`: velocities from which contacts begin; of those that walls hold without gravity's share,
    which counts as theirs.

    Who is held, through others, is moved by what a (m / m' - 1) does to its position: so its weight is that of its own mass.
    """
    n = circles.position.shape[0]
    for c in prange((n + CHUNK - 1) // CHUNK):
        _begin(c * CHUNK, min((c + 1) * CHUNK, n), circles, lending, terms, bounces, rubs)


@kernel
def _share_strip(s, pairs, rows, hanging):
    """Of strip s."""
    lane_i, lane_j, normal, touch, changed = pairs.lane_i, pairs.lane_j, pairs.normal, hanging.touch, hanging.changed
    real, a, count = rows.dtype.type, pairs.begin[s], 0
    zero, half = spread(real(0)), spread(real(0.5))
    for k in range(a, a + pairs.lanes[s], LANES):
        nx, ny = load(normal[0], k), load(normal[1], k)
        touches = which_above(nx * nx + ny * ny, zero)
        now = np.uint8(touches)
        if now != touch[k // LANES]:
            changed[a // LANES + count] = (k << LANES) | np.int64(touch[k // LANES] ^ now)
            touch[k // LANES] = now
            count += 1
        if touches == 0:
            continue
        i, keeps_i = take(rows, lane_i, k)
        j, keeps_j = take(rows, lane_j, k)
        mi, mj = larger(i, zero - i), larger(j, zero - j)
        flow = larger(smaller(half * (mi - mj), mi - keeps_i), keeps_j - mj)
        lend = touches & which_above(keeps_i, zero) & which_above(keeps_j, zero)
        flow = where_set(lend, flow, zero)
        put(rows, lane_i, k, where_set(touches, flow - mi, i), keeps_i)
        put(rows, lane_j, k, where_set(touches, zero - (mj + flow), j), keeps_j)
    hanging.changes[s] = count


@parallel_kernel
def share(circles, pairs, hanging, cut, claims):
    """Even out the inertia of each touching pair that has not bounced; nobody lends more than the part LENT of the own mass.

    Who is in such a pair has a negative inertia then. touch: these pairs, a bit for each, and a byte for each pack. Packs in
    which that is not what it was are noted in `changed`, changes[s] of them from the first pack of strip s on, the lanes that
    have changed in the lowest bits.
    """
    for parity in range(2):
        none_claimed(claims)
        for part in prange(claims.shape[0]):
            half = claim(claims, cut[parity], part)
            while half >= 0:
                _share_strip(2 * half + parity, pairs, circles.inertia, hanging)
                half = claim(claims, cut[parity], part)


@kernel
def _take_up(a, b, circles, lending, terms):
    """What `take_up` does, of the circles from a up to b."""
    position, velocity, acceleration = circles.position, circles.velocity, circles.acceleration
    inverse_mass, rows = circles.inverse_mass, circles.inertia
    mass, lent, busy, held, touched = lending.mass, lending.lent, lending.busy, lending.held, lending.touched
    lighter, unpushed, linked = lending.lighter, lending.unpushed, lending.linked
    real, packed = mass.dtype.type, b - (b - a) % LANES
    zero, one, least, nothing = spread(real(0)), spread(real(1)), spread(real(1 - LENT)), spread(real(_NOTHING))
    most = spread(real(UNEVEN - 1))
    part, h, kick, fall = spread(terms.part), spread(terms.h), spread(terms.kick), spread(terms.fall)
    for k in range(a, packed, LANES):
        m, w, loan, waits = load(mass, k), load(inverse_mass, k), load(lent, k), load(busy, k)
        inertia, _ = load_rows(rows, k)
        met, stands = which_above(zero, inertia), which_set(held, k, ANY)
        store_bits(touched, k, met)
        now = larger(inertia, zero - inertia)
        # As it is where nothing has flowed: a sum with m would round it, and it would never come to an end.
        changed = where_zero(now - larger(m + loan, least * m), loan, now - m)
        loan = where_zero(w, loan, where_above(waits, zero, loan, changed))
        joined = which_set(linked, k, ANY)
        loan = where_set(joined, smaller(loan, most * m), loan)
        loan = loan - part * loan
        store(lent, k, where_above(nothing * m, larger(loan, zero - loan), zero, loan))
        if which_above(waits, zero) != 0:
            store(busy, k, larger(waits - h, zero))
        light = load(lighter, k)
        ax, ay = load_rows(acceleration, k)
        vx, vy = load_rows(velocity, k)
        more = where_zero(light - w, zero, light / w - one)
        met |= joined
        by = where_set(met & stands, more * kick, zero)
        vx, vy = vx + by * ax, vy + by * ay
        store_rows(velocity, k, vx, vy)
        store_rows(unpushed, k, vx, vy)
        if stands & ~met != 0:
            x, y = load_rows(position, k)
            by = where_set(stands & ~met, more * fall, zero)
            store_rows(position, k, x - by * ax, y - by * ay)
    for i in range(packed, b):
        w, m = inverse_mass[i], mass[i]
        touched[i] = rows[i, 0] < 0
        now = abs(rows[i, 0])
        if w > 0 and not busy[i] > 0 and now != _inertia(m, lent[i], real(1 - LENT)):
            lent[i] = now - m
        if linked[i]:
            lent[i] = min(lent[i], real(UNEVEN - 1) * m)
        lent[i] -= terms.part * lent[i]
        if abs(lent[i]) < real(_NOTHING) * m:
            lent[i] = 0
        busy[i] = max(busy[i] - terms.h, real(0))
        more = lighter[i] / w - real(1) if held[i] and lighter[i] != w else real(0)
        for axis in range(2):
            if touched[i] or linked[i]:
                velocity[i, axis] += more * terms.kick * acceleration[i, axis]
            else:
                position[i, axis] -= more * terms.fall * acceleration[i, axis]
            unpushed[i, axis] = velocity[i, axis]


@parallel_kernel
def take_up(circles, lending, terms):
    """After `begin`, and contacts: what that did to positions is done to velocities, of who has touched another, or is linked;
    for the others it is taken back. Not before contacts: to those it is no motion, and would be an impact.

    What has flowed becomes loans, and a part of each goes back. Who is linked borrows no more than makes it UNEVEN times as
    heavy: with hundreds of times its inertia here and there a rope turned too far in a substep, and tore. unpushed: the
    velocities, before walls push.
    """
    n = circles.position.shape[0]
    for c in prange((n + CHUNK - 1) // CHUNK):
        _take_up(c * CHUNK, min((c + 1) * CHUNK, n), circles, lending, terms)
