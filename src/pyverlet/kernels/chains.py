"""Runs of distances, each solved at once, eight runs beside each other: a light rope carries a heavy ball in one go.

A run is links that follow each other: row r joins the nodes r and r + 1. With w = 1/m, the direction n of a link, and the one d
its force acts along (kernels.links), the steps of lam satisfy

    (n_r . (w_r d_r + w_r+1 d_r) + give_r) lam_r - w_r n_r . d_r-1 lam_r-1 - w_r+1 n_r . d_r+1 lam_r+1 = right_r

for each row: tridiagonal, eliminated from its first row on. What the rows so far leave of the mobility of the present one's first
node is a = w (near / pivot), a sum of what gives: in that form nothing large cancels.

A taut link also resists being turned, as a string does: by its tension over its length, `bow`. Without it a light rope would
be thrown sideways by its own tension as soon as substeps are too long for its fastest swing. Where that matters (`bow` > 0) each
link is a 2 x 2 matrix B = d n^T / give + bow (1 - n n^T), and the run is eliminated node by node: X is what the nodes so far put
against a move of the present one; beyond the link that is X (X + B)^-1 B, as for springs in series.

Eight runs of one colour are a pack: they share no particle. Number k of lane l in a pack is item 8 k + l of it. A run that is
shorter than its pack repeats its last node, with rows that are broken; a pack that has fewer runs repeats its last one: both
lanes write the same. The items of the rows of pack p are start[p] to start[p + 1]; those of its nodes begin at start[p] + 8 p.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import driver, kernel, parallel_kernel, prange
from pyverlet.compile.lanes import (
    LANES,
    larger,
    load,
    pick,
    put,
    spread,
    square_root,
    store,
    take,
    where_above,
    where_set,
    where_zero,
    which_above,
    widen,
)
from pyverlet.compile.rounding import lanes_like
from pyverlet.ground.constants import LINK_ROUNDS, LINK_TAUT, LINK_TURN
from pyverlet.kernels.chain_rows import AX, AY, BOW, GIVE, HELD, INTACT, LAM, OFFSET, REST, ROPE, ROPES, TURN, ahead
from pyverlet.kernels.seam import nearest, nearest_lanes

_SWEEPS = 4

SCRATCH, WIDE = 11, 6
"""Columns of room for one pack, in the dtype of the rows and in float64: of each row n, 1 / length, right, active, step, two of
elimination; of each node its weight and move; and what nodes are eliminated with."""

_NX, _NY, _BEND, _RIGHT, _ACTIVE, _STEP, _Z, _U, _W, _MX, _MY = range(SCRATCH)
_G0, _G1, _I = range(3)

_HEAVY = 1e-40
"""1/kg: the inverse mass that pinned nodes have where one is divided by."""


@kernel
def _measure_pack(p, start, node, row, position, period_x, period_y, weight, room):
    """How the rows of a pack stand now, in `room`, and who of them pulls; the direction of the force follows them."""
    real = row.dtype.type
    zero, one, half = spread(real(0)), spread(real(1)), spread(real(0.5))
    shortest, nearly = spread(real(1e-12)), spread(real(LINK_TAUT))
    begin, end, shift = start[p], start[p + 1], LANES * p
    xi, yi = take(position, node, begin + shift)
    store(room[_W], 0, lanes_like(pick(weight, node, begin + shift), row))
    for k in range(begin, end, LANES):
        xj, yj = take(position, node, k + shift + LANES)
        dx, dy = lanes_like(nearest_lanes(xj - xi, period_x), row), lanes_like(nearest_lanes(yj - yi, period_y), row)
        rest = load(row[REST], k)
        length = square_root(dx * dx + dy * dy)
        bend = one / larger(length, shortest)
        nx, ny = where_zero(length, one, dx * bend), dy * bend
        ax, ay, turn = load(row[AX], k), load(row[AY], k), load(row[TURN], k)
        ax, ay = ax + turn * (nx - ax), ay + turn * (ny - ay)
        old = nx * ax + ny * ay  # turned by 60 degrees in a substep: the old direction says nothing any more
        ax, ay = where_above(half, old, nx, ax), where_above(half, old, ny, ay)
        give, intact = load(row[GIVE], k), load(row[INTACT], k)
        right = zero - (length - rest + load(row[OFFSET], k) + give * load(row[LAM], k))
        taut = where_above(nearly * rest * load(row[HELD], k), right, one, one - load(row[ROPE], k))
        to = k - begin
        store(row[AX], k, ax)
        store(row[AY], k, ay)
        store(room[_NX], to, nx)
        store(room[_NY], to, ny)
        store(room[_BEND], to, bend)
        store(room[_RIGHT], to, right)
        store(room[_ACTIVE], to, where_above(give, zero, intact * taut, zero))
        store(room[_W], to + LANES, lanes_like(pick(weight, node, k + shift + LANES), row))
        xi, yi = xj, yj


@kernel
def _eliminate_rows(begin, end, row, room):
    """The steps of lam of a pack, and the moves of its nodes: row by row, where no link resists being turned."""
    real = row.dtype.type
    zero, one = spread(real(0)), spread(real(1))
    w = load(room[_W], 0)
    active = a = give = nd = z = per = zero
    nx = ny = ax = ay = zero
    for k in range(begin, end, LANES):
        to = k - begin
        mx, my, bx, by = load(room[_NX], to), load(room[_NY], to), load(row[AX], k), load(row[AY], k)
        here, g, wj = load(room[_ACTIVE], to), load(row[GIVE], k), load(room[_W], to + LANES)
        md = mx * bx + my * by
        c, cc = nx * bx + ny * by, mx * ax + my * ay
        if k > begin:
            store(room[_U], to - LANES, active * w * c * per)
        near = md * (a + give) + w * (nd * md - c * cc)
        a = where_zero(active, w * md, w * (near * per))
        per = one / where_zero(here, one, a + wj * md + g)
        z = where_zero(here, zero - load(row[LAM], k), (load(room[_RIGHT], to) + w * cc * z) * per)
        store(room[_Z], to, z)
        nx, ny, ax, ay, nd, give, w, active = mx, my, bx, by, md, g, wj, here
    step = zero
    fx = fy = zero
    for k in range(end - LANES, begin - LANES, -LANES):
        to = k - begin
        step = load(room[_Z], to) + (load(room[_U], to) * step if k < end - LANES else zero)
        store(room[_STEP], to, step)
        bx, by, wj = load(row[AX], k) * step, load(row[AY], k) * step, load(room[_W], to + LANES)
        store(room[_MX], to + LANES, wj * (bx - fx))
        store(room[_MY], to + LANES, wj * (by - fy))
        fx, fy = bx, by
    w = load(room[_W], 0)
    store(room[_MX], 0, zero - w * fx)
    store(room[_MY], 0, zero - w * fy)


@kernel
def _eliminate_nodes(begin, end, row, room, wide):
    """The same node by node, with what resists being turned: in float64, for masses of the pinned have no bounds."""
    zero, one, heavy = spread(0.0), spread(1.0), spread(_HEAVY)
    x00 = x01 = x10 = x11 = gx = gy = zero
    for k in range(begin, end, LANES):
        to = k - begin
        nx, ny, dx, dy = widen(load(room[_NX], to)), widen(load(room[_NY], to)), widen(load(row[AX], k)), widen(load(row[AY], k))
        active, mass = widen(load(room[_ACTIVE], to)), one / larger(widen(load(room[_W], to)), heavy)
        stiff, across = where_zero(active, zero, one / widen(load(row[GIVE], k))), active * widen(load(row[BOW], k))
        b00, b01 = stiff * dx * nx + across * (one - nx * nx), stiff * dx * ny - across * nx * ny
        b10, b11 = stiff * dy * nx - across * nx * ny, stiff * dy * ny + across * (one - ny * ny)
        store(wide[_G0], to, gx)
        store(wide[_G1], to, gy)
        push = stiff * widen(load(room[_RIGHT], to)) + where_zero(active, zero - widen(load(row[LAM], k)), zero)
        x00 = x00 + mass
        x11 = x11 + mass
        d00, d01, d10, d11 = x00 + b00, x01 + b01, x10 + b10, x11 + b11
        over = one / (d00 * d11 - d01 * d10)
        i00, i01, i10, i11 = d11 * over, zero - d01 * over, zero - d10 * over, d00 * over
        store(wide[_I], to, i00)
        store(wide[_I + 1], to, i01)
        store(wide[_I + 2], to, i10)
        store(wide[_I + 3], to, i11)
        # What is carried over the link: X D^-1 d right / give + B D^-1 g
        px, py = i00 * dx * push + i01 * dy * push, i10 * dx * push + i11 * dy * push
        qx, qy = i00 * gx + i01 * gy, i10 * gx + i11 * gy
        gx, gy = x00 * px + x01 * py + b00 * qx + b01 * qy, x10 * px + x11 * py + b10 * qx + b11 * qy
        # X becomes X D^-1 B.
        m00, m01 = i00 * b00 + i01 * b10, i00 * b01 + i01 * b11
        m10, m11 = i10 * b00 + i11 * b10, i10 * b01 + i11 * b11
        x00, x01, x10, x11 = x00 * m00 + x01 * m10, x00 * m01 + x01 * m11, x10 * m00 + x11 * m10, x10 * m01 + x11 * m11
    mass = one / larger(widen(load(room[_W], end - begin)), heavy)
    x00 = x00 + mass
    x11 = x11 + mass
    over = one / (x00 * x11 - x01 * x10)
    mx, my = (x11 * gx - x01 * gy) * over, (x00 * gy - x10 * gx) * over
    store(room[_MX], end - begin, lanes_like(mx, row))
    store(room[_MY], end - begin, lanes_like(my, row))
    for k in range(end - LANES, begin - LANES, -LANES):
        to = k - begin
        nx, ny, dx, dy = widen(load(room[_NX], to)), widen(load(room[_NY], to)), widen(load(row[AX], k)), widen(load(row[AY], k))
        active, right = widen(load(room[_ACTIVE], to)), widen(load(room[_RIGHT], to))
        stiff, across = where_zero(active, zero, one / widen(load(row[GIVE], k))), active * widen(load(row[BOW], k))
        out = nx * mx + ny * my
        known = where_zero(active, zero - widen(load(row[LAM], k)), zero)
        push = stiff * (right - out) + known
        fx = load(wide[_G0], to) - dx * push + across * (mx - nx * out)
        fy = load(wide[_G1], to) - dy * push + across * (my - ny * out)
        mx = load(wide[_I], to) * fx + load(wide[_I + 1], to) * fy
        my = load(wide[_I + 2], to) * fx + load(wide[_I + 3], to) * fy
        store(room[_MX], to, lanes_like(mx, row))
        store(room[_MY], to, lanes_like(my, row))
        store(room[_STEP], to, lanes_like(push + stiff * (nx * mx + ny * my), row))


@kernel
def _slack_changes(begin, end, row, room):
    """A rope pulls or does nothing: let go of rows that would push, take up those the others stretch; whether any changed."""
    real = row.dtype.type
    zero, one = spread(real(0)), spread(real(1))
    changed = 0
    for k in range(begin, end, LANES):
        to = k - begin
        active = load(room[_ACTIVE], to)
        rope = load(row[ROPE], k) * load(row[INTACT], k)
        dx = load(room[_MX], to + LANES) - load(room[_MX], to)
        dy = load(room[_MY], to + LANES) - load(room[_MY], to)
        out = load(room[_NX], to) * dx + load(room[_NY], to) * dy
        ends = active * rope * where_above(load(row[LAM], k) + load(room[_STEP], to), zero, one, zero)
        begins = (one - active) * rope * where_above(out, load(room[_RIGHT], to), one, zero)
        begins = where_above(load(row[GIVE], k), zero, begins, zero)
        changed |= which_above(ends + begins, zero)
        store(room[_ACTIVE], to, active + begins - ends)
        store(row[HELD], k, active + begins - ends)
    return changed != 0


@kernel
def _sweep(begin, end, lane, node, row, position, period_x, period_y, weight, shift):
    """One link of a run after the other, back and forth: less exact, but safe where links turn too far."""
    for sweep in range(_SWEEPS):
        for s in range(begin + lane, end, LANES):
            r = s if sweep % 2 == 0 else begin + end - LANES + 2 * lane - s
            if row[INTACT, r] == 0.0:
                continue
            i, j = node[r + shift], node[r + shift + LANES]
            dx = nearest(position[j, 0] - position[i, 0], period_x)
            dy = nearest(position[j, 1] - position[i, 1], period_y)
            length = np.sqrt(dx * dx + dy * dy)
            ww = weight[i] + weight[j]
            if length == 0.0 or ww == 0.0:
                continue
            give = row[GIVE, r]
            step = -(length - row[REST, r] + row[OFFSET, r] + give * row[LAM, r]) / (ww + give)
            if row[ROPE, r] != 0.0:
                step = min(step, -row[LAM, r])
            row[LAM, r] += step
            row[HELD, r] = 1 if row[LAM, r] != 0.0 else 0
            dx, dy = dx * (step / length), dy * (step / length)
            position[i, 0] -= weight[i] * dx
            position[i, 1] -= weight[i] * dy
            position[j, 0] += weight[j] * dx
            position[j, 1] += weight[j] * dy


@kernel
def _move_pack(p, start, node, row, position, room):
    """The nodes go where the solution puts them, but for lanes whose links it turns too far: returns which those are."""
    begin, end, shift = start[p], start[p + 1], LANES * p
    real = row.dtype.type
    zero, one, limit = spread(real(0)), spread(real(1)), spread(real(LINK_TURN if end - begin > LANES else np.inf))
    most = zero
    for k in range(begin, end, LANES):
        to = k - begin
        dx = load(room[_MX], to + LANES) - load(room[_MX], to)
        dy = load(room[_MY], to + LANES) - load(room[_MY], to)
        across = (load(room[_NX], to) * dy - load(room[_NY], to) * dx) * load(room[_BEND], to) * load(row[INTACT], k)
        most = larger(most, larger(across, zero - across))
    far = which_above(most, limit)
    for k in range(begin, end + 1, LANES):
        to = k - begin
        if k < end:
            lam = load(row[LAM], k)
            store(row[LAM], k, where_set(far, lam, lam + load(room[_STEP], to)))
        x, y = take(position, node, k + shift)
        w = load(room[_W], to)
        free = where_set(far, zero, where_zero(w, zero, one))
        mx, my = widen(free * load(room[_MX], to)), widen(free * load(room[_MY], to))
        put(position, node, k + shift, x + mx, y + my)
    return far


@kernel
def _solve_pack(p, start, node, holds, lanes, bowed, row, position, period_x, period_y, weight, room, wide):
    begin, end = start[p], start[p + 1]
    _measure_pack(p, start, node, row, position, period_x, period_y, weight, room)
    ropes = holds[p] & ROPES
    for _ in range(LINK_ROUNDS):
        if bowed[p] and end - begin > LANES:
            _eliminate_nodes(begin, end, row, room, wide)
        else:
            _eliminate_rows(begin, end, row, room)
        if not (ropes and _slack_changes(begin, end, row, room)):
            break
    far = _move_pack(p, start, node, row, position, room)
    if far != 0:
        for lane in range(lanes[p]):
            if (far >> lane) & 1:
                _sweep(begin, end, lane, node, row, position, period_x, period_y, weight, LANES * p)
        for lane in range(lanes[p], LANES):  # those that repeat the last run
            for k in range(begin, end, LANES):
                row[LAM, k + lane] = row[LAM, k + lanes[p] - 1]


@parallel_kernel
def _solve(first, stop, start, node, holds, lanes, bowed, row, position, period_x, period_y, weight, rooms, wide):
    parts = rooms.shape[0]
    for part in prange(parts):
        for p in range(first + part, stop, parts):
            _solve_pack(p, start, node, holds, lanes, bowed, row, position, period_x, period_y, weight, rooms[part], wide[part])


@driver
def sweep(back, skip, colour, start, node, holds, lanes, bowed, row, position, period_x, period_y, weight, rooms, wide):
    """Solve all packs, colour by colour or `back` from the last one, without the first colour on the way if `skip`.

    Colour c is packs colour[c] to colour[c + 1], which share no particle. rooms, wide: (parts, SCRATCH or WIDE, items of
    the longest pack's nodes): as many packs are solved beside each other.
    """
    colours = colour.shape[0] - 1
    for n in range(1 if skip else 0, colours):
        c = colours - 1 - n if back else n
        _solve(colour[c], colour[c + 1], start, node, holds, lanes, bowed, row, position, period_x, period_y, weight, rooms, wide)


@driver
def passes(times, gives, colour, start, node, holds, lanes, bowed, row, position, period_x, period_y, weight, rooms, wide):
    """There and back so many times, from the lam that rows start from; once, one way, where there is a single colour."""
    if gives:
        ahead(colour, start, node, holds, row, position, weight)
    several = colour.shape[0] > 2
    for _ in range(times if several else 1):
        sweep(False, False, colour, start, node, holds, lanes, bowed, row, position, period_x, period_y, weight, rooms, wide)
        if several:
            sweep(True, True, colour, start, node, holds, lanes, bowed, row, position, period_x, period_y, weight, rooms, wide)
