"""The two sweeps over all pairs, strip by strip as `kernels.pairs` explains: even strips in parallel, then odd ones.

In the loops over threads nothing is written but by other kernels: Numba drops what is written there to arrays of a tuple.
"""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange
from pyverlet.compile.stealing import claim, none_claimed
from pyverlet.kernels.bounds import AT_WALL, CARRIED, CARRIES
from pyverlet.kernels.contact import mark_strip, push_strip, refine_strip, relax_strip
from pyverlet.kernels.kinds import BOUNCES, RUBS, for_each_kind
from pyverlet.kernels.motion import arrive, set_out

_ONE = np.uint64(1)

# Particles one thread takes at a time where each is on its own.
_CHUNK = 1024

# Deep packs that are too few to be worth a meeting of the threads.
_FEW = 64


@kernel
def _clear(numbers, a, b):
    """numbers[a:b] = 0."""
    for i in range(a, b):
        numbers[i] = 0


def _move(position, velocity, origin, moved, slid, feed):
    """Pushes become places, and velocities, which `moved` then holds."""
    x, v, start, way = position.reshape(-1), velocity.reshape(-1), origin.reshape(-1), moved.reshape(-1)
    for k in range(x.shape[0]):
        gone = way[k] - (x[k] - start[k])
        if RUBS:
            gone = gone + slid[k]
        x[k] += gone
        gone = feed * gone
        v[k] += gone
        way[k] = gone


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
def _turn(spin, turned, turn, h, feed):
    """turn = by how much each turns in this substep."""
    for k in range(spin.shape[0]):
        turn[k] = h * spin[k] + turned[k]
        spin[k] += feed * turned[k]


def _settle(a, b, circles, law):
    """Of the circles from a up to b: where pushes have put them, and who carries weight."""
    slid = circles.slid.reshape(-1)[2 * a : 2 * b]
    _move(circles.position[a:b], circles.velocity[a:b], circles.origin[a:b], circles.moved[a:b], slid, law.feed)
    _weigh(circles.moved[a:b], law.carried, circles.carries[a:b])
    _remember(circles.carries[a:b], circles.fed[a:b])
    if RUBS:
        _lift(circles.moved[a:b], circles.leans[a:b], circles.lift[a:b])
        _turn(circles.spin[a:b], circles.turned[a:b], circles.turn[a:b], law.h, law.feed)


@kernel
def _refine_some(first, stop, parity, circles, pairs, law):
    """The strips 2 half + parity, half from `first` up to `stop`."""
    for half in range(first, stop):
        if pairs.deeps[2 * half + parity] > 0:
            refine_strip(2 * half + parity, circles, pairs, law)


def _push(circles, pairs, law, cut, looks, sets_out, claims):
    """The first sweep: impacts, and overlaps, and what has been slipped.

    cut: (2, threads + 1), which half s // 2 of the strips s with s % 2 = 0, and 1, each thread begins with. looks: 1 if packs
    that overlap deeply are to be noted. sets_out: 1 if `moved` is yet to be set to position - origin. claims: `compile.stealing`.
    """
    n = circles.position.shape[0]
    chunks = (n + _CHUNK - 1) // _CHUNK
    if sets_out != 0 or RUBS:
        for c in prange(chunks):
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            if sets_out != 0:
                set_out(circles.position[a:b], circles.origin[a:b], circles.moved[a:b])
            if RUBS:
                _clear(circles.turned, a, b)
                _clear(circles.slid.reshape(-1), 2 * a, 2 * b)
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
            _refine_some(0, cut[parity, -1], parity, circles, pairs, law)
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
            a, b = c * _CHUNK, min((c + 1) * _CHUNK, n)
            set_out(circles.position[a:b], circles.start[a:b], circles.moved[a:b])
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
