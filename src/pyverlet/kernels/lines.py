"""Straight lines to pixels, with smooth rims and round ends. Pixels as in kernels.cover, whose A stays as it is."""

from __future__ import annotations

import math

import numpy as np

from pyverlet.compile.jit import kernel


@kernel
def mixed(pixel, colour, cover):
    """The pixel once the part `cover`, 0 to 1, of it shows `colour`."""
    result = pixel & np.uint32(0xFF000000)
    for shift in (0, 8, 16):
        old = np.float64((pixel >> np.uint32(shift)) & np.uint32(255))
        new = np.float64((colour >> np.uint32(shift)) & np.uint32(255))
        result |= np.uint32(int(old + cover * (new - old) + 0.5)) << np.uint32(shift)
    return result


@kernel
def lines(pixels, ends, colour, left, top, scale, half):
    """Draw lines `2 half` pixels wide on `pixels`, (h, w) uint32, in the order given.

    `ends` (m, 2, 2): metres. `colour`: (m,) uint32. `left`, `top`: metres at the upper left corner; `scale`: pixels a metre.
    """
    height, width = pixels.shape
    reach = half + 0.5
    for k in range(ends.shape[0]):
        x0, y0 = (ends[k, 0, 0] - left) * scale, (top - ends[k, 0, 1]) * scale
        x1, y1 = (ends[k, 1, 0] - left) * scale, (top - ends[k, 1, 1]) * scale
        across = max(x0, x1) + reach > 0.0 and min(x0, x1) - reach < width
        if not (across and max(y0, y1) + reach > 0.0 and min(y0, y1) - reach < height):
            continue  # outside, or NaN
        dx, dy = x1 - x0, y1 - y0
        length2 = max(dx * dx + dy * dy, 1e-12)
        first, last = max(math.floor(min(y0, y1) - reach), 0), min(math.ceil(max(y0, y1) + reach), height)
        # How far along a row the line's band reaches to either side of its middle; the whole line where it lies flat.
        wide = reach * math.sqrt(length2) / abs(dy) if dy != 0.0 else np.inf
        for row in range(first, last):
            py = row + 0.5 - y0
            low, high = min(x0, x1) - reach, max(x0, x1) + reach
            if wide < np.inf:
                middle, slant = x0 + dx * py / dy, 0.5 * abs(dx / dy)
                low, high = max(low, middle - wide - slant - 1.0), min(high, middle + wide + slant + 1.0)
            for column in range(max(math.floor(low), 0), min(math.ceil(high), width)):
                px = column + 0.5 - x0
                along = min(max((px * dx + py * dy) / length2, 0.0), 1.0)
                cover = min(max(reach - math.hypot(px - along * dx, py - along * dy), 0.0), 1.0)
                if cover > 0.0:
                    pixels[row, column] = mixed(pixels[row, column], colour[k], cover)
