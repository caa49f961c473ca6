# mypy: ignore-errors
"""Draws small discs from a cache of pixel coverages, computed once for each size and subpixel position.

An entry begins with the number of fully covered pixels and of rim pixels. Their offsets from the centre pixel follow, then the
coverage of rim pixels of 255. `where` and `amount` hold all entries.
"""

from __future__ import annotations

import cython
from cython.cimports.libc.math import ceil, floor
from cython.cimports.libc.stdint import int32_t, int64_t, uint8_t, uint32_t

from pyverlet.core.disc_coverage import cover_row
from pyverlet.core.kernels import kernel
from pyverlet.core.pixel_blending import blend, over_full

CROWD = cython.declare(cython.Py_ssize_t, 1024)  # small discs from which caching pays: entries cost as much to make
CACHED = cython.declare(cython.double, 8.0)  # largest cached radius, pixels
FINE = cython.declare(cython.Py_ssize_t, 16)  # subpixel positions per axis
SIZES = cython.declare(cython.double, 128.0)  # sizes per factor e: each is within a hundredth of the true one
CAPACITY = cython.declare(cython.Py_ssize_t, 1 << 20)  # pixels of all entries; discs that do not fit are drawn directly
SPARE = cython.declare(cython.Py_ssize_t, 19)  # rows and columns of the largest entry, 2 CACHED + 3


@kernel
def cache_disc(
    where: cython.pointer[int32_t], amount: cython.pointer[uint8_t], at: int64_t, width: int64_t,
    x: cython.double, y: cython.double, r: cython.double, cover: cython.p_double,
) -> int64_t:  # fmt: skip
    """Write an entry from `at` on, for a centre (x, y) within its pixel; returns where the next may begin.

    width: of the picture. cover: (SPARE SPARE,) scratch memory.
    """
    left: int64_t = cython.cast(int64_t, floor(x - r))
    top: int64_t = cython.cast(int64_t, floor(y - r))
    columns: int64_t = cython.cast(int64_t, floor(x + r)) + 1 - left
    rows: int64_t = cython.cast(int64_t, ceil(y + r)) - top
    for row in range(rows):
        for column in range(columns):
            cover[row * SPARE + column] = 0.0
        cover_row(cover, row * SPARE, x, y, r, top + row)
    end: int64_t = at + 2
    rim: cython.int
    for rim in range(2):
        begin: int64_t = end
        for row in range(rows):
            for column in range(columns):
                part: int32_t = cython.cast(int32_t, 255.0 * cover[row * SPARE + column] + 0.5)
                if part > 0 and (part < 255) == (rim == 1):
                    where[end] = cython.cast(int32_t, (top + row) * width + left + column)
                    amount[end] = cython.cast(uint8_t, part)
                    end += 1
        where[at + rim] = cython.cast(int32_t, end - begin)
    return end


@kernel
def draw_cached(
    pixels: cython.pointer[uint32_t], background: cython.pointer[cython.const[uint32_t]], colour: uint32_t, centre: int64_t,
    where: cython.pointer[int32_t], amount: cython.pointer[uint8_t], at: int64_t,
) -> cython.void:  # fmt: skip
    """Draw the disc of the entry at `at`, which lies inside the picture; pixels, ground: (h w,); centre: pixel of the centre."""
    rim: int64_t = at + 2 + where[at]
    for k in range(at + 2, rim):
        pixels[centre + where[k]] = colour
    for k in range(rim, rim + where[at + 1]):
        p: int64_t = centre + where[k]
        cover: int32_t = amount[k]
        if pixels[p] >> 24 == 0:
            pixels[p] = (over_full(background[p], colour, cover) & 0xFFFFFF) | (cython.cast(uint32_t, cover) << 24)
        else:
            pixels[p] = blend(pixels[p], background[p], colour, cover)
