# mypy: ignore-errors
"""Blends colours into pixels that shapes cover in part.

A pixel is 32 bits, R + G << 8 + B << 16 + A << 24: in memory the bytes R, G, B, A. A is the part of the pixel that discs cover.
"""

from __future__ import annotations

import cython
from cython.cimports.libc.stdint import int32_t, uint32_t, uint64_t

from pyverlet.core.kernels import inlined

OPAQUE = cython.declare(uint32_t, 0xFF000000)  # A of a fully covered pixel


@inlined
def channel(pixel: uint32_t, shift: cython.int) -> int32_t:
    """One of R, G, B (shift 0, 8, 16) as a signed number."""
    return cython.cast(int32_t, (pixel >> shift) & 255)


@inlined
def placed(value: int32_t, shift: cython.int) -> uint32_t:
    """A channel's value, clamped to 0 .. 255, in its place of a pixel."""
    kept: uint32_t = cython.cast(uint32_t, min(max(value, 0), 255))
    return kept << shift


@inlined
def blended_channel(pixel: uint32_t, background: uint32_t, colour: uint32_t, cover: int32_t, shift: cython.int) -> uint32_t:
    """A channel after `cover` / 255 of the pixel's ground has become `colour`. (257 x + 2^15) >> 16 is x / 255, rounded."""
    c: int32_t = cover * (channel(colour, shift) - channel(background, shift))
    return placed(channel(pixel, shift) + ((c * 257 + 32768) >> 16), shift)


@inlined
def over(
    pixel: uint32_t, background: uint32_t, colour: uint32_t, cover: int32_t, kept: cython.double, shift: cython.int
) -> uint32_t:
    """A channel of a pixel without ground: the fraction `kept` of its old colour, plus `cover` / 255 of `colour`."""
    covered: int32_t = cython.cast(int32_t, pixel >> 24)
    old: int32_t = 255 * channel(pixel, shift) - (255 - covered) * channel(background, shift)
    return placed(cython.cast(int32_t, (old * kept + cover * channel(colour, shift)) / 255.0 + 0.5), shift)


@inlined
def apart(pixel: uint32_t) -> uint64_t:
    """R, G and B with 20 bits each, so that one multiplication serves all three."""
    p: uint64_t = pixel
    return (p & 0xFF) | ((p & 0xFF00) << 12) | ((p & 0xFF0000) << 24)


@inlined
def over_full(pixel: uint32_t, colour: uint32_t, cover: int32_t) -> uint32_t:
    """`over` without visible ground: (255 - cover) / 255 of the pixel plus the rest of `colour`, in integers.

    x / 255, rounded, is y + 1 + (y >> 8) >> 8 with y = x + 127 for x up to 255^2, and never half way between two.
    """
    c: uint64_t = cython.cast(uint64_t, cover)
    ones: uint64_t = 0x10000100001
    channels: uint64_t = 0xFF000FF000FF
    y: uint64_t = apart(pixel) * (255 - c) + apart(colour) * c + 127 * ones
    y += ones + ((y >> 8) & channels)
    y = (y >> 8) & channels
    rgb: uint64_t = (y & 0xFF) | ((y >> 12) & 0xFF00) | ((y >> 24) & 0xFF0000)
    return cython.cast(uint32_t, rgb) | OPAQUE


@inlined
def blend(pixel: uint32_t, background: uint32_t, colour: uint32_t, cover: int32_t) -> uint32_t:
    """The pixel after `cover` / 255 of it shows `colour`: first on uncovered ground, then over what is there.

    Coverages of rims in one pixel add up in any order; a shape hides another only if there is no ground left.
    """
    covered: int32_t = cython.cast(int32_t, pixel >> 24)
    if covered == 255:
        return over_full(pixel, colour, cover)
    excess: int32_t = covered + cover - 255
    rgb: uint32_t
    if excess <= 0:
        rgb = blended_channel(pixel, background, colour, cover, 0) | blended_channel(pixel, background, colour, cover, 8)
        return rgb | blended_channel(pixel, background, colour, cover, 16) | (cython.cast(uint32_t, covered + cover) << 24)
    kept: cython.double = cython.cast(cython.double, covered - excess) / covered
    rgb = over(pixel, background, colour, cover, kept, 0) | over(pixel, background, colour, cover, kept, 8)
    return rgb | over(pixel, background, colour, cover, kept, 16) | OPAQUE


@inlined
def mixed(pixel: uint32_t, colour: uint32_t, amount: cython.double) -> uint32_t:
    """The pixel blended with `colour` by `amount`, from 0 to 1; A is unchanged."""
    result: uint32_t = pixel & OPAQUE
    k: cython.int
    for k in range(3):
        shift: cython.int = 8 * k
        old: cython.double = channel(pixel, shift)
        new: cython.double = channel(colour, shift)
        value: int32_t = cython.cast(int32_t, old + min(amount, 1.0) * (new - old) + 0.5)
        result |= cython.cast(uint32_t, value) << shift
    return result
