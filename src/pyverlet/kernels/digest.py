"""A number that says whether arrays are still what they were, at the speed of reading them."""

from __future__ import annotations

import numpy as np

from pyverlet.compile.jit import kernel, parallel_kernel, prange

_LANES = 64
"""Words taken at a time, each into a sum of its own: so the loop is vectorised."""

_BLOCK = 1 << 13
"""Words that one thread takes at a time."""

# Odd, with ones and zeros in no order: the fractional part of the golden ratio, and that of the root of 3.
_MANY = np.uint64(0x9E3779B97F4A7C15)
_OTHER = np.uint64(0xBB67AE8584CAA73B)
_HALF = np.uint64(29)


@kernel
def _mix(value, word):
    # Each step can be undone, so that one word that differs always tells; of many, but one in 2^64 cases does not.
    value = (value ^ word) * _MANY
    return value ^ (value >> _HALF)


@kernel
def _digest_block(words, first, stop):
    lanes = np.empty(_LANES, np.uint64)
    for lane in range(_LANES):
        lanes[lane] = np.uint64(lane) * _OTHER
    packed = stop - (stop - first) % _LANES
    for k in range(first, packed, _LANES):
        begin = np.uint64(k)  # unsigned indices, which cannot count from the end: or the loop is not vectorised
        for lane in range(_LANES):
            i = np.uint64(lane)
            lanes[i] = _mix(lanes[i], np.uint64(words[begin + i]))
    result = np.uint64(stop)
    for k in range(packed, stop):
        result = _mix(result, np.uint64(words[k]))
    for lane in range(_LANES):
        result = _mix(result, lanes[lane])
    return result


@parallel_kernel
def digest(words):
    """64 bits that depend on all `words` (n,), unsigned integers, and on where each stands."""
    blocks = (words.shape[0] + _BLOCK - 1) // _BLOCK
    parts = np.empty(blocks, np.uint64)
    for block in prange(blocks):
        parts[block] = _digest_block(words, block * _BLOCK, min((block + 1) * _BLOCK, words.shape[0]))
    return _digest_block(parts, np.int64(0), blocks)
