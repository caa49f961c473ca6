"""Circles and outlines to pixels, each covering exactly the area it has. One thread: drawing may run beside the physics.

What a pixel is: `kernels.cover`.
"""

from __future__ import annotations

import math

import numpy as np

from pyverlet.compile.jit import kernel
from pyverlet.ground.constants import LEAST_DRAWN_RADIUS
from pyverlet.kernels.cover import BLUE, GREEN, RED, blend, channel, spread_rows
from pyverlet.kernels.stamps import CROWD, FINE, ROOM, SIZES, STAMPED, make_stamp, put_stamp

DUST = 4
"""Discs narrower than a pixel are drawn together, by `dust`, if there is one to so many pixels."""


@kernel
def dust(pixels, ground, position, radius, colour, left, top, scale):
    """Draw those of `circles` that are narrower than a pixel, each into the pixel of its centre; `pixels` still is `ground`.

    What covers a pixel is the sum of their areas, its colour their mean, in whatever order they come. A third of the time of
    blending one by one, where the processor cannot foresee which pixel still shows some ground.
    """
    height, width = pixels.shape
    low, byte = np.uint64(0xFFFFFFFF), np.uint64(0xFF)
    sums = np.zeros((height * width, 2), np.uint64)  # R and G, B and cover, of 32 bits each
    real = position.dtype.type  # in which pixel a centre is: as exactly as it is known
    x0, y0, unit, wide, high = real(left), real(top), real(scale), real(width), real(height)
    zero, half, least, whole = real(0.0), real(0.5), real(LEAST_DRAWN_RADIUS), real(255.0 * np.pi)
    for i in range(radius.shape[0]):
        x, y = (position[i, 0] - x0) * unit, (y0 - position[i, 1]) * unit
        r = max(real(radius[i]) * unit, least)
        if zero <= x < wide and zero <= y < high and r < half:
            at = np.uint64(np.int64(np.int32(y)) * width + np.int64(np.int32(x)))
            c, cover = np.uint64(colour[i]), np.uint64(np.int32(whole * r * r + half))
            sums[at, 0] += cover * ((c & byte) | ((c & np.uint64(0xFF00)) << np.uint64(24)))
            sums[at, 1] += cover * (((c >> np.uint64(16)) & byte) | np.uint64(1 << 32))
    for row in range(height):
        for column in range(width):
            rg, ba = sums[row * width + column]
            covered = np.float64(np.int64(ba >> np.uint64(32)))
            if covered == 0.0:
                continue
            share, bare, old = min(1.0 / covered, 1.0 / 255.0), max(1.0 - covered / 255.0, 0.0), ground[row, column]
            red = np.int32(share * np.float64(np.int64(rg & low)) + bare * channel(old, RED) + 0.5)
            green = np.int32(share * np.float64(np.int64(rg >> np.uint64(32))) + bare * channel(old, GREEN) + 0.5)
            blue = np.int32(share * np.float64(np.int64(ba & low)) + bare * channel(old, BLUE) + 0.5)
            alpha = np.uint32(min(covered, 255.0))
            rgb = np.uint32(red) | (np.uint32(green) << np.uint32(8)) | (np.uint32(blue) << np.uint32(16))
            pixels[row, column] = rgb | (alpha << np.uint32(24))


@kernel
def put_disc(pixels, ground, colour, x, y, r, cover):
    """Draw one disc, row by row; cover: (2 r + 2 or more,) of 0."""
    height, width = pixels.shape
    first, last = math.floor(x - r), math.floor(x + r) + 1
    for row in range(np.uint64(max(math.floor(y - r), 0.0)), np.uint64(min(math.ceil(y + r), float(height)))):
        spread_rows(cover.reshape(1, -1), x, y, r, np.int64(row), np.int64(row) + 1)
        for k in range(np.uint64(last - first)):
            amount = np.int32(255.0 * cover[k] + 0.5)
            cover[k] = 0.0
            column = first + k
            if 0 <= column < width:
                column = np.uint64(column)
                if amount >= 255:
                    pixels[row, column] = colour
                elif amount > 0:
                    pixels[row, column] = blend(pixels[row, column], ground[row, column], colour, amount)


@kernel
def circles(pixels, ground, position, radius, colour, left, top, scale):
    """Draw discs on `pixels`, (h, w) uint32, in the order given; where a crowd of them is narrower than a pixel, those first.

    Small ones of a crowd are drawn from stamps, which are made when first asked for: at the next of FINE x FINE places within a
    pixel, all those as large as the first of nearly their size. Each has its area, and is a sixteenth of a pixel aside at most.

    `ground`: what the pixels were before the first. `position` (n, 2), `radius` (n,): metres. `colour`: (n,) uint32.
    `left`, `top`: metres at the upper left corner of the picture; `scale`: pixels a metre.
    """
    height, width = pixels.shape
    cover = np.zeros(16)
    narrow, small = 0, 0
    for i in range(radius.shape[0]):
        r = max(radius[i] * scale, LEAST_DRAWN_RADIUS)
        narrow += r < 0.5
        small += 0.5 <= r <= STAMPED
    dusty = DUST * narrow >= height * width
    if dusty:
        dust(pixels, ground, position, radius, colour, left, top, scale)
        if narrow == radius.shape[0]:
            return
    crowd = small >= CROWD
    sizes = np.int64(math.log(2.0 * STAMPED) * SIZES) + 2 if crowd else 0
    stamps, of_size, free, largest = np.zeros(sizes * FINE * FINE, np.int64), np.zeros(sizes), 1, (2 * STAMPED + 3) ** 2 + 2
    where, amount = np.empty(ROOM if crowd else 0, np.int32), np.empty(ROOM if crowd else 0, np.uint8)
    spare, flat, flat_ground = np.empty((2 * STAMPED + 3, 2 * STAMPED + 3)), pixels.reshape(-1), ground.reshape(-1)
    same, size = 0.0, 0
    for i in range(radius.shape[0]):
        x, y = (position[i, 0] - left) * scale, (top - position[i, 1]) * scale
        r = max(radius[i] * scale, LEAST_DRAWN_RADIUS)
        if not (x + r > 0.0 and y + r > 0.0 and x - r < width and y - r < height and r < np.inf):
            continue  # outside, or NaN
        c = colour[i] | np.uint32(0xFF000000)
        if r < 0.5:  # all of it in the pixel of its centre: a million of them are a cloud, not circles
            if not dusty and 0.0 <= x < width and 0.0 <= y < height:
                row, column = np.uint64(y), np.uint64(x)
                pixels[row, column] = blend(pixels[row, column], ground[row, column], c, np.int32(255.0 * np.pi * r * r + 0.5))
            continue
        reach = r + 2.0
        if crowd and r <= STAMPED and x > reach and y > reach and x < width - reach and y < height - reach:
            column, row = np.int64(x), np.int64(y)
            fine_x, fine_y = np.int64(FINE * (x - column)), np.int64(FINE * (y - row))
            if r != same:
                same, size = r, np.int64(math.log(2.0 * r) * SIZES + 0.5)
            stamp = (size * FINE + fine_y) * FINE + fine_x
            if stamps[stamp] == 0 and free + largest <= ROOM:
                if of_size[size] == 0.0:
                    of_size[size] = r
                stamps[stamp], place = free, ((fine_x + 0.5) / FINE, (fine_y + 0.5) / FINE)
                free = make_stamp(where, amount, free, width, *place, of_size[size], spare)
            if stamps[stamp] > 0:
                put_stamp(flat, flat_ground, c, row * width + column, where[stamps[stamp] :], amount[stamps[stamp] :])
                continue
        columns = math.floor(x + r) + 1 - math.floor(x - r)
        if columns > cover.shape[0]:
            cover = np.zeros(2 * columns)
        put_disc(pixels, ground, c, x, y, r, cover)


@kernel
def stroke(cover, x0, y0, x1, y1, half):
    """Raise `cover`, (h, w) float32 from 0 to 1, to that of a line `2 half` pixels wide, with round ends. Pixels, y down."""
    height, width = cover.shape
    reach = half + 0.5
    dx, dy = x1 - x0, y1 - y0
    length2 = max(dx * dx + dy * dy, 1e-12)
    for row in range(max(math.floor(min(y0, y1) - reach), 0), min(math.ceil(max(y0, y1) + reach), height)):
        for column in range(max(math.floor(min(x0, x1) - reach), 0), min(math.ceil(max(x0, x1) + reach), width)):
            px, py = column + 0.5 - x0, row + 0.5 - y0
            along = min(max((px * dx + py * dy) / length2, 0.0), 1.0)
            distance = math.hypot(px - along * dx, py - along * dy)
            cover[row, column] = max(cover[row, column], min(max(reach - distance, 0.0), 1.0))


@kernel
def fill(cover, edges, slices):
    """Add to `cover`, (h, w) float32, the inside (even-odd) of the closed lines whose edges (m, 4) are x0, y0, x1, y1 in pixels.

    Each row is cut into `slices` lines, exact along x.
    """
    height, width = cover.shape
    crossing = np.empty(edges.shape[0])
    for line in range(height * slices):
        y = (line + 0.5) / slices
        count = 0
        for e in range(edges.shape[0]):
            x0, y0, x1, y1 = edges[e]
            if (y0 <= y) != (y1 <= y):
                crossing[count] = min(max(x0 + (y - y0) / (y1 - y0) * (x1 - x0), 0.0), float(width))
                count += 1
        ordered = np.sort(crossing[:count])
        row = line // slices
        for k in range(0, count - 1, 2):
            a, b = ordered[k], ordered[k + 1]
            for column in range(int(a), min(math.ceil(b), width)):
                cover[row, column] += max(min(b, column + 1.0) - max(a, float(column)), 0.0) / slices


@kernel
def mixed(pixel, colour, amount):
    """The pixel with `colour`, uint32, mixed in by `amount`, from 0 to 1; its A stays."""
    result = pixel & np.uint32(0xFF000000)
    for shift in (0, 8, 16):
        old = np.float64((pixel >> np.uint32(shift)) & np.uint32(255))
        new = np.float64((colour >> np.uint32(shift)) & np.uint32(255))
        result |= np.uint32(int(old + min(amount, 1.0) * (new - old) + 0.5)) << np.uint32(shift)
    return result


@kernel
def _edges(points, first, last):
    """(nx, ny, c) of the edges of a polygon: nx x + ny y - c is the distance of (x, y) in front of an edge."""
    edges = np.zeros((last - first, 3))
    edges[:, 2] = np.inf  # an edge without length has all in its back
    for k in range(first, last):
        x0, y0 = points[k]
        x1, y1 = points[k + 1 if k + 1 < last else first]
        length = math.hypot(x1 - x0, y1 - y0)
        if length > 0.0:
            nx, ny = (y0 - y1) / length, (x1 - x0) / length
            edges[k - first, 0], edges[k - first, 1], edges[k - first, 2] = nx, ny, nx * x0 + ny * y0
    return edges


@kernel
def _spanned(edges, y, margin):
    """(low, high) in x where a row of pixels at height y is at most `margin` in front of all edges."""
    low, high = -np.inf, np.inf
    for k in range(edges.shape[0]):
        rest = margin + edges[k, 2] - edges[k, 1] * y
        if edges[k, 0] > 1e-9:
            high = min(high, rest / edges[k, 0])
        elif edges[k, 0] < -1e-9:
            low = max(low, rest / edges[k, 0])
        elif rest < 0.0:
            high = -np.inf
    return low, high


@kernel
def convex(pixels, points, first, colour):
    """Fill convex polygons in `colour`, uint32: corners first[k] to first[k + 1] of `points` (n, 2), counter-clockwise with y up.

    Points are pixels, y down. A pixel on the rim is covered by its distance from the nearest edge.
    """
    height, width = pixels.shape
    for polygon in range(first.shape[0] - 1):
        a, b = first[polygon], first[polygon + 1]
        top, bottom = points[a:b, 1].min() - 0.5, points[a:b, 1].max() + 0.5
        if not (bottom > 0.0 and top < height):
            continue  # outside, or NaN
        edges = _edges(points, a, b)
        for row in range(max(int(top), 0), min(int(bottom) + 1, height)):
            y = row + 0.5
            low, high = _spanned(edges, y, 0.5)
            core_low, core_high = _spanned(edges, y, -0.5)
            start, stop = min(max(low - 0.5, 0.0), float(width)), min(max(high + 0.5, 0.0), float(width))
            for column in range(int(start), int(stop)):
                x = column + 0.5
                amount = 1.0
                if not core_low <= x <= core_high:
                    front = -np.inf
                    for k in range(edges.shape[0]):
                        front = max(front, edges[k, 0] * x + edges[k, 1] * y - edges[k, 2])
                    amount = min(max(0.5 - front, 0.0), 1.0)
                if amount > 0.0:
                    pixels[row, column] = mixed(pixels[row, column], colour, amount)


@kernel
def tint(pixels, cover, colour):
    """Mix `colour`, uint32, into `pixels` by `cover`; their A stays."""
    height, width = pixels.shape
    for row in range(height):
        for column in range(width):
            amount = cover[row, column]
            if amount > 0.0:
                pixels[row, column] = mixed(pixels[row, column], colour, amount)
