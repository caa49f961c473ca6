"""Runs of distances, each solved at once, eight runs beside each other: a light rope carries a heavy ball in one go.

A run is links that follow each other: row r joins the nodes r and r + 1. With w = 1/m, the direction n of a link, and the one d
its force acts along (kernels.links), the steps of lam satisfy

    (n_r . (w_r d_r + w_r+1 d_r) + give_r) lam_r - w_r n_r . d_r-1 lam_r-1 - w_r+1 n_r . d_r+1 lam_r+1 = right_r

for each row: tridiagonal, eliminated from its first row on. What the rows so far leave of the mobility of the present one's first
node is a = w (near / pivot), a sum of what gives: in that form nothing large cancels.

A taut link also resists being turned, as a string does: by its tension over its length, `bow`. Without it a light rope would
be thrown sideways by its own tension as soon as substeps are too long for its fastest swing. Where that matters (`bow` > 0) each
row is two equations: also across the link, along t, t . (x_r+1 - x_r) + tau / bow = 0. What the rows so far leave of the mobility
of a node is a matrix A then, w at the first. With N = [n t], D = [d t] and C = diag(give, 1 / bow), of a row

    E = N^T A D + C,    K = E + w N^T D,    K (lam, tau) = (right, 0) + N^T y + w N^T f,    A becomes w N E K^-1 N^T

where w is of its second node, y where the rows so far have left its first one, and f the force of the next row. As columns of C
and D may be scaled alike, tau is had as bow times a length, and nothing is divided by a bow of 0.

Eight runs of one colour are a pack: they share no particle. Number k of lane l in a pack is item 8 k + l of it. A run that is
shorter than its pack repeats its last node, with rows that are broken; a pack that has fewer runs repeats its last one: both
lanes write the same. The items of the nodes of pack p are start[p] to start[p + 1], and those of its rows the same but the last
eight: a row stands where its first node does.

Nodes are known by their `shift`, the way that links have moved them: that is small, and keeps its digits in float32.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.compile.lanes import (
    LANES,
    larger,
    load,
    put,
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
from pyverlet.ground.constants import LINK_BOWED, LINK_ROUNDS, LINK_SLIGHT, LINK_TAUT, LINK_TURN
from pyverlet.kernels.chain_rows import (
    AX,
    AY,
    DX,
    DY,
    EXTRA,
    FORCE,
    GIVE,
    GOAL,
    HELD,
    LAM,
    REST,
    ROPE,
    ROPES,
    ROW,
    SOFTS,
    TURN,
    W,
)

_SWEEPS = 4

_PLAIN, _SPARE = 7, 8
_SX, _SY, _TX, _TY, _Z, _U, _LAM = range(0, LANES * _PLAIN, LANES)
_NX, _NY, _RIGHT, _ACTIVE, _MX, _MY, _STEP, _BOW = range(0, LANES * _SPARE, LANES)
"""What is noted of a row, or of its first node, while its pack is solved, laid out as rows are: the shift of the node, the
direction over the length, two of elimination, and lam before. After those of all rows stands what only packs need that have
ropes or are bowed: the direction, right, who pulls, the move of the node, the step of lam, and `bow`."""

_ALONG, _ACROSS, _I = 0, LANES, 2 * LANES
"""And in float64 of what is bowed: the forces along and across as they are without that of the next row, and K^-1, a 2 x 2."""

SCRATCH, WIDE = _PLAIN + _SPARE, 6
"""Numbers for each item of one pack, in the dtype of the rows and in float64."""


@kernel
def _eliminate(fresh, keeps, bows, kinds, begin, end, node, row, more, shift, hh, room):
    """From the first row of a pack to the last: how each stands now and who pulls, or, if not `fresh`, who pulls by now; and what
    the rows so far leave to the next one. The direction of the force follows the row.
    """
    real = row.dtype.type
    zero, one, half = spread(real(0)), spread(real(1)), spread(real(0.5))
    shortest, nearly = spread(real(1e-24)), spread(real(LINK_TAUT))
    straight, steeper = spread(real(LINK_BOWED)), spread(real(hh / (1.0 - LINK_BOWED)))
    ropes, soft = kinds & ROPES, kinds & SOFTS
    spare = _PLAIN * (end - begin + LANES)
    active = a = give = nd = z = per = zero
    nx = ny = ax = ay = zero
    w = load(row, ROW * begin + W)
    xi, yi = take(shift, node, begin)
    for k in range(begin, end, LANES):
        here, to, too = ROW * k, _PLAIN * (k - begin), spare + _SPARE * (k - begin)
        g = load(row, here + GIVE)
        if fresh:
            xj, yj = take(shift, node, k + LANES)
            dx, dy = load(row, here + DX) + (xj - xi), load(row, here + DY) + (yj - yi)
            square = dx * dx + dy * dy
            length = square_root(square)
            bend = length * (one / larger(square, shortest))  # not 1 / length: so the division need not wait for the root
            mx, my = where_zero(length, one, dx * bend), dy * bend
            bx, by, turn, lam = load(row, here + AX), load(row, here + AY), load(row, here + TURN), load(row, here + LAM)
            bx, by = bx + turn * (mx - bx), by + turn * (my - by)
            md = mx * bx + my * by  # turned by 60 degrees in a substep: the old direction says nothing any more
            bx, by = where_above(half, md, mx, bx), where_above(half, md, my, by)
            md = where_above(half, md, one, md)
            goal = load(more, EXTRA * k + GOAL) if soft else load(row, here + REST)
            right = goal - length - g * lam
            pulls = where_above(g, zero, one, zero)
            across = bend * pulls
            if ropes:
                known = nearly * load(row, here + REST) * load(more, EXTRA * k + HELD)
                pulls = pulls * where_above(known, right, one, one - load(more, EXTRA * k + ROPE))
            store(row, here + AX, bx)
            store(row, here + AY, by)
            store(room, to + _SX, xi)
            store(room, to + _SY, yi)
            store(room, to + _TX, mx * across)
            store(room, to + _TY, my * across)
            store(room, to + _LAM, lam)
            if keeps:
                store(room, too + _NX, mx)
                store(room, too + _NY, my)
                store(room, too + _RIGHT, right)
                store(room, too + _ACTIVE, pulls)
            if bows:
                store(room, too + _BOW, larger(turn - straight, zero) * steeper * larger(load(row, here + FORCE), zero) * bend)
            xi, yi = xj, yj
        else:
            mx, my, bx, by = load(room, too + _NX), load(room, too + _NY), load(row, here + AX), load(row, here + AY)
            right, pulls, lam = load(room, too + _RIGHT), load(room, too + _ACTIVE), load(room, to + _LAM)
            md = mx * bx + my * by
        if bows:
            continue
        wj = load(row, here + LANES * ROW + W)
        c, cc = nx * bx + ny * by, mx * ax + my * ay
        store(room, to + _U, w * c * per)
        near = md * (a + give) + w * (nd * md - c * cc)
        a = where_zero(active, w * md, w * (near * per))
        per = where_zero(pulls, zero, one / (a + wj * md + g))
        z = where_zero(pulls, zero - lam, (right + w * cc * z) * per)
        store(room, to + _Z, z)
        nx, ny, ax, ay, nd, give, w, active = mx, my, bx, by, md, g, wj, pulls
    if fresh:
        store(room, _PLAIN * (end - begin) + _SX, xi)
        store(room, _PLAIN * (end - begin) + _SY, yi)


@kernel
def _eliminate_bowed(begin, end, row, room, wide):
    """The steps of lam and the moves of the nodes, with what resists being turned: in float64. Of the little mobility that a load
    of a hundred thousand times a node's weight leaves along a run, float32 would leave nothing across it.
    """
    zero, one = spread(0.0), spread(1.0)
    spare = _PLAIN * (end - begin + LANES)
    mx, my, yx, yy = one, zero, zero, zero
    w = widen(load(row, ROW * begin + W))
    g00 = g11 = w
    g01 = g10 = zero
    for k in range(begin, end, LANES):
        here, to, too = ROW * k, _PLAIN * (k - begin), spare + _SPARE * (k - begin)
        nx, ny = widen(load(room, too + _NX)), widen(load(room, too + _NY))
        dx, dy = widen(load(row, here + AX)), widen(load(row, here + AY))
        pulls, w = widen(load(room, too + _ACTIVE)), widen(load(row, here + LANES * ROW + W))
        bow = pulls * widen(load(room, too + _BOW))
        # What is left of the mobility of the first node, along the link and across it.
        c, s = mx * nx + my * ny, mx * ny - my * nx
        f00, f01, f10, f11 = g00 * c + g01 * s, g01 * c - g00 * s, g10 * c + g11 * s, g11 * c - g10 * s
        h00, h01, h10, h11 = c * f00 + s * f10, c * f01 + s * f11, c * f10 - s * f00, c * f11 - s * f01
        md, td = pulls * (nx * dx + ny * dy), pulls * (nx * dy - ny * dx)
        e00 = h00 * md + h01 * td + (one - pulls) + pulls * widen(load(row, here + GIVE))
        e01, e10, e11 = bow * h01, h10 * md + h11 * td, bow * h11 + one
        k00, k10, k11 = e00 + w * md, e10 + w * td, e11 + w * bow
        over = one / (k00 * k11 - e01 * k10)
        i00, i01, i10, i11 = k11 * over, zero - e01 * over, zero - k10 * over, k00 * over
        along, across = pulls * (widen(load(room, too + _RIGHT)) + nx * yx + ny * yy), nx * yy - ny * yx
        z, turns = i00 * along + i01 * across, i10 * along + i11 * across
        broad = WIDE * (k - begin)
        store(wide, broad + _ALONG, z)
        store(wide, broad + _ACROSS, turns)
        store(wide, broad + _I, i00)
        store(wide, broad + _I + LANES, i01)
        store(wide, broad + _I + 2 * LANES, i10)
        store(wide, broad + _I + 3 * LANES, i11)
        z, turns = pulls * z + (pulls - one) * widen(load(room, to + _LAM)), bow * turns
        yx, yy = w * (dx * z - ny * turns), w * (dy * z + nx * turns)
        g00, g01 = w * (e00 * i00 + e01 * i10), w * (e00 * i01 + e01 * i11)
        g10, g11 = w * (e10 * i00 + e11 * i10), w * (e10 * i01 + e11 * i11)
        mx, my = nx, ny
    fx = fy = zero
    for k in range(end - LANES, begin - LANES, -LANES):
        here, to, broad = ROW * k, _PLAIN * (k - begin), WIDE * (k - begin)
        too = spare + _SPARE * (k - begin)
        nx, ny = widen(load(room, too + _NX)), widen(load(room, too + _NY))
        dx, dy = widen(load(row, here + AX)), widen(load(row, here + AY))
        pulls, w = widen(load(room, too + _ACTIVE)), widen(load(row, here + LANES * ROW + W))
        along, across = pulls * (w * (nx * fx + ny * fy)), w * (nx * fy - ny * fx)
        i00, i01 = load(wide, broad + _I), load(wide, broad + _I + LANES)
        i10, i11 = load(wide, broad + _I + 2 * LANES), load(wide, broad + _I + 3 * LANES)
        step = load(wide, broad + _ALONG) + i00 * along + i01 * across
        turns = pulls * widen(load(room, too + _BOW)) * (load(wide, broad + _ACROSS) + i10 * along + i11 * across)
        step = where_zero(pulls, zero - widen(load(room, to + _LAM)), step)
        bx, by = dx * step - ny * turns, dy * step + nx * turns
        store(room, too + LANES * _SPARE + _MX, lanes_like(w * (bx - fx), row))
        store(room, too + LANES * _SPARE + _MY, lanes_like(w * (by - fy), row))
        store(room, too + _STEP, lanes_like(step, row))
        fx, fy = bx, by
    w = widen(load(row, ROW * begin + W))
    store(room, spare + _MX, lanes_like(zero - w * fx, row))
    store(room, spare + _MY, lanes_like(zero - w * fy, row))


@kernel
def _ask(k, here, too, out_x, out_y, lam, row, more, room):
    """A rope pulls or does nothing: of the rows from item k on, whose ends have moved apart by `out`, those that would push let
    go, and those that the others stretch begin. Which lanes' are off by so much that they are to be solved again.
    """
    real = row.dtype.type
    zero, one, active, right = spread(real(0)), spread(real(1)), load(room, too + _ACTIVE), load(room, too + _RIGHT)
    rope = where_above(load(row, here + GIVE), zero, load(more, EXTRA * k + ROPE), zero)
    out = load(room, too + _NX) * out_x + load(room, too + _NY) * out_y
    ends = active * rope * where_above(lam, zero, one, zero)
    begins = (one - active) * rope * where_above(out, right, one, zero)
    active = active + begins - ends
    store(room, too + _ACTIVE, active)
    store(more, EXTRA * k + HELD, active)
    pushed = ends * lam * (load(row, here + W) + load(row, here + LANES * ROW + W))
    return which_above(larger(pushed, begins * (out - right)), spread(real(LINK_SLIGHT)) * load(row, here + REST))


@kernel
def _move(bows, ropes, begin, end, node, row, more, shift, room):
    """Back from the last row to the first: the steps of lam, and nodes go where these lead. Which lanes' links it turns too far,
    and, of ropes, which lanes' are to be solved again with others that pull.

    bows: steps and moves are known already, by `_eliminate_bowed`.
    """
    real = row.dtype.type
    zero, limit = spread(real(0)), spread(real(LINK_TURN if end - begin > LANES else np.inf))
    spare, again = _PLAIN * (end - begin + LANES), 0
    step = u = fx = fy = most = lam = zero
    tx = ty = ox = oy = zero  # of the row after this one: what it crosses, and the move of its last node
    for k in range(end - LANES, begin - LANES, -LANES):
        here, to, too = ROW * k, _PLAIN * (k - begin), spare + _SPARE * (k - begin)
        following, after = to + LANES * _PLAIN, too + LANES * _SPARE
        w = load(row, here + LANES * ROW + W)
        if bows:
            step, mx, my = load(room, too + _STEP), load(room, after + _MX), load(room, after + _MY)
        else:
            step = load(room, to + _Z) + u * step
            u = load(room, to + _U)
            bx, by = load(row, here + AX) * step, load(row, here + AY) * step
            mx, my = w * (bx - fx), w * (by - fy)
            fx, fy = bx, by
        if ropes and k + LANES < end:
            again |= _ask(k + LANES, here + LANES * ROW, after, ox - mx, oy - my, lam, row, more, room)
        lam = load(room, to + _LAM) + step
        store(row, here + LAM, lam)
        put(shift, node, k + LANES, load(room, following + _SX) + mx, load(room, following + _SY) + my)
        across = tx * (oy - my) - ty * (ox - mx)
        most = larger(most, larger(across, zero - across))
        tx, ty, ox, oy = load(room, to + _TX), load(room, to + _TY), mx, my
    w = load(row, ROW * begin + W)
    if bows:
        mx, my = load(room, spare + _MX), load(room, spare + _MY)
    else:
        mx, my = zero - w * fx, zero - w * fy
    put(shift, node, begin, load(room, _SX) + mx, load(room, _SY) + my)
    if ropes:
        again |= _ask(begin, ROW * begin, spare, ox - mx, oy - my, lam, row, more, room)
    across = tx * (oy - my) - ty * (ox - mx)
    return which_above(larger(most, larger(across, zero - across)), limit), again


@kernel
def _go_back(begin, end, lane, node, row, shift, room):
    """The nodes of a run, and its rows, are as they were before they were solved."""
    for k in range(begin, end + 1, LANES):
        to = _PLAIN * (k - begin) + lane
        shift[node[k + lane], 0], shift[node[k + lane], 1] = room[to + _SX], room[to + _SY]
        if k < end:
            row[ROW * k + lane + LAM] = room[to + _LAM]


@kernel
def _sweep(begin, end, lane, kinds, node, row, more, shift):
    """One link of a run after the other, back and forth: less exact, but safe where links turn too far."""
    for sweep in range(_SWEEPS):
        for s in range(begin, end, LANES):
            k = s if sweep % 2 == 0 else begin + end - LANES - s
            r, i, j = ROW * k + lane, node[k + lane], node[k + lane + LANES]
            give, wi, wj = np.float64(row[r + GIVE]), np.float64(row[r + W]), np.float64(row[r + LANES * ROW + W])
            dx = np.float64(row[r + DX]) + (np.float64(shift[j, 0]) - shift[i, 0])
            dy = np.float64(row[r + DY]) + (np.float64(shift[j, 1]) - shift[i, 1])
            length = np.sqrt(dx * dx + dy * dy)
            if length == 0.0 or not give > 0.0:
                continue
            extra = EXTRA * k + lane
            goal = np.float64(more[extra + GOAL] if kinds & SOFTS else row[r + REST])
            step = -(length - goal + give * row[r + LAM]) / (wi + wj + give)
            if kinds & ROPES and more[extra + ROPE] != 0.0:
                step = min(step, -np.float64(row[r + LAM]))
            row[r + LAM] += step
            if kinds & ROPES:
                more[extra + HELD] = 1 if row[r + LAM] != 0.0 else 0
            dx, dy = dx * (step / length), dy * (step / length)
            shift[i, 0] -= wi * dx
            shift[i, 1] -= wi * dy
            shift[j, 0] += wj * dx
            shift[j, 1] += wj * dy


@kernel
def solve_pack(p, start, node, holds, lanes, bowed, row, more, shift, hh, room, wide):
    """A pack is solved once more: its nodes move, in `shift`. hh: h^2; room, wide: of SCRATCH and WIDE numbers an item."""
    begin, end = start[p], start[p + 1] - LANES
    ropes, bows = (holds[p] & ROPES) != 0, bowed[p] != 0 and end - begin > LANES
    keeps, fresh, far = ropes or bows, True, 0
    for _ in range(LINK_ROUNDS):
        _eliminate(fresh, keeps, bows, holds[p], begin, end, node, row, more, shift, hh, room)
        if bows:
            _eliminate_bowed(begin, end, row, room, wide)
        far, again = _move(bows, ropes, begin, end, node, row, more, shift, room)
        if again == 0:
            break
        fresh = False
    if far != 0:
        for lane in range(lanes[p]):
            if (far >> lane) & 1:
                _go_back(begin, end, lane, node, row, shift, room)
                _sweep(begin, end, lane, holds[p], node, row, more, shift)
        for lane in range(lanes[p], LANES):  # those that repeat the last run
            for k in range(begin, end, LANES):
                row[ROW * k + lane + LAM] = row[ROW * k + lanes[p] - 1 + LAM]
