# mypy: ignore-errors
"""A number that says whether arrays are still what they were, at the speed of reading them."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_words
from cython.cimports.libc.stdint import uint64_t

# Odd, with ones and zeros in no order: the fractional part of the golden ratio, and that of the root of 3.
MANY = cython.declare(uint64_t, 0x9E3779B97F4A7C15)
OTHER = cython.declare(uint64_t, 0xBB67AE8584CAA73B)


def digest(array):
    """Of an array of uint64."""
    w: cython.pointer[cython.const[uint64_t]] = const_words(array)
    k: cython.Py_ssize_t
    r: uint64_t = 0
    for k in range(len(array)):
        r = (r ^ w[k]) * MANY
        r ^= r >> 29
    return r
