"""Memory for large arrays, in huge pages where available.

A processor caches the addresses of about a thousand pages, and has to look up others. A world of a million circles has 70,000
pages of 4 kB, which made frames a fourth slower than pages of 2 MB. NumPy requests those, but gets them only for memory that was
not written before.
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

_HUGE = 1 << 21  # bytes of a huge page
_FEW = 32  # number of removed rows up to which gaps are closed one by one
_FEWEST = 8  # number of rows up to which rows are searched one by one
_SPARE = 8  # spare capacity when rows are added, one in so many, so that they rarely have to be moved

_blocks: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()


def empty(shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
    """np.empty in huge pages."""
    dtype = np.dtype(dtype)
    count = shape if isinstance(shape, int) else math.prod(shape)
    size = count * dtype.itemsize
    if size < _HUGE or sys.platform != "linux":
        return np.empty(shape, dtype)
    try:
        block = mmap.mmap(-1, size + _HUGE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        # A remainder of less than half a huge page uses small ones.
        begin = -np.frombuffer(block, np.uint8).ctypes.data % _HUGE
        block.madvise(mmap.MADV_HUGEPAGE, begin, (size + _HUGE // 2) // _HUGE * _HUGE)
    except OSError:  # no such memory or pages
        return np.empty(shape, dtype)
    _blocks.add(block)
    return np.ndarray(shape, dtype, block, begin)


def zeros(shape: int | tuple[int, ...], dtype: DTypeLike) -> Array:
    """np.zeros in huge pages: unwritten parts take no memory."""
    array = empty(shape, dtype)
    if array.base is None:  # otherwise the system provides zeroed memory
        array.fill(0)
    return array


def put(rows: Array, value: Any) -> None:
    """rows[:] = value, without writing zeros over zeros in large arrays, so that they take no memory."""
    zeros = rows.nbytes >= _HUGE and not np.any(value) and not (rows.dtype.kind == "f" and np.signbit(value).any())
    if not zeros or rows.view(np.uint32).any():
        rows[:] = value


def taken(array: Array, index: Array) -> Array:
    """array[index], by rows."""
    return take(array, index, empty((len(index), *array.shape[1:]), array.dtype))


def take(array: Array, index: Array, out: Array) -> Array:
    """array[index], by rows, into `out`; indices beyond the last row give the last one, as for a single common row."""
    return np.take(array, index, axis=0, out=out, mode="clip")  # the default mode would make a copy first


def resized(known: Array, count: int) -> Array:
    """Resize to `count` rows, keeping those of `known`: in place if its buffer has room, else in one with spare room.

    known: a previous result, or an array that is not part of another one.
    """
    base = known.base
    if not isinstance(base, np.ndarray) or (base.dtype, base.shape[1:]) != (known.dtype, known.shape[1:]):
        base = known
    if len(base) < count:
        base = empty((count + (count // _SPARE if len(known) else 0), *known.shape[1:]), known.dtype)
        base[: len(known)] = known
    return base[:count]


def extended(known: Array, fresh: Array) -> Array:
    """`resized` with rows appended."""
    rows = resized(known, len(known) + len(fresh))
    rows[len(known) :] = fresh
    return rows


def places(gone: Array, count: int, dtype: DTypeLike = np.int64) -> Array:
    """(count,) new positions of rows after those in `gone`, ascending, are removed; -1 for these."""
    if len(gone) <= _FEW:  # run by run, as below
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
    """(where, left): positions in `index` (n,) of removed rows, ascending, and the other entries, renumbered."""
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
    """Move the rows that are not in `gone`, ascending, to the front of (n, ...), in order; returns their number.

    The contents behind them are undefined.
    """
    count, width = len(array), math.prod(array.shape[1:])
    if len(gone) <= _FEW and array.flags.c_contiguous:  # run by run, without an index array or a copy
        flat = array.reshape(-1)
        for k, (a, b) in enumerate(itertools.pairwise([*gone.tolist(), count])):
            flat[(a - k) * width : (b - k - 1) * width] = flat[(a + 1) * width : b * width]
    else:
        array[: count - len(gone)] = np.delete(array, gone, axis=0)
    return count - len(gone)


def moved(array: Array, gone: Array, source: Array | None, count: int, blank: float) -> Array:
    """`count` rows, row k being the previous row source[k], or `blank` if that is -1; in the memory of `array`, as for `resized`.

    source: (count,); None: rows in `gone`, ascending, are removed, and blank ones are appended.
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
    """Bytes of all living arrays here, which `tracemalloc` does not see."""
    return sum(len(block) - _HUGE for block in _blocks)
