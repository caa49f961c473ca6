# mypy: ignore-errors
"""Draws discs on pixels with exact coverage. On one thread, as drawing may run beside the physics."""

from __future__ import annotations

import cython
import numpy as np
from cython.cimports.arrays import const_indices, const_reals, doubles, indices, integers, octets, small_integers, words
from cython.cimports.lanes import real
from cython.cimports.libc.math import INFINITY, ceil, floor, log
from cython.cimports.libc.stdint import int32_t, int64_t, uint8_t, uint32_t, uint64_t

from pyverlet.common.constants import LEAST_DRAWN_RADIUS
from pyverlet.core.disc_cache import CACHED, CAPACITY, CROWD, FINE, SIZES, SPARE, cache_disc, draw_cached
from pyverlet.core.disc_coverage import cover_row
from pyverlet.core.kernels import inlined, kernel
from pyverlet.core.pixel_blending import OPAQUE, blend, channel

SUBPIXEL = cython.declare(cython.Py_ssize_t, 4)  # narrower discs are drawn together if there is one per so many pixels
LEAST = cython.declare(cython.double, LEAST_DRAWN_RADIUS)
PI = cython.declare(cython.double, 3.141592653589793)

Picture = cython.struct(
    pixels=cython.pointer[uint32_t],  # (height, width)
    background=cython.pointer[cython.const[uint32_t]],  # the pixels before the first disc
    height=int64_t,
    width=int64_t,
    position=cython.pointer[cython.const[real]],  # (count, 2) m
    radius=cython.pointer[cython.const[real]],  # (count,) m
    colour=cython.pointer[cython.const[uint32_t]],
    count=int64_t,
    left=cython.double,  # m, upper left corner
    top=cython.double,
    scale=cython.double,  # pixels per metre
    small=int64_t,  # number of discs that may use the cache
    narrow=int64_t,  # number of discs narrower than a pixel
    columns=int64_t,  # width of the widest visible disc
)
Cache = cython.struct(
    entry=cython.pointer[int64_t],  # (sizes, FINE, FINE) where the entry begins; 0: none yet
    size=cython.pointer[cython.double],  # (sizes,) radius of the entries of a size, pixels; 0: none yet
    where=cython.pointer[int32_t],
    amount=cython.pointer[uint8_t],
    cover=cython.pointer[cython.double],
    free=int64_t,  # where the next entry goes
)


@inlined
def drawn_radius(p: cython.pointer(Picture), i: int64_t) -> cython.double:
    """Radius of a disc in pixels."""
    r: cython.double = p.radius[i] * p.scale
    return max(r, LEAST)


@inlined
def is_seen(p: cython.pointer(Picture), x: cython.double, y: cython.double, r: cython.double) -> cython.bint:
    """Whether any of a disc is on the picture; false for NaN and infinity."""
    return x + r > 0.0 and y + r > 0.0 and x - r < p.width and y - r < p.height and r < INFINITY


@kernel
def survey(p: cython.pointer(Picture)) -> cython.void:
    """Count the narrow and small discs, and measure the widest."""
    small: int64_t = 0
    narrow: int64_t = 0
    p.columns = 0
    for i in range(p.count):
        r: cython.double = drawn_radius(p, i)
        narrow += r < 0.5
        small += r >= 0.5 and r <= CACHED
        if 2.0 * r + 2.0 > p.columns:  # possibly the widest
            x: cython.double = (p.position[2 * i] - p.left) * p.scale
            y: cython.double = (p.top - p.position[2 * i + 1]) * p.scale
            if is_seen(p, x, y, r):
                p.columns = max(p.columns, cython.cast(int64_t, floor(x + r)) + 1 - cython.cast(int64_t, floor(x - r)))
    p.small = small
    p.narrow = narrow


@kernel
def add_subpixel(p: cython.pointer(Picture), sums: cython.pointer[uint64_t]) -> cython.void:
    """Sum coverage and colour per pixel: R and G, B and coverage, of 32 bits each."""
    left: real = p.left
    top: real = p.top
    scale: real = p.scale
    wide: real = p.width
    high: real = p.height
    half: real = 0.5
    least: real = LEAST
    whole: real = 255.0 * PI
    one: uint64_t = cython.cast(uint64_t, 1) << 32  # coverage, above blue
    width: int64_t = p.width
    for i in range(p.count):
        x: real = (p.position[2 * i] - left) * scale
        y: real = (top - p.position[2 * i + 1]) * scale
        r: real = p.radius[i] * scale
        r = max(r, least)
        if x >= 0 and x < wide and y >= 0 and y < high and r < half:
            at: uint64_t = cython.cast(int32_t, y) * width + cython.cast(int32_t, x)
            area: real = whole * r * r + half
            cover: uint64_t = cython.cast(uint64_t, cython.cast(int32_t, area))
            c: uint64_t = p.colour[i]
            sums[2 * at] += cover * ((c & 0xFF) | ((c & 0xFF00) << 24))
            sums[2 * at + 1] += cover * (((c >> 16) & 0xFF) | one)


@inlined
def subpixel_channel(
    total: uint64_t, share: cython.double, bare: cython.double, background: uint32_t, shift: cython.int
) -> uint32_t:
    """A channel of the mean colour, blended with the uncovered part of the ground."""
    value: int32_t = cython.cast(int32_t, share * cython.cast(int64_t, total) + bare * channel(background, shift) + 0.5)
    return cython.cast(uint32_t, value) << shift


@kernel
def put_subpixel(p: cython.pointer(Picture), sums: cython.pointer[uint64_t]) -> cython.void:
    """Draw the sums: coverage is the sum of areas, colour their mean, independent of the order."""
    for k in range(p.height * p.width):
        rg: uint64_t = sums[2 * k]
        ba: uint64_t = sums[2 * k + 1]
        covered: cython.double = cython.cast(int64_t, ba >> 32)
        if covered == 0.0:
            continue
        share: cython.double = min(1.0 / covered, 1.0 / 255.0)
        bare: cython.double = max(1.0 - covered / 255.0, 0.0)
        old: uint32_t = p.background[k]
        rgb: uint32_t = subpixel_channel(cython.cast(uint32_t, rg), share, bare, old, 0)
        rgb |= subpixel_channel(rg >> 32, share, bare, old, 8) | subpixel_channel(cython.cast(uint32_t, ba), share, bare, old, 16)
        p.pixels[k] = rgb | (cython.cast(uint32_t, min(covered, 255.0)) << 24)


@kernel
def put_disc(
    p: cython.pointer(Picture), colour: uint32_t, x: cython.double, y: cython.double, r: cython.double, cover: cython.p_double
) -> cython.void:
    """Draw one disc, row by row; cover: zeros, at least as many as it has columns."""
    first: int64_t = cython.cast(int64_t, floor(x - r))
    columns: int64_t = cython.cast(int64_t, floor(x + r)) + 1 - first
    for row in range(cython.cast(int64_t, max(floor(y - r), 0.0)), cython.cast(int64_t, min(ceil(y + r), p.height))):
        cover_row(cover, 0, x, y, r, row)
        for k in range(columns):
            amount: int32_t = cython.cast(int32_t, 255.0 * cover[k] + 0.5)
            cover[k] = 0.0
            column: int64_t = first + k
            if column >= 0 and column < p.width:
                at: int64_t = row * p.width + column
                if amount >= 255:
                    p.pixels[at] = colour
                elif amount > 0:
                    p.pixels[at] = blend(p.pixels[at], p.background[at], colour, amount)


@kernel
def entry_of(
    p: cython.pointer(Picture), c: cython.pointer(Cache), x: cython.double, y: cython.double, size: int64_t, r: cython.double
) -> int64_t:
    """Index of the cache entry of this disc, made if missing; 0 if there is no room."""
    fine_x: int64_t = cython.cast(int64_t, FINE * (x - cython.cast(int64_t, x)))
    fine_y: int64_t = cython.cast(int64_t, FINE * (y - cython.cast(int64_t, y)))
    k: int64_t = (size * FINE + fine_y) * FINE + fine_x
    if c.entry[k] == 0 and c.free + SPARE * SPARE + 2 <= CAPACITY:
        if c.size[size] == 0.0:
            c.size[size] = r
        c.entry[k] = c.free
        u: cython.double = (fine_x + 0.5) / FINE
        v: cython.double = (fine_y + 0.5) / FINE
        c.free = cache_disc(c.where, c.amount, c.free, p.width, u, v, c.size[size], c.cover)
    return c.entry[k]


@kernel
def put_discs(
    p: cython.pointer(Picture), c: cython.pointer(Cache), subpixel: cython.bint, crowd: cython.bint, cover: cython.p_double
) -> cython.void:
    """Draw the discs in order; if `subpixel`, without narrow ones."""
    same: cython.double = 0.0
    size: int64_t = 0
    at: int64_t
    for i in range(p.count):
        x: cython.double = (p.position[2 * i] - p.left) * p.scale
        y: cython.double = (p.top - p.position[2 * i + 1]) * p.scale
        r: cython.double = drawn_radius(p, i)
        if not is_seen(p, x, y, r):
            continue
        colour: uint32_t = p.colour[i] | OPAQUE
        if r < 0.5:  # such discs lie in the pixel of their centre: a million of them are a cloud
            if not subpixel and x >= 0.0 and x < p.width and y >= 0.0 and y < p.height:
                at = cython.cast(int64_t, y) * p.width + cython.cast(int64_t, x)
                area: int32_t = cython.cast(int32_t, 255.0 * PI * r * r + 0.5)
                p.pixels[at] = blend(p.pixels[at], p.background[at], colour, area)
            continue
        reach: cython.double = r + 2.0
        if crowd and r <= CACHED and x > reach and y > reach and x < p.width - reach and y < p.height - reach:
            if r != same:
                same = r
                size = cython.cast(int64_t, log(2.0 * r) * SIZES + 0.5)
            at = entry_of(p, c, x, y, size, r)
            if at > 0:
                centre: int64_t = cython.cast(int64_t, y) * p.width + cython.cast(int64_t, x)
                draw_cached(p.pixels, p.background, colour, centre, c.where, c.amount, at)
                continue
        put_disc(p, colour, x, y, r, cover)


def draw_discs(pixels, background, position, radius, colour, left: cython.double, top: cython.double, scale: cython.double):
    """Draw discs on `pixels`, (h, w) uint32, in the order given; many that are narrower than a pixel are drawn first, together.

    Many small discs are drawn from a cache that is filled on demand: at the nearest of FINE x FINE subpixel positions, and with
    the radius of the first of nearly their size. Each has its exact area, and is at most a sixteenth of a pixel off.

    `background`: the pixels before the first disc. `position` (n, 2), `radius` (n,): metres. `colour`: (n,) uint32.
    `left`, `top`: metres at the upper left corner of the picture; `scale`: pixels per metre.
    """
    p: Picture
    c: Cache
    p.pixels, p.background, p.colour = indices(pixels), const_indices(background), const_indices(colour)
    p.position, p.radius = const_reals(position), const_reals(radius)
    p.height, p.width, p.count = pixels.shape[0], pixels.shape[1], len(radius)
    p.left, p.top, p.scale = left, top, scale
    picture: cython.pointer(Picture) = cython.address(p)
    cache: cython.pointer(Cache) = cython.address(c)
    with cython.nogil:
        survey(picture)
    subpixel: cython.bint = SUBPIXEL * p.narrow >= p.height * p.width
    if subpixel:
        sums = np.zeros(2 * p.height * p.width, np.uint64)
        total: cython.pointer[uint64_t] = words(sums)
        with cython.nogil:
            add_subpixel(picture, total)
            put_subpixel(picture, total)
        if p.narrow == p.count:
            return
    crowd: cython.bint = p.small >= CROWD
    sizes: cython.Py_ssize_t = cython.cast(int64_t, log(2.0 * CACHED) * SIZES) + 2 if crowd else 0
    capacity: cython.Py_ssize_t = CAPACITY if crowd else 0
    entry, size = np.zeros(sizes * FINE * FINE, np.int64), np.zeros(sizes)
    where, amount, spare = np.empty(capacity, np.int32), np.empty(capacity, np.uint8), np.empty(SPARE * SPARE)
    c.entry, c.size, c.cover = integers(entry), doubles(size), doubles(spare)
    c.where, c.amount = small_integers(where), octets(amount)
    c.free = 1
    cover = np.zeros(p.columns + 1)
    row: cython.p_double = doubles(cover)
    with cython.nogil:
        put_discs(picture, cache, subpixel, crowd, row)
