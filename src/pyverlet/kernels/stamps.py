"""Stamps of small discs: which pixels one covers, and how much of each, worked out once for each of some places in a pixel."""

from __future__ import annotations

import math

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.kernels.cover import blend, over_full, spread_rows

CROWD = 1024
"""Small discs from which on they are drawn from stamps: as many stamps cost as much as so many discs."""

STAMPED = 8
"""Radius of the largest disc that is, in pixels."""

FINE = 16
"""Places within a pixel that stamps tell apart, along each axis."""

SIZES = 128
"""Sizes of stamps within a factor e: each is within a hundredth of what it stands for."""

ROOM = 1 << 20
"""Pixels of stamps there is room for. What does not fit is drawn without."""


@kernel
def make_stamp(where, amount, at, width, x, y, r, cover):
    """Note which pixels a disc covers, and how much of 255; x, y: where in its own pixel the centre is.

    From `at` on: the number of pixels that it covers whole, that of its rim, and where these and those are, counted from its own
    pixel on in a picture of this width. Returns where the next may begin. cover: of as many rows and columns, or more.
    """
    left, top = math.floor(x - r), math.floor(y - r)
    columns, rows = math.floor(x + r) + 1 - left, math.ceil(y + r) - top
    cover[:rows, :columns] = 0.0
    spread_rows(cover, x, y, r, top, top + rows)
    end = at + 2
    for whole in (True, False):
        begin = end
        for row in range(rows):
            for column in range(columns):
                part = np.int32(255.0 * cover[row, column] + 0.5)
                if part > 0 and (part >= 255) == whole:
                    where[end], amount[end] = (top + row) * width + left + column, part
                    end += 1
        where[at if whole else at + 1] = end - begin
    return end


@kernel
def put_stamp(pixels, ground, colour, centre, where, amount):
    """Draw a disc, all of it on the picture; pixels, ground: (h w,); centre: which of them its centre is in."""
    rim = 2 + where[0]
    for k in range(np.uint64(2), np.uint64(rim)):
        pixels[np.uint64(centre + where[k])] = colour
    for k in range(np.uint64(rim), np.uint64(rim + where[1])):
        at = np.uint64(centre + where[k])
        pixel, cover = pixels[at], np.int32(amount[k])
        if pixel >> np.uint32(24) == 0:
            pixels[at] = (over_full(ground[at], colour, cover) & np.uint32(0xFFFFFF)) | (np.uint32(cover) << np.uint32(24))
        else:
            pixels[at] = blend(pixel, ground[at], colour, cover)
