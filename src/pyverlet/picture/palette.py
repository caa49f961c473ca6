"""Colours as the live page has them: a dark and a light theme, and palettes through OKLCH, whose steps look equally far apart.

OKLCH: Bjorn Ottosson, "A perceptual color space for image processing" (2020).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

STEPS = 64  # colours along a palette
TONES = 4  # neighbours of one colour differ a little in lightness, so that each circle can be told
Packed = NDArray[np.uint32]  # colours as R + G << 8 + B << 16


@dataclass(frozen=True)
class Theme:
    """What is behind the circles. Colours as 0xRRGGBB."""

    name: str
    ground: int
    inside: int
    wall: int
    obstacle: int
    grid: int
    dark: bool
    text: int


DARK = Theme(
    "dark", ground=0x0F1216, inside=0x171B21, wall=0x4A5460, obstacle=0x5B6673, grid=0x1C2128, dark=True, text=0xE8ECF1
)  # fmt: skip
LIGHT = Theme(
    "light", ground=0xF3F4F6, inside=0xFFFFFF, wall=0xAAB3BF, obstacle=0x98A2AF, grid=0xE6E9ED, dark=False, text=0x1B222B
)


def packed(rgb: NDArray[Any]) -> Packed:
    """(n, 3) or (n, 4) bytes R, G, B as (n,) colours."""
    r, g, b = (rgb[..., k].astype(np.uint32) for k in range(3))
    return np.asarray(r | (g << np.uint32(8)) | (b << np.uint32(16)), dtype=np.uint32)


def swapped(rgb: int) -> int:
    """0xRRGGBB as a colour of the raster."""
    return (rgb >> 16) | (rgb & 0xFF00) | ((rgb & 0xFF) << 16)


def oklch(light: NDArray[Any], chroma: NDArray[Any], degrees: NDArray[Any]) -> Packed:
    """Colours of this lightness (0 to 1), chroma and hue, as near as sRGB has them."""
    hue = np.radians(degrees)
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    l_ = (light + 0.3963377774 * a + 0.2158037573 * b) ** 3
    m_ = (light - 0.1055613458 * a - 0.0638541728 * b) ** 3
    s_ = (light - 0.0894841775 * a - 1.2914855480 * b) ** 3
    linear = np.stack(
        (
            4.0767416621 * l_ - 3.3077115913 * m_ + 0.2309699292 * s_,
            -1.2684380046 * l_ + 2.6097574011 * m_ - 0.3413193965 * s_,
            -0.0041960863 * l_ - 0.7034186147 * m_ + 1.7076147010 * s_,
        ),
        axis=-1,
    ).clip(0.0, 1.0)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return packed(np.rint(255 * encoded.clip(0.0, 1.0)))


@cache
def hues(dark: bool) -> Packed:
    """STEPS * TONES colours from red through green and blue to violet."""
    return _shaded(lambda t: (np.full_like(t, 0.74 if dark else 0.68), np.full_like(t, 0.135), 25 + 300 * t))


@cache
def heat(dark: bool) -> Packed:
    """STEPS * TONES colours from a dull blue to a bright yellow (dark) or red (light): for speeds and other amounts."""
    if dark:
        return _shaded(lambda t: (0.5 + 0.4 * t, 0.12 + 0.03 * t, 275 - 185 * t))
    return _shaded(lambda t: (0.8 - 0.28 * t, 0.1 + 0.08 * t, 250 + 120 * t))


def _shaded(path: Any) -> Packed:
    light, chroma, degrees = path(np.linspace(0.0, 1.0, STEPS)[:, None])
    tones = 0.035 * (np.arange(TONES) - (TONES - 1) / 2)
    return np.ravel(oklch(light + tones, chroma + 0 * tones, degrees + 0 * tones))


def shade(step: NDArray[Any]) -> NDArray[np.uint32]:
    """Indices into a palette for the steps (n,) of particles 0, 1, ...: each with a tone of its own."""
    number = np.arange(len(step), dtype=np.uint32)
    tone = ((number * np.uint32(0x9E3779B1)) >> np.uint32(16)) & np.uint32(TONES - 1)
    return np.asarray(step.astype(np.uint32) * np.uint32(TONES) + tone, dtype=np.uint32)
