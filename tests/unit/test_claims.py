"""Loops whose threads claim what they do: every piece once, of a thread's own share first."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pyverlet.compile import jit
from pyverlet.compile.jit import parallel_kernel, prange
from pyverlet.compile.stealing import Claims, claim, claim_evenly, none_claimed

WORK = 2_000_000


@parallel_kernel
def _do(claims, cut, evenly, work, times, who, order):  # type: ignore[no-untyped-def]
    """Thread `part` does work[part] for each piece; order[part, 0]: how many it has done, then which."""
    none_claimed(claims)
    for part in prange(claims.shape[0]):
        piece = claim_evenly(claims, cut[-1], part) if evenly else claim(claims, cut, part)
        while piece >= 0:
            slow = 0.5
            for _ in range(work[part]):
                slow = slow * (1.0 - slow) * 3.9
            times[piece] += 1 if slow < 2 else 2
            who[piece] = part
            order[part, 0] += 1
            order[part, order[part, 0]] = piece
            piece = claim_evenly(claims, cut[-1], part) if evenly else claim(claims, cut, part)


def do(parts: int, pieces: int, cut: Any = None, work: Any = 0, kernel: Any = _do) -> tuple[Any, list[list[int]]]:
    """Who did each piece, and which each thread did, in its order. Without `cut`: evenly."""
    claims, times, who = np.zeros((parts, 8), np.int64), np.zeros(pieces, np.int64), np.full(pieces, -1)
    order = np.zeros((parts, pieces + 1), np.int64)
    where = np.linspace(0, pieces, parts + 1).astype(np.int64) if cut is None else np.array(cut)
    for _ in range(2):  # what the first has counted is no matter
        times[:] = order[:] = 0
        kernel(claims, where, int(cut is None), np.broadcast_to(work, parts).astype(np.int64), times, who, order)
        assert (times == 1).all()
    return who, [list(row[1 : row[0] + 1]) for row in order]


@pytest.mark.parametrize("pieces", [0, 1, 2, 7, 100])
@pytest.mark.parametrize("parts", [1, 2, 3, 8])
def test_every_piece_is_done_once(parts: int, pieces: int) -> None:
    jit.use_threads(jit.max_threads())
    who, _ = do(parts, pieces)
    assert set(who) <= set(range(parts))
    do(parts, pieces, cut=[0] * parts + [pieces])  # all in the share of the last


def test_a_thread_goes_through_its_own_share_from_the_front_and_helps_others_from_the_back() -> None:
    # On one thread, which makes the loops of the others, too, when its own is done: nothing is left for them.
    _, order = do(3, 9, cut=[0, 4, 6, 9], kernel=_do.alone)
    assert order == [[0, 1, 2, 3, 5, 4, 8, 7, 6], [], []]
    _, order = do(3, 9, kernel=_do.alone)
    assert order == [[0, 1, 2, 5, 4, 3, 8, 7, 6], [], []]


@pytest.mark.skipif(jit.max_threads() < 2, reason="needs two threads")
def test_a_slow_thread_is_helped() -> None:
    # A piece takes the first thread some milliseconds, the second one next to nothing.
    jit.use_threads(2)
    who, order = do(2, 40, cut=[0, 20, 40], work=(WORK, 0))
    assert (who[20:] == 1).all()
    assert (who[:20] == 1).sum() >= 10
    assert order[0] == list(range(len(order[0])))


def test_there_is_a_row_for_each_thread_in_use() -> None:
    claims = Claims()
    for threads in (1, jit.max_threads(), 1):
        jit.use_threads(threads)
        assert claims().shape == (threads, 8)
        assert claims() is claims()
