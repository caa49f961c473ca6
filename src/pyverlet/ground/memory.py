"""Memory for large arrays, in huge pages where the system has them.

A processor remembers where some thousand pages of memory are, and has to look up each of the others. A world of a million circles
lies in 70,000 pages of 4 kB, and a frame was a fourth slower for it than in pages of 2 MB. NumPy asks for those, but gets them
only for memory that was not written before.
"""

import itertools
import math
import mmap
import sys
import weakref
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from pyverlet.ground.arrays import Array

_HUGE = 1 << 21  # bytes of a huge page, where there are any
_FEW = 32  # rows whose places are closed one by one
_SPARE = 8  # one row for so many is left for others: rows that come one by one are moved seldom

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
    return np.ndarray(shape, dtype, block, begin)


def zeros(shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
    """As np.zeros: large ones take no memory where nothing has been written."""
    array = empty(shape, dtype)
    if array.base is None:  # else the system gives memory that is 0
        array.fill(0)
    return array


def put(rows: Array, value: Any) -> None:
    """rows[:] = value, but that large ones of zeros are not written where zeros are: until then they take no memory."""
    zeros = rows.nbytes >= _HUGE and not np.any(value) and not (rows.dtype.kind == "f" and np.signbit(value).any())
    if not zeros or rows.view(np.uint32).any():
        rows[:] = value


def taken(array: Array, index: Array) -> Array:
    """As array[index], of rows."""
    return take(array, index, empty((len(index), *array.shape[1:]), array.dtype))


def take(array: Array, index: Array, out: Array) -> Array:
    """array[index], of rows, in `out`; an index beyond the last row is the last: of one row, that is all there is."""
    return np.take(array, index, axis=0, out=out, mode="clip")  # by default it would make another array first


def resized(known: Array, count: int) -> Array:
    """`count` rows, first those of `known`: in the array that it is the front of, where that has room, else in one that has more.

    known: what this has returned, or an array that is no part of another one.
    """
    room = known.base
    if not isinstance(room, np.ndarray) or (room.dtype, room.shape[1:]) != (known.dtype, known.shape[1:]):
        room = known
    if len(room) < count:
        room = empty((count + count // _SPARE, *known.shape[1:]), known.dtype)
        room[: len(known)] = known
    return room[:count]


def extended(known: Array, fresh: Array) -> Array:
    """`resized` rows with others behind them."""
    rows = resized(known, len(known) + len(fresh))
    rows[len(known) :] = fresh
    return rows


def places(kept: Array) -> Array:
    """(n,) to where the rows marked in `kept` (n,) bool go as they close ranks, -1 of others."""
    gone, place = np.flatnonzero(~kept), np.arange(len(kept), dtype=np.int32)
    if len(gone) <= _FEW:  # in runs, as below
        for row in gone[::-1].tolist():
            place[row:] -= 1
    else:
        np.subtract(np.cumsum(kept, dtype=np.int32), 1, out=place)
    place[gone] = -1
    return place


def close_ranks(array: Array, kept: Array) -> int:
    """Move the rows marked in `kept` (n,) bool to the front of (n, ...), in their order; returns how many they are.

    What is behind them is left over.
    """
    gone = np.flatnonzero(~kept)
    left = len(kept) - len(gone)
    if len(gone) <= _FEW:  # in runs, without an index for each
        for k, (a, b) in enumerate(itertools.pairwise([*gone.tolist(), len(kept)])):
            array[a - k : b - k - 1] = array[a + 1 : b]
    else:
        array[:left] = taken(array, np.flatnonzero(kept))
    return left


def moved(array: Array, kept: Array, source: Array | None, count: int, blank: float) -> Array:
    """`count` rows, row k being row source[k] of before, or `blank` if that is -1: in the memory of `array`, as for `resized`.

    source: (count,); None: the rows marked in `kept` (n,) bool close ranks, and blank ones come behind them.
    """
    fresh: Any
    if source is None:
        fresh, rows = slice(close_ranks(array, kept), count), resized(array, count)
    else:
        fresh, picked = source < 0, taken(array, source)
        rows = resized(array, count)
        rows[:] = picked
    rows[fresh] = blank
    return rows


def mapped() -> int:
    """Bytes of all arrays here that live, and that `tracemalloc` does not see."""
    return sum(len(block) - _HUGE for block in _blocks)
