# mypy: ignore-errors
"""Draws antialiased straight lines with round ends on pixels; the alpha channel stays unchanged."""

from __future__ import annotations

import cython
from cython.cimports.arrays import const_indices, const_reals, indices
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, ceil, fabs, floor, hypot, sqrt
from cython.cimports.libc.stdint import int64_t, uint32_t

from pyverlet.core.kernels import kernel
from pyverlet.core.pixel_blending import mixed


@kernel
def draw_line(
    pixels: cython.pointer[uint32_t], height: int64_t, width: int64_t, x0: cython.double, y0: cython.double,
    x1: cython.double, y1: cython.double, half: cython.double, colour: uint32_t,
) -> cython.void:  # fmt: skip
    """Draw a line `2 half` wide from (x0, y0) to (x1, y1) in pixels, y down."""
    reach: cython.double = half + 0.5
    if not (max(x0, x1) + reach > 0.0 and min(x0, x1) - reach < width):
        return  # outside, or NaN
    if not (max(y0, y1) + reach > 0.0 and min(y0, y1) - reach < height):
        return
    dx: cython.double = x1 - x0
    dy: cython.double = y1 - y0
    length2: cython.double = max(dx * dx + dy * dy, 1e-12)
    first: int64_t = cython.cast(int64_t, max(floor(min(y0, y1) - reach), 0.0))
    last: int64_t = cython.cast(int64_t, min(ceil(max(y0, y1) + reach), cython.cast(cython.double, height)))
    # Half width of the line's band along a row; infinite for a horizontal line.
    wide: cython.double = reach * sqrt(length2) / fabs(dy) if dy != 0.0 else INFINITY
    for row in range(first, last):
        py: cython.double = row + 0.5 - y0
        low: cython.double = min(x0, x1) - reach
        high: cython.double = max(x0, x1) + reach
        if wide < INFINITY:
            middle: cython.double = x0 + dx * py / dy
            slant: cython.double = 0.5 * fabs(dx / dy)
            low = max(low, middle - wide - slant - 1.0)
            high = min(high, middle + wide + slant + 1.0)
        begin: int64_t = cython.cast(int64_t, max(floor(low), 0.0))
        end: int64_t = cython.cast(int64_t, min(ceil(high), cython.cast(cython.double, width)))
        for column in range(begin, end):
            px: cython.double = column + 0.5 - x0
            along: cython.double = min(max((px * dx + py * dy) / length2, 0.0), 1.0)
            cover: cython.double = min(max(reach - hypot(px - along * dx, py - along * dy), 0.0), 1.0)
            if cover > 0.0:
                pixels[row * width + column] = mixed(pixels[row * width + column], colour, cover)


def draw_lines(pixels, ends, colour, left: cython.double, top: cython.double, scale: cython.double, half: cython.double):
    """Draw lines `2 half` pixels wide on `pixels`, (h, w) uint32, in the order given.

    `ends` (m, 2, 2): metres. `colour`: (m,) uint32. `left`, `top`: metres at the upper left corner; `scale`: pixels per metre.
    """
    p: cython.pointer[uint32_t] = indices(pixels)
    e: cython.pointer[cython.const[real]] = const_reals(ends)
    c: cython.pointer[cython.const[uint32_t]] = const_indices(colour)
    height: int64_t = pixels.shape[0]
    width: int64_t = pixels.shape[1]
    count: int64_t = len(ends)
    with cython.nogil:
        for k in range(count):
            x0: cython.double = (e[4 * k] - left) * scale
            y0: cython.double = (top - e[4 * k + 1]) * scale
            x1: cython.double = (e[4 * k + 2] - left) * scale
            y1: cython.double = (top - e[4 * k + 3]) * scale
            draw_line(p, height, width, x0, y0, x1, y1, half, c[k])
