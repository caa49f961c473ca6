# mypy: ignore-errors
"""A checksum to detect changes of arrays, at the speed of reading them."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_indices, const_octets, const_words, words
from cython.cimports.libc.stdint import int64_t, uint8_t, uint32_t, uint64_t

from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.sharing import by_team

# Odd multipliers with irregular bits: the fractional parts of the golden ratio and of the root of 3.
MANY = cython.declare(uint64_t, 0x9E3779B97F4A7C15)
OTHER = cython.declare(uint64_t, 0xBB67AE8584CAA73B)


@inlined
def mix(value: uint64_t, word: uint64_t) -> uint64_t:
    """Mix in a word. Each step is invertible: a single changed word is always found; several are missed in one of 2^64 cases."""
    value = (value ^ word) * MANY
    return value ^ (value >> 29)


@kernel
def begin_sums(sums: cython.pointer[uint64_t]) -> cython.void:
    """Initialise the sums (64,) with different numbers."""
    lane: cython.Py_ssize_t
    for lane in range(64):
        sums[lane] = cython.cast(uint64_t, lane) * OTHER


@kernel
def total_of(sums: cython.pointer[uint64_t], result: uint64_t) -> uint64_t:
    """Combine all sums."""
    lane: cython.Py_ssize_t
    for lane in range(64):
        result = mix(result, sums[lane])
    return result


@kernel
def checksum64(
    array: cython.pointer[cython.const[uint64_t]], first: int64_t, stop: int64_t, sums: cython.pointer[uint64_t]
) -> uint64_t:
    """The checksum of words from `first` up to `stop`, 64 at a time into the scratch `sums` (64,), which allows vectorisation."""
    begin_sums(sums)
    whole: int64_t = stop - (stop - first) % 64
    lane: int64_t
    for k in range(first, whole, 64):
        for lane in range(64):
            sums[lane] = mix(sums[lane], array[k + lane])
    result: uint64_t = cython.cast(uint64_t, stop)
    for k in range(whole, stop):
        result = mix(result, array[k])
    return total_of(sums, result)


@kernel
def checksum32(
    array: cython.pointer[cython.const[uint32_t]], first: int64_t, stop: int64_t, sums: cython.pointer[uint64_t]
) -> uint64_t:
    """As `checksum64`, for words of 32 bits."""
    begin_sums(sums)
    whole: int64_t = stop - (stop - first) % 64
    lane: int64_t
    for k in range(first, whole, 64):
        for lane in range(64):
            sums[lane] = mix(sums[lane], array[k + lane])
    result: uint64_t = cython.cast(uint64_t, stop)
    for k in range(whole, stop):
        result = mix(result, array[k])
    return total_of(sums, result)


Words = cython.struct(
    count=int64_t,
    block=int64_t,  # words per block
    short=cython.bint,
    of32=cython.pointer[cython.const[uint32_t]],
    of64=cython.pointer[cython.const[uint64_t]],
    sums=cython.pointer[uint64_t],
    chosen=cython.bint,
    written=cython.pointer[cython.const[uint8_t]],
)


@kernel
def checksum_stage(what: cython.p_void, block: cython.int) -> cython.void:
    """Checksum of one block."""
    w: cython.pointer(Words) = cython.cast(cython.pointer(Words), what)
    if w.chosen and not w.written[block]:
        return
    sums: uint64_t[64]
    first: int64_t = block * w.block
    stop: int64_t = min(first + w.block, w.count)
    w.sums[block] = checksum32(w.of32, first, stop, sums) if w.short else checksum64(w.of64, first, stop, sums)


def checksums(array, block: cython.int, sums, written, threads: cython.size_t, parts: cython.int):
    """Write sums[b], 64 bits that depend on all words of block b of `array` (n,), uint32 or uint64, and on their order.

    block: words per block. written: (blocks,) which blocks to check, or empty: all. threads, parts: address of a thread team, or
    0, and the number of its threads to use.
    """
    own: Words
    w: cython.pointer(Words) = cython.address(own)
    w.short = array.itemsize == 4
    w.of32 = const_indices(array) if w.short else cython.NULL
    w.of64 = cython.NULL if w.short else const_words(array)
    w.count, w.block, w.sums = len(array), block, words(sums)
    w.chosen, w.written = len(written) > 0, const_octets(written)
    with cython.nogil:
        by_team(threads, parts, checksum_stage, w, cython.cast(cython.int, (w.count + w.block - 1) // w.block))
