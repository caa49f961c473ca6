"""What the packs of `kernels.chains` keep of their rows: made ready for a substep, noted; and the user's tables."""

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
)
from pyverlet.compile.stealing import claim_evenly, none_claimed
from pyverlet.ground.constants import LINK_BOWED, LINK_GIVE, LINK_LEAST_N, LINK_MEMORY_S, LINK_RESOLVED
from pyverlet.kernels.motion import BLOCK
from pyverlet.kernels.seam import apart_lanes, nearest

COLUMNS = ("weight", "gap_x", "gap_y", "along_x", "along_y", "turn", "give", "lam", "rest", "force")
"""What is kept of a row, in the dtype of the world. weight: of its first node, 1/kg. gap: from there to the second one as the
integrator has put them, m. give: -1 of the broken, 0 where nothing can move. lam: between substeps what it pulled with, N."""

MORE = ("goal", "soft", "stiffness", "damping", "rope", "held", "strength", "then", "before", "yields", "keeps")
"""The same of rows in packs that hold springs, ropes or what may break, the rest of which is not looked at. goal: the length that
its force leads to, in place of rest; soft, rope and held are 1 or 0, the stiffness of what is not soft is 0; held: a rope that
pulled when it was solved last; strength: N at which it breaks. The last four are what a spring is blended of, which changes with
masses and the step alone, and is kept for a frame: how its stretch at the start of a substep counts, and that before, beside the
one at its end; what it gives, and what of its last pull it starts from, times h^2.

Of each kind eight rows stand beside each other, column after column, then the next eight: what is read together lies together.
Item 8 k + l of a column of ROW numbers is at 8 k * ROW + LANES * column + l. The names below have LANES in them."""

ROW, EXTRA = len(COLUMNS), len(MORE)
"""How many numbers there are of each row, of either kind."""

KEPT = 3
"""And how many of them change from frame to frame."""

W, DX, DY, AX, AY, TURN, GIVE, LAM, REST, FORCE = range(0, LANES * ROW, LANES)
GOAL, SOFT, STIFFNESS, DAMPING, ROPE, HELD, STRENGTH, THEN, BEFORE, YIELDS, KEEPS = range(0, LANES * EXTRA, LANES)

_INTACT, _FORCE, _LAST = range(0, LANES * KEPT, LANES)

BROKEN = -1.0

ROPES, SOFTS, BRITTLE = 1, 2, 4
"""Bits of what is in a pack."""

_LEAST = 1e-25
"""N/m: springs softer than that pull with as much; where one divides by them, in float32 too."""

_MOST = 1e15
"""(frequency * h)^2: beyond that it is all settled, and its square no number in float32. Links crushed between a wall and what
moves on have come to that."""

_CHUNK = 1024
"""Rows that are noted by one thread at a time, of a multiple of LANES."""


@kernel
def _settled(s, resolved, most):
    """`kernels.links.share_settled`, lane by lane; resolved: the square of LINK_RESOLVED; most: see _MOST."""
    s = smaller(s, most)
    return s * s / (s * s + resolved)


@kernel
def at(k):
    """Where item k of the rows stands in the first column."""
    return k // LANES * (LANES * ROW) + k % LANES


@kernel
def _blend(k, row, more, ww, h, resolved, most):
    """`kernels.links.blend`, of the springs among eight rows from item k on. ww: 1/kg."""
    real = row.dtype.type
    quarter, half, two, three = spread(real(0.25)), spread(real(0.5)), spread(real(2)), spread(real(3))
    zero, one, least, per_hh = spread(real(0)), spread(real(1)), spread(real(_LEAST)), spread(real(1.0 / (h * h)))
    one_h, hh, per_h, there = spread(real(h)), spread(real(h * h)), spread(real(1.0 / h)), EXTRA * k
    is_soft, stiffness, damping = load(more, there + SOFT), load(more, there + STIFFNESS), load(more, there + DAMPING)
    q = _settled(hh * stiffness * ww, resolved, most)
    s = one_h * damping * ww
    part = half + half * s / (one + s)
    rate = damping * per_h
    kp = stiffness * (one + three * q) * quarter + rate * part
    k0 = stiffness * (one - q) * half + rate * (one - two * part)
    km = stiffness * (one - q) * quarter - rate * (one - part)
    per = is_soft * (one / larger(kp, least))
    store(more, there + THEN, k0 * per)
    store(more, there + BEFORE, km * per)
    store(more, there + YIELDS, per * per_hh)
    store(more, there + KEEPS, zero - is_soft * (one - load(more, there + ROPE)) * (one - q) * hh)


@kernel
def prepare_pack(fresh, p, start, node, holds, row, more, begun, predicted, back, weight, shift, period_x, period_y, h):
    """What the rows of a pack are to satisfy; soft ones move their nodes by the lam they start from. fresh: blend them first."""
    real = row.dtype.type
    zero, one, tiny, resolved = spread(real(0)), spread(real(1)), spread(real(1e-24)), spread(real(LINK_RESOLVED * LINK_RESOLVED))
    straight, hh, rigid, most = spread(real(LINK_BOWED)), spread(real(h * h)), spread(real(LINK_GIVE)), spread(real(_MOST))
    ropes, soft = holds[p] & ROPES, holds[p] & SOFTS
    begin, end = start[p], start[p + 1] - LANES
    bowed = 0
    fx = fy = zero
    xi, yi = take(begun, node, begin)
    pi, qi = take(predicted, node, begin)
    ui, vi = take(back, node, begin)
    wi = pick(weight, node, begin)
    for k in range(begin, end, LANES):
        xj, yj = take(begun, node, k + LANES)
        pj, qj = take(predicted, node, k + LANES)
        wj = pick(weight, node, k + LANES)
        here, there = ROW * k, EXTRA * k
        dx, dy = apart_lanes(xi, xj, period_x, row), apart_lanes(yi, yj, period_y, row)
        square = dx * dx + dy * dy
        length = square_root(square)
        bend = length * (one / larger(square, tiny))
        ax, ay = where_zero(length, one, dx * bend), dy * bend
        ww, force, rest, before = wi + wj, load(row, here + FORCE), load(row, here + REST), load(row, here + GIVE)
        swing = hh * larger(force, zero - force) * bend * ww  # (frequency of swinging sideways * h)^2
        turn = _settled(swing, resolved, most)
        bowed |= which_above(turn * where_above(force, zero, one, zero), straight)
        give, lam = rigid * ww, zero
        store(row, here + W, wi)
        store(row, here + DX, apart_lanes(pi, pj, period_x, row))
        store(row, here + DY, apart_lanes(qi, qj, period_y, row))
        store(row, here + AX, ax)
        store(row, here + AY, ay)
        store(row, here + TURN, turn)
        if ropes:
            store(more, there + HELD, where_above(load(row, here + LAM), zero, one, zero))
        if soft:
            uj, vj = take(back, node, k + LANES)
            ex, ey = dx - (uj - ui), dy - (vj - vi)
            slack = load(more, there + ROPE)
            c0, cm = length - rest, square_root(ex * ex + ey * ey) - rest
            c0 = where_above(slack, zero, larger(c0, zero), c0)  # a slack rope has no stretch to remember
            cm = where_above(slack, zero, larger(cm, zero), cm)
            if fresh:
                _blend(k, row, more, ww, h, resolved, most)
            give = give + load(more, there + YIELDS)
            store(more, there + GOAL, rest - (load(more, there + THEN) * c0 + load(more, there + BEFORE) * cm))
            lam = load(more, there + KEEPS) * load(row, here + LAM)
            lam = where_above(zero, before, zero, lam)
            gx, gy = ax * lam, ay * lam
            mx, my = take(shift, node, k)
            put(shift, node, k, mx + wi * (fx - gx), my + wi * (fy - gy))
            fx, fy, ui, vi = gx, gy, uj, vj
        store(row, here + GIVE, where_above(zero, before, before, give))
        store(row, here + LAM, lam)
        xi, yi, pi, qi, wi = xj, yj, pj, qj, wj
    store(row, ROW * end + W, wi)
    if soft:
        mx, my = take(shift, node, end)
        put(shift, node, end, mx + wi * fx, my + wi * fy)
    return bowed != 0


@parallel_kernel
def _prepare(
    fresh, first, stop, start, node, holds, bowed, row, more, begun, predicted, back, weight, shift, period_x, period_y, h, claims
):  # fmt: skip
    for part in prange(claims.shape[0]):
        k = claim_evenly(claims, stop - first, part)
        while k >= 0:
            p = first + k
            if holds[p] & SOFTS:
                bowed[p] = prepare_pack(
                    fresh, p, start, node, holds, row, more, begun, predicted, back, weight, shift, period_x, period_y, h
                )
            k = claim_evenly(claims, stop - first, part)


@driver
def prepare_soft(linked, linking):
    """Every row's equation, length = goal - give lam, in packs that give, and which of them resist being turned.

    From where a substep has begun, the way back from there to a substep before, and where the integrator has put all. Nodes
    move by the lam their rows start from, in `shift`, so colour by colour. blended: [1] if springs have been in this frame.
    """
    colour, holds = linked.colour, linked.holds
    fresh, linked.blended[0] = linked.blended[0] == 0, 1
    for c in range(colour.shape[0] - 1):
        some = False
        for p in range(colour[c], colour[c + 1]):
            some |= (holds[p] & SOFTS) != 0
        if some:
            none_claimed(linked.claims)
            _prepare(
                fresh, colour[c], colour[c + 1], linked.begin, linked.node, holds, linked.bowed, linked.row, linked.more,
                linked.start, linked.predicted, linked.back, linked.weight, linked.shift, linking.period_x, linking.period_y,
                linking.h, linked.claims,
            )  # fmt: skip


@kernel
def note_pack(p, start, holds, row, more, torn, h):
    """The pull in N, which for rigid links is noisy; let the force shown follow it. That of the broken stays what it was.

    Break those that pull or push harder than their strength; torn[p]: there are such.
    """
    begin, end = start[p], start[p + 1] - LANES
    real = row.dtype.type
    part, rate = spread(real(h / (h + LINK_MEMORY_S))), spread(real(-1.0 / (h * h)))
    zero, least, broken = spread(real(0)), spread(real(LINK_LEAST_N)), spread(real(BROKEN))
    brittle, snaps = holds[p] & BRITTLE, 0
    for k in range(begin, end, LANES):
        here = ROW * k
        give, last, force = load(row, here + GIVE), load(row, here + LAM) * rate, load(row, here + FORCE)
        now = force + part * (last - force)
        now = where_above(larger(now, zero - now), least, now, zero)
        store(row, here + LAM, last)
        force = where_above(zero, give, force, now)
        store(row, here + FORCE, force)
        if brittle:
            size, strength = larger(force, zero - force), load(more, EXTRA * k + STRENGTH)
            snaps |= which_above(where_above(zero, give, zero, size), strength)
            store(row, here + GIVE, where_above(size, strength, broken, give))
    if snaps != 0:
        torn[p] = 1


# ---- between the tables of the user's links and the packs ---------------------------------------------------------------------


@kernel
def lay(source, start, row, more, holds, rest, stiffness, damping, upper, strength):
    """What of the rows frames leave alone, from the tables; holds[p]: what kinds of row are in pack p.

    source: which row of the tables stands in each item, -1 for none.
    """
    real = row.dtype.type
    zero, one, most = real(0), real(1), np.finfo(row.dtype).max
    for p in range(start.shape[0] - 1):
        kinds = 0
        for n in range(start[p], start[p + 1]):
            r, k, m = source[n], at(n), n // LANES * (LANES * EXTRA) + n % LANES
            here = r >= 0
            soft, rope = here and stiffness[r] < np.inf, here and upper[r] < np.inf
            brittle = here and strength[r] < most
            row[k + REST] = rest[r] if here else zero
            more[m + DAMPING] = damping[r] if here else zero
            more[m + STIFFNESS] = stiffness[r] if soft else zero
            more[m + STRENGTH] = strength[r] if brittle else most
            more[m + ROPE], more[m + SOFT] = one if rope else zero, one if soft else zero
            kinds |= (ROPES if rope else 0) | (SOFTS if soft else 0) | (BRITTLE if brittle else 0)
        holds[p] = kinds


@kernel
def take_up(source, row, intact, force, last):
    """And what changes."""
    for n in range(source.shape[0]):
        r, k = source[n], at(n)
        row[k + GIVE], row[k + FORCE], row[k + LAM] = BROKEN, 0, 0
        if r >= 0:
            row[k + GIVE], row[k + FORCE], row[k + LAM] = 0 if intact[r] else BROKEN, force[r], last[r]


@parallel_kernel
def keep(row, kept):
    """A frame is over: `kept` (KEPT numbers an item, laid out as rows are) becomes what of the rows changes."""
    items = row.shape[0] // ROW
    for c in prange((items + _CHUNK - 1) // _CHUNK):
        for k in range(c * _CHUNK, min((c + 1) * _CHUNK, items), LANES):
            store(kept, KEPT * k + _INTACT, load(row, ROW * k + GIVE))
            store(kept, KEPT * k + _FORCE, load(row, ROW * k + FORCE))
            store(kept, KEPT * k + _LAST, load(row, ROW * k + LAM))


@kernel
def go_back(row, kept):
    """The way back, after a frame that was not good."""
    for k in range(0, row.shape[0] // ROW, LANES):
        store(row, ROW * k + GIVE, load(kept, KEPT * k + _INTACT))
        store(row, ROW * k + FORCE, load(kept, KEPT * k + _FORCE))
        store(row, ROW * k + LAM, load(kept, KEPT * k + _LAST))


@kernel
def hand_over(place, kept, intact, force, last):
    """The tables become what was kept. place: (rows,) the item each row stands in."""
    for r in range(place.shape[0]):
        k = place[r] // LANES * (LANES * KEPT) + place[r] % LANES
        whole = kept[k + _INTACT] >= 0.0
        intact[r] = whole
        force[r], last[r] = (kept[k + _FORCE], kept[k + _LAST]) if whole else (0.0, 0.0)


@kernel
def intact(place, row):
    """(rows,) who is whole now."""
    out = np.empty(place.shape[0], np.uint8)
    for r in range(place.shape[0]):
        out[r] = row[at(place[r]) + GIVE] >= 0.0
    return out


@kernel
def _stretch(i, j, position, period_x, period_y, rest):
    """How much further i and j are from each other than `rest`, m."""
    dx = nearest(np.float64(position[j, 0]) - np.float64(position[i, 0]), period_x)
    dy = nearest(np.float64(position[j, 1]) - np.float64(position[i, 1]), period_y)
    return np.sqrt(dx * dx + dy * dy) - rest


@kernel
def _held(first, stop, position, period_x, period_y, ends, rest, upper, stiffness, intact):
    """Energy of the rows from `first` up to `stop` that give, J: none of the broken, nor of slack ropes."""
    total = 0.0
    for r in range(first, stop):
        if intact[r] and stiffness[r] < np.inf:
            value = _stretch(ends[r, 0], ends[r, 1], position, period_x, period_y, rest[r])
            if value > 0.0 or upper[r] > 0.0:
                total += stiffness[r] * value * value
    return 0.5 * total


@parallel_kernel
def energy(position, period_x, period_y, ends, rest, upper, stiffness, intact):
    """What all rows hold, J. ends: (rows, 2) rows of `position`.

    Blocks are summed apart, and then together in order: any number of threads gives the same bits.
    """
    rows = ends.shape[0]
    part = np.zeros((rows + BLOCK - 1) // BLOCK)
    for block in prange(part.shape[0]):
        first, stop = block * BLOCK, min((block + 1) * BLOCK, rows)
        part[block] = _held(first, stop, position, period_x, period_y, ends, rest, upper, stiffness, intact)
    total = 0.0
    for block in range(part.shape[0]):
        total += part[block]
    return total


@kernel
def share_gain(before, now, period_x, period_y, ends, rest, upper, stiffness, intact, mass, share):
    """Add what each row holds at the positions of `now` beyond that `before`, J, to the share of its first free particle."""
    for r in range(ends.shape[0]):
        if intact[r] and stiffness[r] < np.inf:
            i, j = ends[r, 0], ends[r, 1]
            then = _stretch(i, j, before, period_x, period_y, rest[r])
            later = _stretch(i, j, now, period_x, period_y, rest[r])
            if upper[r] <= 0.0:
                then, later = max(then, 0.0), max(later, 0.0)
            share[i if mass[i] < np.inf else j] += 0.5 * stiffness[r] * (later * later - then * then)
