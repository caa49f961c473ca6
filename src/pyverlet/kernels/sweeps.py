"""The two sweeps over all pairs, strip by strip as `kernels.pairs` explains: even strips in parallel, then odd ones.

In the loops over threads nothing is written but by other kernels: Numba drops what is written there to arrays of a tuple.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.lanes import LANES, load, load_rows, spread, store
from pyverlet.compile.rows import load_four, store_four, store_rows
from pyverlet.compile.stealing import claim, none_claimed
from pyverlet.kernels.bounds import AT_WALL, CARRIED, CARRIES
from pyverlet.kernels.contact import mark_strip, push_strip, refine_strip, relax_strip
from pyverlet.kernels.kinds import BOUNCES, RUBS, for_each_kind
from pyverlet.kernels.motion import arrive, set_out

_ONE, _TWO = np.uint64(1), np.uint64(2)

# Particles one thread takes at a time where each is on its own.
_CHUNK = 1024

# Deep packs that are too few to be worth a meeting of the threads.
_FEW = 64


@kernel
def _clear(rows, carries, a, b):
    """Circles from a up to b have not slipped yet, nor turned by it: what the first sweep adds to, beside who carries weight."""
    packed, none = b - (b - a) % LANES, rows.dtype.type(0)
    zero = spread(none)
    for k in range(a, packed, LANES):
        store_four(rows, k, zero, zero, zero, load(carries, k))
    for i in range(packed, b):
        rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3] = none, none, none, carries[i]


@kernel
def _gather(rows, velocity, spin, turn, a, b):
    """What the second sweep changes of the circles from a up to b, and looks at."""
    packed = b - (b - a) % LANES
    for k in range(a, packed, LANES):
        vx, vy = load_rows(velocity, k)
        store_four(rows, k, vx, vy, load(spin, k), load(turn, k))
    for i in range(packed, b):
        rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3] = velocity[i, 0], velocity[i, 1], spin[i], turn[i]


@kernel
def _scatter(rows, velocity, spin, a, b):
    """What it has changed."""
    packed = b - (b - a) % LANES
    for k in range(a, packed, LANES):
        vx, vy, w, _ = load_four(rows, k)
        store_rows(velocity, k, vx, vy)
        store(spin, k, w)
    for i in range(packed, b):
        velocity[i, 0], velocity[i, 1], spin[i] = rows[i, 0], rows[i, 1], rows[i, 2]


@kernel
def _set_out(a, b, circles):
    """Circles from a up to b, before the second sweep."""
    set_out(circles.position[a:b], circles.start[a:b], circles.moved[a:b])
    _gather(circles.rows, circles.velocity, circles.spin, circles.turn, a, b)


@kernel
def _arrive(a, b, circles):
    """And after it: rows are as the next first sweep wants them."""
    _scatter(circles.rows, circles.velocity, circles.spin, a, b)
    _clear(circles.rows, circles.carries, a, b)


def _move(position, velocity, origin, moved, rows, feed):
    """Pushes, and what they have slipped, become places, and velocities, which `moved` then holds."""
    x, v, start, way, beside = position.reshape(-1), velocity.reshape(-1), origin.reshape(-1), moved.reshape(-1), rows.reshape(-1)
    for k in range(moved.shape[0]):
        i, r = np.uint64(2 * k), np.uint64(4 * k)
        j = i + _ONE
        gone_x, gone_y = way[i] - (x[i] - start[i]), way[j] - (x[j] - start[j])
        if RUBS:
            gone_x, gone_y = gone_x + beside[r], gone_y + beside[r + _ONE]
        x[i] += gone_x
        x[j] += gone_y
        gone_x, gone_y = feed * gone_x, feed * gone_y
        v[i] += gone_x
        v[j] += gone_y
        way[i], way[j] = gone_x, gone_y


@kernel
def _weigh(fed, carried, carries):
    """carries = 1 for who has been fed so much that it carries weight, else 0."""
    v = fed.reshape(-1)
    zero, one = carries.dtype.type(0), carries.dtype.type(1)
    for k in range(carries.shape[0]):
        i = np.uint64(2 * k)
        carries[k] = one if v[i] * v[i] + v[i + _ONE] * v[i + _ONE] > carried * carried else zero


@kernel
def _lift(fed, leans, lift):
    """Who rests against others, however lightly, ends the substep as they do."""
    v, zero = fed.reshape(-1), lift.dtype.type(0)
    for k in range(lift.shape[0]):
        i = np.uint64(2 * k)
        lean = leans[k]
        lift[k] = lean if v[i] * v[i] + v[i + _ONE] * v[i + _ONE] > zero else zero


@kernel
def _remember(carries, fed):
    """Who carries weight, and did in the substep before."""
    for k in range(fed.shape[0]):
        fed[k] = ((fed[k] & (CARRIES | AT_WALL)) * CARRIED) | np.uint8(carries[k])


@kernel
def _turn(spin, rows, turn, h, feed):
    """turn = by how much each turns in this substep."""
    row = rows.reshape(-1)
    for k in range(spin.shape[0]):
        turned = row[np.uint64(4 * k) + _TWO]
        turn[k] = h * spin[k] + turned
        spin[k] += feed * turned


def _settle(a, b, circles, law):
    """Of the circles from a up to b: where pushes have put them, and who carries weight."""
    rows = circles.rows[a:b]
    _move(circles.position[a:b], circles.velocity[a:b], circles.origin[a:b], circles.moved[a:b], rows, law.feed)
    _weigh(circles.moved[a:b], law.carried, circles.carries[a:b])
    _remember(circles.carries[a:b], circles.fed[a:b])
    if RUBS:
        _lift(circles.moved[a:b], circles.leans[a:b], circles.lift[a:b])
        _turn(circles.spin[a:b], rows, circles.turn[a:b], law.h, law.feed)


@kernel
def _refine_some(first, stop, parity, circles, pairs, law):
    """The strips 2 half + parity, half from `first` up to `stop`."""
    for half in range(first, stop):
        if pairs.deeps[2 * half + parity] > 0:
            refine_strip(2 * half + parity, circles, pairs, law)


def _push(circles, pairs, law, cut, looks, sets_out, claims):
    """The first sweep: impacts, and overlaps, and what has been slipped.

    cut: (2, threads + 1), which half s // 2 of the strips s with s % 2 = 0, and 1, each thread begins with. looks: 1 if packs
    that overlap deeply are to be noted. sets_out: 1 if `moved` is yet to be set to position - origin, and rows to be cleared.
    claims: `compile.stealing`.
    """
    n = circles.position.shape[0]
    chunks = (n + _CHUNK - 1) // _CHUNK
    if sets_out != 0:
        for c in prange(chunks):
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            set_out(circles.position[a:b], circles.origin[a:b], circles.moved[a:b])
            if RUBS:
                _clear(circles.rows, circles.carries, a, b)
    for parity in range(2):
        none_claimed(claims)
        for part in prange(claims.shape[0]):
            half = claim(claims, cut[parity], part)
            while half >= 0:
                s = 2 * half + parity
                push_strip(s, pairs.begin[s], circles, pairs, law, looks)
                half = claim(claims, cut[parity], part)
    left = 0
    for s in range(pairs.deeps.shape[0]):
        left += pairs.deeps[s]
    for parity in range(2):
        if left == 0:
            break
        if left < _FEW:
            _refine_some(np.int64(0), cut[parity, -1], parity, circles, pairs, law)
        else:
            for part in prange(cut.shape[1] - 1):
                _refine_some(cut[parity, part], cut[parity, part + 1], parity, circles, pairs, law)
    if BOUNCES:
        for c in prange(chunks):
            settle(c * _CHUNK, min((c + 1) * _CHUNK, n), circles, law)
    elif law.arrives != 0:
        for c in prange(chunks):
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            arrive(circles.position[a:b], circles.velocity[a:b], circles.origin[a:b], circles.moved[a:b], law.feed)


def _relax(circles, pairs, law, cut, marks, claims):
    """The second sweep: touching pairs neither approach nor slip; if `marks` is 1, do what `mark_touching` does, too."""
    n = circles.position.shape[0]
    if RUBS:
        for c in prange((n + _CHUNK - 1) // _CHUNK):
            _set_out(c * _CHUNK, min((c + 1) * _CHUNK, n), circles)
    for parity in range(2):
        none_claimed(claims)
        for part in prange(claims.shape[0]):
            half = claim(claims, cut[parity], part)
            while half >= 0:
                s = 2 * half + parity
                relax_strip(s, pairs.begin[s], circles, pairs, law)
                if marks != 0:
                    a = pairs.begin[s]
                    mark_strip(a, a + pairs.lanes[s], a, pairs.lane_i, pairs.lane_j, pairs.normal, circles.resting)
                half = claim(claims, cut[parity], part)
    if RUBS:
        for c in prange((n + _CHUNK - 1) // _CHUNK):
            _arrive(c * _CHUNK, min((c + 1) * _CHUNK, n), circles)


@parallel_kernel
def mark_touching(lanes, begin, lane_i, lane_j, normal, resting, cut):
    """`resting` gains IN_PILE for every circle of a touching pair."""
    for parity in range(2):
        for part in prange(cut.shape[1] - 1):
            for half in range(cut[parity, part], cut[parity, part + 1]):
                a = begin[2 * half + parity]
                mark_strip(a, a + lanes[2 * half + parity], a, lane_i, lane_j, normal, resting)


settle = for_each_kind(kernel, _settle, _move=for_each_kind(kernel, _move))
push = for_each_kind(parallel_kernel, _push, push_strip=push_strip, settle=settle)
relax = for_each_kind(parallel_kernel, _relax, relax_strip=relax_strip)
