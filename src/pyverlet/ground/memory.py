"""Memory for large arrays, in huge pages where the system has them.

A processor remembers where some thousand pages of memory are, and has to look up each of the others. A world of a million circles
lies in 70,000 pages of 4 kB, and a frame was a fourth slower for it than in pages of 2 MB. NumPy asks for those, but gets them
only for memory that was not written before.
"""

from __future__ import annotations

import itertools
import math
import mmap
import sys
import weakref

import numpy as np
from numpy.typing import DTypeLike

from pyverlet.ground.arrays import Array

_HUGE = 1 << 21  # bytes of a huge page, where there are any
_FEW = 32  # rows whose places are closed one by one

_blocks: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()


def empty(shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
    """As np.empty."""
    dtype = np.dtype(dtype)
    count = shape if isinstance(shape, int) else math.prod(shape)
    size = count * dtype.itemsize
    if size < _HUGE or sys.platform != "linux":
        return np.empty(shape, dtype)
    try:
        block = mmap.mmap(-1, size + _HUGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        # A part of a page at the end that is less than half of one is left in small ones.
        begin = -np.frombuffer(block, np.uint8).ctypes.data % _HUGE
        block.madvise(mmap.MADV_HUGEPAGE, begin, (size + _HUGE // 2) // _HUGE * _HUGE)
    except OSError:  # no such memory, or no such pages
        return np.empty(shape, dtype)
    _blocks.add(block)
    return np.frombuffer(block, dtype, count, begin).reshape(shape)


def zeros(shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
    """As np.zeros."""
    array = empty(shape, dtype)
    array.fill(0)
    return array


def taken(array: Array, index: Array) -> Array:
    """As array[index], of rows."""
    return take(array, index, empty((len(index), *array.shape[1:]), array.dtype))


def take(array: Array, index: Array, out: Array) -> Array:
    """array[index], of rows, in `out`; an index beyond the last row is the last: of one row, that is all there is."""
    return np.take(array, index, axis=0, out=out, mode="clip")  # by default it would make another array first


def extended(known: Array, fresh: Array) -> Array:
    """Rows with others behind them: in the array that `known` is the front of, where that has room, else in one that has more.

    known: what this has returned, or an array that is no part of another one.
    """
    count, room = len(known) + len(fresh), known if known.base is None else known.base
    if len(room) < count:
        room = np.empty((2 * count, *known.shape[1:]), known.dtype)
        room[: len(known)] = known
    room[len(known) : count] = fresh
    return room[:count]


def close_ranks(array: Array, kept: Array) -> None:
    """Move the rows marked in `kept` (n,) bool to the front of (n, ...), in their order; what is behind them is left over."""
    gone = np.flatnonzero(~kept)
    if len(gone) <= _FEW:  # in runs, without an index for each
        for k, (a, b) in enumerate(itertools.pairwise([*gone.tolist(), len(kept)])):
            array[a - k : b - k - 1] = array[a + 1 : b]
    else:
        array[: len(kept) - len(gone)] = taken(array, np.flatnonzero(kept))


def mapped() -> int:
    """Bytes of all arrays here that live, and that `tracemalloc` does not see."""
    return sum(len(block) - _HUGE for block in _blocks)
