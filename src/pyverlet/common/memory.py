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

from pyverlet.common.arrays import Array

_HUGE = 1 << 21  # bytes of a huge page, where there are any
_FEW = 32  # rows whose places are closed one by one
_FEWEST = 8  # rows that are looked for one by one
_SPARE = 8  # where rows come to others, one for so many is left for more: rows that come one by one are moved seldom

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
    base = known.base
    if not isinstance(base, np.ndarray) or (base.dtype, base.shape[1:]) != (known.dtype, known.shape[1:]):
        base = known
    if len(base) < count:
        base = empty((count + (count // _SPARE if len(known) else 0), *known.shape[1:]), known.dtype)
        base[: len(known)] = known
    return base[:count]


def extended(known: Array, fresh: Array) -> Array:
    """`resized` rows with others behind them."""
    rows = resized(known, len(known) + len(fresh))
    rows[len(known) :] = fresh
    return rows


def places(gone: Array, count: int, dtype: DTypeLike = np.int64) -> Array:
    """(count,) to where rows go as they close ranks, -1 of those that are gone, ascending."""
    if len(gone) <= _FEW:  # in runs, as below
        place = np.arange(count, dtype=dtype)
        for row in gone[::-1].tolist():
            place[row:] -= 1
    else:
        kept = np.ones(count, bool)
        kept[gone] = False
        place = np.cumsum(kept, dtype=dtype) - 1
    place[gone] = -1
    return place


def without(index: Array, gone: Array) -> tuple[Array, Array]:
    """(where, left): where (n,) `index` names rows that are gone, ascending, and all others, as these close ranks."""
    if len(gone) <= _FEWEST:
        where = np.sort(np.concatenate([np.flatnonzero(index == row) for row in gone.tolist()] or [gone]))
        left = index.copy()
        left = left[: close_ranks(left, where)]
        for row in gone[::-1].tolist():
            left -= left > row
        return where, left
    count = int(index.max(initial=-1)) + 1
    now = taken(places(gone[gone < count], count, index.dtype), index)
    return np.flatnonzero(now < 0), now[now >= 0]


def close_ranks(array: Array, gone: Array) -> int:
    """Move the rows that are not gone, ascending, to the front of (n, ...), in their order; returns how many they are.

    What is behind them is left over.
    """
    count, width = len(array), math.prod(array.shape[1:])
    if len(gone) <= _FEW and array.flags.c_contiguous:  # in runs, without an index for each, nor a copy, as rows would take
        flat = array.reshape(-1)
        for k, (a, b) in enumerate(itertools.pairwise([*gone.tolist(), count])):
            flat[(a - k) * width : (b - k - 1) * width] = flat[(a + 1) * width : b * width]
    else:
        array[: count - len(gone)] = np.delete(array, gone, axis=0)
    return count - len(gone)


def moved(array: Array, gone: Array, source: Array | None, count: int, blank: float) -> Array:
    """`count` rows, row k being row source[k] of before, or `blank` if that is -1: in the memory of `array`, as for `resized`.

    source: (count,); None: the rows that are not gone, ascending, close ranks, and blank ones come behind them.
    """
    fresh: Any
    if source is None:
        fresh, rows = slice(close_ranks(array, gone), count), resized(array, count)
    else:
        fresh, picked = source < 0, taken(array, source)
        rows = resized(array, count)
        rows[:] = picked
    rows[fresh] = blank
    return rows


def mapped() -> int:
    """Bytes of all arrays here that live, and that `tracemalloc` does not see."""
    return sum(len(block) - _HUGE for block in _blocks)
