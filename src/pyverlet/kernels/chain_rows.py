"""What the packs of `kernels.chains` keep of their rows: made ready for a substep, moved ahead, noted; and the user's tables."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import driver, kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    LANES,
    larger,
    load,
    pick,
    put,
    smaller,
    spread,
    square_root,
    store,
    take,
    where_above,
    where_zero,
    which_above,
    widen,
)
from pyverlet.compile.rounding import lanes_like
from pyverlet.ground.constants import LINK_BOWED, LINK_GIVE, LINK_LEAST_N, LINK_MEMORY_S, LINK_RESOLVED
from pyverlet.kernels.seam import nearest, nearest_lanes

COLUMNS = (
    "rest", "rope", "stiffness", "soft", "damping", "intact", "force", "last", "lam", "give", "offset", "turn", "bow", "along_x",
    "along_y", "held",
)  # fmt: skip
"""What is kept of a row, in the dtype of the world: rope, soft, intact and held are 1 or 0, the stiffness of what is not soft is
0. held: a rope that pulled when it was solved last."""

REST, ROPE, STIFFNESS, SOFT, DAMPING, INTACT, FORCE, LAST, LAM, GIVE, OFFSET, TURN, BOW, AX, AY, HELD = range(len(COLUMNS))

ROPES, SOFTS = 1, 2
"""Bits of what is in a pack."""

_LEAST = 1e-25
"""N/m: springs softer than that pull with as much; where one divides by them, in float32 too."""

_MOST = 1e15
"""(frequency * h)^2: beyond that it is all settled, and its square no number in float32. Links crushed between a wall and what
moves on have come to that."""


@kernel
def _settled(s, resolved, most):
    """`kernels.links.share_settled`, lane by lane; resolved: the square of LINK_RESOLVED; most: see _MOST."""
    s = smaller(s, most)
    return s * s / (s * s + resolved)


@kernel
def _prepare_pack(p, start, node, holds, row, position, period_x, period_y, earlier, weight, h):
    """From where a substep starts, and a substep `earlier`: what the rows of a pack are to satisfy. See kernels.links."""
    real = row.dtype.type
    zero, one, tiny, resolved = spread(real(0)), spread(real(1)), spread(real(1e-12)), spread(real(LINK_RESOLVED * LINK_RESOLVED))
    quarter, half, two, three = spread(real(0.25)), spread(real(0.5)), spread(real(2)), spread(real(3))
    straight, steeper = spread(real(LINK_BOWED)), spread(real(1.0 / (1.0 - LINK_BOWED)))
    one_h, hh, per_h, rigid = spread(real(h)), spread(real(h * h)), spread(real(1.0 / h)), spread(real(LINK_GIVE))
    per_hh, least, most = spread(real(1.0 / (h * h))), spread(real(_LEAST)), spread(real(_MOST))
    soft = holds[p] & SOFTS
    begin, end = start[p], start[p + 1]
    shift = LANES * p
    bowed = 0
    xi, yi = take(position, node, begin + shift)
    wi = lanes_like(pick(weight, node, begin + shift), row)
    ui, vi = take(earlier, node, begin + shift)
    for k in range(begin, end, LANES):
        xj, yj = take(position, node, k + shift + LANES)
        wj = lanes_like(pick(weight, node, k + shift + LANES), row)
        dx, dy = lanes_like(nearest_lanes(xj - xi, period_x), row), lanes_like(nearest_lanes(yj - yi, period_y), row)
        length = square_root(dx * dx + dy * dy)
        bend = one / larger(length, tiny)
        store(row[AX], k, where_zero(length, one, dx * bend))
        store(row[AY], k, dy * bend)
        ww, force, rest = wi + wj, load(row[FORCE], k), load(row[REST], k)
        swing = hh * larger(force, zero - force) * bend * ww  # (frequency of swinging sideways * h)^2
        turn = _settled(swing, resolved, most)
        bow = larger(turn - straight, zero) * steeper * hh * larger(force, zero) * bend
        bowed |= which_above(bow, zero)
        store(row[TURN], k, turn)
        store(row[BOW], k, bow)
        store(row[HELD], k, where_above(load(row[LAST], k), zero, one, zero))
        give, offset, lam = rigid * ww, zero, zero
        if soft:
            uj, vj = take(earlier, node, k + shift + LANES)
            ex, ey = lanes_like(nearest_lanes(uj - ui, period_x), row), lanes_like(nearest_lanes(vj - vi, period_y), row)
            ui, vi = uj, vj
            here, slack = load(row[SOFT], k), load(row[ROPE], k)
            stiffness, damping = load(row[STIFFNESS], k), load(row[DAMPING], k)
            c0, cm = length - rest, square_root(ex * ex + ey * ey) - rest
            c0 = where_above(slack, zero, larger(c0, zero), c0)  # a slack rope has no stretch to remember
            cm = where_above(slack, zero, larger(cm, zero), cm)
            q = _settled(hh * stiffness * ww, resolved, most)
            s = one_h * damping * ww
            part = half + half * s / (one + s)
            rate = damping * per_h
            kp = stiffness * (one + three * q) * quarter + rate * part
            k0 = stiffness * (one - q) * half + rate * (one - two * part)
            km = stiffness * (one - q) * quarter - rate * (one - part)
            per = one / larger(kp, least)
            give = give + here * (per * per_hh)
            offset = here * ((k0 * c0 + km * cm) * per)
            lam = zero - here * (one - slack) * load(row[INTACT], k) * (one - q) * load(row[LAST], k) * hh
        store(row[GIVE], k, give)
        store(row[OFFSET], k, offset)
        store(row[LAM], k, lam)
        xi, yi, wi = xj, yj, wj
    return bowed != 0


@parallel_kernel
def prepare(start, node, holds, bowed, row, position, period_x, period_y, earlier, weight, h):
    """Before the integrator moves: every row's equation C+ + offset + give lam = 0, and which packs resist being turned."""
    for p in prange(holds.shape[0]):
        bowed[p] = _prepare_pack(p, start, node, holds, row, position, period_x, period_y, earlier, weight, h)


@kernel
def _ahead_pack(p, start, node, row, position, weight):
    """Move the nodes of a pack by the lam its rows start from."""
    begin, end, shift = start[p], start[p + 1], LANES * p
    fx = fy = spread(0.0)
    for k in range(begin, end + 1, LANES):
        gx = gy = spread(0.0)
        if k < end:
            lam = widen(load(row[LAM], k))
            gx, gy = widen(load(row[AX], k)) * lam, widen(load(row[AY], k)) * lam
        x, y = take(position, node, k + shift)
        w = pick(weight, node, k + shift)
        put(position, node, k + shift, x + w * (fx - gx), y + w * (fy - gy))
        fx, fy = gx, gy


@parallel_kernel
def _ahead(first, stop, start, node, holds, row, position, weight):
    for p in prange(first, stop):
        if holds[p] & SOFTS:
            _ahead_pack(p, start, node, row, position, weight)


@driver
def ahead(colour, start, node, holds, row, position, weight):
    """Move all nodes by the lam their rows start from, colour by colour."""
    for c in range(colour.shape[0] - 1):
        _ahead(colour[c], colour[c + 1], start, node, holds, row, position, weight)


@kernel
def note_force(row, h):
    """The pull in N, which for rigid links is noisy; let the force shown follow it. That of the broken stays what it was."""
    real = row.dtype.type
    part, rate = spread(real(h / (h + LINK_MEMORY_S))), spread(real(-1.0 / (h * h)))
    zero, least = spread(real(0)), spread(real(LINK_LEAST_N))
    for k in range(0, row.shape[1], LANES):
        last, force = load(row[LAM], k) * rate, load(row[FORCE], k)
        store(row[LAST], k, last)
        force = force + part * load(row[INTACT], k) * (last - force)
        store(row[FORCE], k, where_above(larger(force, zero - force), least, force, zero))


@kernel
def snap(row, strength):
    """Break every row that pulls or pushes harder than its strength, N."""
    for k in range(row.shape[1]):
        if abs(row[FORCE, k]) > strength[k]:
            row[INTACT, k] = 0


# ---- between the tables of the user's links and the packs ---------------------------------------------------------------------


@kernel
def take_up(source, row, intact, force, last):
    """A frame begins: what of the rows changes. source: which row stands in each item, -1 for none."""
    for k in range(source.shape[0]):
        r = source[k]
        row[INTACT, k] = row[FORCE, k] = row[LAST, k] = 0
        if r >= 0:
            row[INTACT, k], row[FORCE, k], row[LAST, k] = intact[r], force[r], last[r]


@kernel
def hand_over(place, row, intact, force, last):
    """A frame is over: the same the other way. place: (rows,) the item each row stands in."""
    for r in range(place.shape[0]):
        k = place[r]
        whole = row[INTACT, k] != 0.0
        intact[r] = whole
        force[r], last[r] = (row[FORCE, k], row[LAST, k]) if whole else (0.0, 0.0)


@kernel
def intact(place, row):
    """(rows,) who is whole now."""
    out = np.empty(place.shape[0], np.uint8)
    for r in range(place.shape[0]):
        out[r] = row[INTACT, place[r]] != 0.0
    return out


@kernel
def energy(position, period_x, period_y, ends, rest, upper, stiffness, intact):
    """Energy of rows of finite stiffness, J: none of the broken, nor of slack ropes. ends: (rows, 2) rows of `position`."""
    total = 0.0
    for r in range(ends.shape[0]):
        if not (intact[r] and stiffness[r] < np.inf):
            continue
        i, j = ends[r, 0], ends[r, 1]
        dx, dy = nearest(position[j, 0] - position[i, 0], period_x), nearest(position[j, 1] - position[i, 1], period_y)
        value = np.sqrt(dx * dx + dy * dy) - rest[r]
        if value > 0.0 or upper[r] > 0.0:
            total += stiffness[r] * value * value
    return 0.5 * total
