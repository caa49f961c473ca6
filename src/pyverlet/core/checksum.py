# mypy: ignore-errors
"""A number that says whether arrays are still what they were, at the speed of reading them."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_indices, const_words, words
from cython.cimports.libc.stdint import int64_t, uint32_t, uint64_t

BLOCK = cython.declare(cython.Py_ssize_t, 1 << 13)  # words that are summed by themselves

# Odd, with ones and zeros in no order: the fractional part of the golden ratio, and that of the root of 3.
MANY = cython.declare(uint64_t, 0x9E3779B97F4A7C15)
OTHER = cython.declare(uint64_t, 0xBB67AE8584CAA73B)


@cython.cfunc
@cython.inline
@cython.nogil
@cython.exceptval(check=False)
def mix(value: uint64_t, word: uint64_t) -> uint64_t:
    """Take in a word. Each step can be undone: one word that differs always tells; of many, but one in 2^64 cases does not."""
    value = (value ^ word) * MANY
    return value ^ (value >> 29)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def begin_sums(sums: cython.pointer[uint64_t]) -> cython.void:
    """Set each of the sums (64,) to a number of its own."""
    lane: cython.Py_ssize_t
    for lane in range(64):
        sums[lane] = cython.cast(uint64_t, lane) * OTHER


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def total_of(sums: cython.pointer[uint64_t], result: uint64_t) -> uint64_t:
    """All sums in one."""
    lane: cython.Py_ssize_t
    for lane in range(64):
        result = mix(result, sums[lane])
    return result


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def checksum64(
    array: cython.pointer[cython.const[uint64_t]], first: int64_t, stop: int64_t, sums: cython.pointer[uint64_t]
) -> uint64_t:
    """The checksum of words from `first` up to `stop`, 64 at a time into `sums` (64,) of anything: so the loop is vectorised."""
    begin_sums(sums)
    whole: int64_t = stop - (stop - first) % 64
    k: int64_t
    lane: int64_t
    for k in range(first, whole, 64):
        for lane in range(64):
            sums[lane] = mix(sums[lane], array[k + lane])
    result: uint64_t = cython.cast(uint64_t, stop)
    for k in range(whole, stop):
        result = mix(result, array[k])
    return total_of(sums, result)


@cython.cfunc
@cython.nogil
@cython.exceptval(check=False)
def checksum32(
    array: cython.pointer[cython.const[uint32_t]], first: int64_t, stop: int64_t, sums: cython.pointer[uint64_t]
) -> uint64_t:
    """The same of words of 32 bits."""
    begin_sums(sums)
    whole: int64_t = stop - (stop - first) % 64
    k: int64_t
    lane: int64_t
    for k in range(first, whole, 64):
        for lane in range(64):
            sums[lane] = mix(sums[lane], array[k + lane])
    result: uint64_t = cython.cast(uint64_t, stop)
    for k in range(whole, stop):
        result = mix(result, array[k])
    return total_of(sums, result)


def checksum(array):
    """64 bits that depend on all of `array` (n,), uint32 or uint64, and on where each stands."""
    short: cython.bint = array.itemsize == 4
    of32: cython.pointer[cython.const[uint32_t]] = const_indices(array) if short else cython.NULL
    of64: cython.pointer[cython.const[uint64_t]] = cython.NULL if short else const_words(array)
    count: int64_t = len(array)
    blocks: int64_t = (count + BLOCK - 1) // BLOCK
    scratch, sums_of_blocks = np.empty(64, np.uint64), np.empty(blocks, np.uint64)
    sums: cython.pointer[uint64_t] = words(scratch)
    part: cython.pointer[uint64_t] = words(sums_of_blocks)
    block: int64_t
    result: uint64_t
    with cython.nogil:
        for block in range(blocks):
            stop: int64_t = min((block + 1) * BLOCK, count)
            if short:
                part[block] = checksum32(of32, block * BLOCK, stop, sums)
            else:
                part[block] = checksum64(of64, block * BLOCK, stop, sums)
        result = checksum64(part, 0, blocks, sums)
    return result
