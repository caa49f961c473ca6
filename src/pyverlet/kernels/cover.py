"""What part of each pixel a disc covers, to the last digit, and what a pixel becomes that is covered in part.

A pixel is 32 bits, R + G << 8 + B << 16 + A << 24: in memory the bytes R, G, B, A. A tells how much of the pixel circles cover.
A disc is cut into rows of pixels, the centre's own row into two bands, and each band into pixels: what a pixel has under the arc
is a trapezoid, plus the sliver between the arc and its chord.
"""

from __future__ import annotations

import math

import numpy as np

from pyverlet.compile.jit import kernel

RED, GREEN, BLUE = map(np.int64, (0, 8, 16))
"""By how many bits each is shifted. No literals: see `compile.jit.kernel`."""


def _sliver_series():
    """Coefficients of (asin s - s sqrt(1 - s^2)) / s^3 in s^2 up to 1/2, the quarter circle: better than 1e-6 there."""
    s2 = 0.25 - 0.25 * np.cos(np.pi * (np.arange(6) + 0.5) / 6)  # Chebyshev's nodes
    s = np.sqrt(s2)
    return tuple(np.linalg.solve(np.vander(s2, increasing=True), (np.arcsin(s) - s * np.sqrt(1 - s2)) / s**3).tolist())


C0, C1, C2, C3, C4, C5 = _sliver_series()


@kernel
def sliver(chord2, quarter, r):
    """Area between an arc of at most a quarter circle and its chord of squared length chord2; `quarter` is 1 / (4 r^2).

    It is r^2 (asin s - s sqrt(1 - s^2)) with s = chord / 2r.
    """
    s2 = chord2 * quarter
    return r * r * s2 * math.sqrt(s2) * (C0 + s2 * (C1 + s2 * (C2 + s2 * (C3 + s2 * (C4 + s2 * C5)))))


@kernel
def add_band(cover, first, x, low, high, r):
    """Add to `cover`, by pixel from column `first` on, the disc's area in low <= v <= high, 0 <= low < high <= r; centre at x."""
    r2, quarter = r * r, 0.25 / (r * r)
    wide, core = math.sqrt(r2 - low * low), math.sqrt(r2 - high * high)
    for a, end, ha, last in ((-wide, -core, low, high), (core, wide, high, low)):  # under the arc on the left, on the right
        column = math.floor(x + a)
        while a < end:
            b = column + 1 - x
            if b < end:
                hb = math.sqrt(r2 - b * b)
            else:
                b, hb = end, last
            rise = hb - ha
            cover[column - first] += (b - a) * (0.5 * (ha + hb) - low) + sliver((b - a) * (b - a) + rise * rise, quarter, r)
            a, ha = b, hb
            column += 1
    start, stop = x - core, x + core  # between them the band is full
    left, right = math.floor(start), math.floor(stop)
    if left == right:
        cover[left - first] += (high - low) * (stop - start)
    else:
        cover[left - first] += (high - low) * (left + 1 - start)
        for column in range(left + 1, right):
            cover[column - first] += high - low
        cover[right - first] += (high - low) * (stop - right)


@kernel
def channel(pixel, shift):
    """One of R, G, B (shift 0, 8, 16) as a signed number."""
    return np.int32((pixel >> np.uint32(shift)) & np.uint32(255))


@kernel
def beside(pixel, ground, colour, cover, shift):
    """A channel once `cover` / 255 of the pixel's ground has turned into `colour`. (257 x + 2^15) >> 16 is x / 255, rounded."""
    c = cover * (channel(colour, shift) - channel(ground, shift))
    value = channel(pixel, shift) + ((c * np.int32(257) + np.int32(32768)) >> np.int32(16))
    return np.uint32(min(max(value, np.int32(0)), np.int32(255))) << np.uint32(shift)


@kernel
def over(pixel, ground, colour, cover, kept, shift):
    """A channel of a pixel without ground left: the fraction `kept` of what covered it, and `cover` / 255 of `colour`."""
    old = 255 * channel(pixel, shift) - (255 - np.int32(pixel >> np.uint32(24))) * channel(ground, shift)
    value = np.int32((old * kept + cover * channel(colour, shift)) / 255.0 + 0.5)
    return np.uint32(min(max(value, np.int32(0)), np.int32(255))) << np.uint32(shift)


@kernel
def apart(pixel):
    """R, G and B with 20 bits each, so that one multiplication serves all three."""
    p = np.uint64(pixel)
    return (p & np.uint64(0xFF)) | ((p & np.uint64(0xFF00)) << np.uint64(12)) | ((p & np.uint64(0xFF0000)) << np.uint64(24))


@kernel
def over_full(pixel, colour, cover):
    """`over` where no ground is left to see: (255 - cover) / 255 of the pixel and the rest of `colour`, in whole numbers.

    x / 255, rounded, is y + 1 + (y >> 8) >> 8 with y = x + 127 for x up to 255^2, and never half way between two.
    """
    c = np.uint64(cover)
    ones = np.uint64(0x10000100001)
    y = apart(pixel) * (np.uint64(255) - c) + apart(colour) * c + np.uint64(127) * ones
    y += ones + ((y >> np.uint64(8)) & np.uint64(0xFF000FF000FF))
    y = (y >> np.uint64(8)) & np.uint64(0xFF000FF000FF)
    rgb = (y & np.uint64(0xFF)) | ((y >> np.uint64(12)) & np.uint64(0xFF00)) | ((y >> np.uint64(24)) & np.uint64(0xFF0000))
    return np.uint32(rgb) | np.uint32(0xFF000000)


@kernel
def blend(pixel, ground, colour, cover):
    """The pixel once `cover` / 255 of it shows `colour`: on bare ground as long as there is some, then over what is there.

    Rims that meet in a pixel add up in any order, as the discs do; the last comer hides only what there is no room beside.
    """
    covered = np.int32(pixel >> np.uint32(24))
    if covered == 255:
        return over_full(pixel, colour, cover)
    excess = covered + cover - np.int32(255)
    if excess <= 0:
        rgb = beside(pixel, ground, colour, cover, RED) | beside(pixel, ground, colour, cover, GREEN)
        return rgb | beside(pixel, ground, colour, cover, BLUE) | (np.uint32(covered + cover) << np.uint32(24))
    kept = (covered - excess) / covered
    rgb = over(pixel, ground, colour, cover, kept, RED) | over(pixel, ground, colour, cover, kept, GREEN)
    return rgb | over(pixel, ground, colour, cover, kept, BLUE) | np.uint32(0xFF000000)


@kernel
def spread_rows(cover, x, y, r, top, foot):
    """Cover of the rows from `top` up to `foot` by a disc, each into its row of `cover` from the column floor(x - r) on."""
    first = math.floor(x - r)
    for row in range(top, foot):
        above, below = y - row, row + 1 - y  # from the centre up to the top of the row, and down to its foot
        if above > 0.0 and below > 0.0:  # the centre's own row has a band of either half
            add_band(cover[row - top], first, x, 0.0, min(above, r), r)
            add_band(cover[row - top], first, x, 0.0, min(below, r), r)
        else:
            add_band(cover[row - top], first, x, max(-above, -below), min(max(above, below), r), r)
