"""Who does what of a loop over threads: each thread its own share, and who is done before the others helps them.

Shares fixed beforehand have all wait for the slowest core, and cores are not alike: one is shared with another program, or has
another virtual machine on its other half, or is one of the small ones of a laptop. Here a thread claims one piece at a time: of
its own share from the front, so that it finds in its caches what it had there before; then of another's from the back. That is
affinity scheduling (Markatos and LeBlanc, Using Processor Affinity in Loop Scheduling on Shared-Memory Multiprocessors, 1994).

The counts are atomic, the results do not depend on them: every element has one writer in a loop, whoever that is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

from pyverlet.compile.jit import kernel, threads_in_use

_CLAIMED, _FROM_FRONT, _FROM_BACK = range(3)

_LINE = 8
"""Words of 8 bytes from the counts of one share to those of the next: neighbours in one cache line would slow each other."""


@intrinsic  # type: ignore[untyped-decorator]
def _count(typing: Any, counts: Any, row: Any, column: Any) -> Any:
    """counts[row, column]++, an (n, m) array of int64, by one thread at a time; what it was before."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        made = context.make_array(counts)(context, builder, args[0])
        where = cgutils.get_item_pointer(context, builder, counts, made, list(args[1:]))
        return builder.atomic_rmw("add", where, ir.Constant(ir.IntType(64), 1), "monotonic")

    return types.int64(counts, row, column), generate


class Claims:
    """What kernels called by one thread count claims in: called, an array with a row for each thread in use now."""

    def __init__(self) -> None:
        self._counts = np.zeros((1, _LINE), np.int64)

    def __call__(self) -> NDArray[np.int64]:
        if len(self._counts) != (threads := threads_in_use()):
            self._counts = np.zeros((threads, _LINE), np.int64)
        return self._counts


@kernel
def none_claimed(claims: Any) -> None:
    """A loop begins."""
    for part in range(claims.shape[0]):
        for k in range(3):
            claims[part, k] = 0


@kernel
def _claim(claims: Any, whose: Any, size: Any, own: Any) -> Any:
    """Which of the `size` pieces of a share comes next, for its own thread from the front, for others from the back; -1: none."""
    if claims.shape[0] == 1:
        k = claims[whose, _FROM_FRONT]
        claims[whose, _FROM_FRONT] = k + 1
        return k if k < size else -1
    if _count(claims, whose, _CLAIMED) >= size:
        return -1
    return _count(claims, whose, _FROM_FRONT) if own else size - 1 - _count(claims, whose, _FROM_BACK)


@kernel
def claim(claims: Any, cut: Any, part: Any) -> Any:
    """The piece that thread `part` does next, of its own share from cut[part] up to cut[part + 1] or of another's; -1: none."""
    parts = claims.shape[0]
    for k in range(parts):
        whose = part + k if part + k < parts else part + k - parts
        piece = _claim(claims, whose, cut[whose + 1] - cut[whose], k == 0)
        if piece >= 0:
            return cut[whose] + piece
    return -1


@kernel
def claim_evenly(claims: Any, pieces: Any, part: Any) -> Any:
    """`claim`, where shares are of as nearly the same number of pieces as can be."""
    parts = claims.shape[0]
    for k in range(parts):
        whose = part + k if part + k < parts else part + k - parts
        first = pieces * whose // parts
        piece = _claim(claims, whose, pieces * (whose + 1) // parts - first, k == 0)
        if piece >= 0:
            return first + piece
    return -1
