# mypy: ignore-errors
"""Exact coverage of pixels by a disc.

A disc is cut into rows of pixels (the row of the centre into two bands) and each band into pixels: the area under the arc in a
pixel is a trapezoid plus the sliver between the arc and its chord.
"""

from __future__ import annotations

import cython
from cython.cimports.libc.math import floor, sqrt
from cython.cimports.libc.stdint import int64_t

from pyverlet.core.kernels import inlined, kernel

# (asin s - s sqrt(1 - s^2)) / s^3 in powers of s^2, by Chebyshev nodes up to s^2 = 1/2 (a quarter circle), accurate to 1e-6.
C0 = cython.declare(cython.double, 0.6666656157247693)
C1 = cython.declare(cython.double, 0.20015044263972848)
C2 = cython.declare(cython.double, 0.1037395118073208)
C3 = cython.declare(cython.double, 0.09668704309959862)
C4 = cython.declare(cython.double, -0.04340219229354717)
C5 = cython.declare(cython.double, 0.16566737326745967)


@inlined
def sliver(chord2: cython.double, quarter: cython.double, r: cython.double) -> cython.double:
    """Area between an arc of at most a quarter circle and its chord of squared length chord2; `quarter` is 1 / (4 r^2).

    It is r^2 (asin s - s sqrt(1 - s^2)) with s = chord / 2r.
    """
    s2: cython.double = chord2 * quarter
    return r * r * s2 * sqrt(s2) * (C0 + s2 * (C1 + s2 * (C2 + s2 * (C3 + s2 * (C4 + s2 * C5)))))


@kernel
def add_arc(
    cover: cython.p_double, at: int64_t, x: cython.double, a: cython.double, end: cython.double,
    ha: cython.double, last: cython.double, low: cython.double, r: cython.double,
) -> cython.void:  # fmt: skip
    """Add to `cover`, by pixel, the area above `low` and under the arc from a to end, with heights ha and last there.

    cover[at + column] is the pixel from that column to the next.
    """
    r2: cython.double = r * r
    quarter: cython.double = 0.25 / r2
    column: int64_t = cython.cast(int64_t, floor(x + a))
    while a < end:
        b: cython.double = column + 1 - x
        hb: cython.double
        if b < end:
            hb = sqrt(r2 - b * b)
        else:
            b = end
            hb = last
        rise: cython.double = hb - ha
        cover[at + column] += (b - a) * (0.5 * (ha + hb) - low) + sliver((b - a) * (b - a) + rise * rise, quarter, r)
        a = b
        ha = hb
        column += 1


@kernel
def add_band(
    cover: cython.p_double, at: int64_t, x: cython.double, low: cython.double, high: cython.double, r: cython.double
) -> cython.void:
    """Add to `cover`, by pixel, the disc's area in low <= v <= high, 0 <= low < high <= r; centre at x."""
    r2: cython.double = r * r
    wide: cython.double = sqrt(r2 - low * low)
    core: cython.double = sqrt(r2 - high * high)
    add_arc(cover, at, x, -wide, -core, low, high, low, r)
    add_arc(cover, at, x, core, wide, high, low, low, r)
    start: cython.double = x - core  # from there to stop the band is fully covered
    stop: cython.double = x + core
    left: int64_t = cython.cast(int64_t, floor(start))
    right: int64_t = cython.cast(int64_t, floor(stop))
    if left == right:
        cover[at + left] += (high - low) * (stop - start)
    else:
        cover[at + left] += (high - low) * (left + 1 - start)
        for column in range(left + 1, right):
            cover[at + column] += high - low
        cover[at + right] += (high - low) * (stop - right)


@kernel
def cover_row(
    cover: cython.p_double, begin: int64_t, x: cython.double, y: cython.double, r: cython.double, row: int64_t
) -> cython.void:
    """Add the coverage of a row of pixels by a disc, from cover[begin] on, which is column floor(x - r)."""
    at: int64_t = begin - cython.cast(int64_t, floor(x - r))
    above: cython.double = y - row  # from the centre up to the top of the row
    below: cython.double = row + 1 - y  # from the centre down to its foot
    if above > 0.0 and below > 0.0:  # the row of the centre has a band of either half
        add_band(cover, at, x, 0.0, min(above, r), r)
        add_band(cover, at, x, 0.0, min(below, r), r)
    else:
        add_band(cover, at, x, max(-above, -below), min(max(above, below), r), r)
