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

# Particles one thread takes at a time where each is on its own.
_CHUNK = 1024

# Deep packs that are too few to be worth a meeting of the threads.
_FEW = 64


@kernel
def _clear(numbers, a, b):
    """numbers[a:b] = 0."""
    for i in range(a, b):
        numbers[i] = 0


def _settle(a, b, circles, law):
    """Of the circles from a up to b: pushes become places, and velocities; who has been fed so much carries weight."""
    zero, one = law.h - law.h, law.h / law.h
    limit = law.carried * law.carried
    for i in range(a, b):
        x = circles.moved[i, 0] - (circles.position[i, 0] - circles.origin[i, 0])
        y = circles.moved[i, 1] - (circles.position[i, 1] - circles.origin[i, 1])
        if RUBS:
            x, y = x + circles.slid[i, 0], y + circles.slid[i, 1]
        circles.position[i, 0] += x
        circles.position[i, 1] += y
        x, y = law.feed * x, law.feed * y
        circles.velocity[i, 0] += x
        circles.velocity[i, 1] += y
        square = x * x + y * y
        circles.carries[i] = one if square > limit else zero
        if RUBS:  # who rests against others, however lightly, ends the substep as they do
            circles.lift[i] = circles.leans[i] if square > zero else zero
    for i in range(a, b):
        circles.fed[i] = ((circles.fed[i] & (CARRIES | AT_WALL)) * CARRIED) | np.uint8(circles.carries[i])
    if RUBS:
        for i in range(a, b):
            circles.turn[i] = law.h * circles.spin[i] + circles.turned[i]
            circles.spin[i] += law.feed * circles.turned[i]


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


settle = for_each_kind(kernel, _settle)
push = for_each_kind(parallel_kernel, _push, push_strip=push_strip, settle=settle)
relax = for_each_kind(parallel_kernel, _relax, relax_strip=relax_strip)
