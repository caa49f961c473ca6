"""Colourings: the colour of a circle by initial position, speed, mass, energy or group, or given by the user.

Colours are those of the live page: a dark and a light theme, and palettes through OKLCH with perceptually equal steps (Bjorn
Ottosson, "A perceptual color space for image processing", 2020).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.shown import Shown
from pyverlet.state.group import Group, check_home, members
from pyverlet.world.world import World

STEPS = 64  # colours along a palette
TONES = 4  # lightness variants, so that neighbours of one colour can be distinguished
Packed = NDArray[np.uint32]  # R + G << 8 + B << 16


@dataclass(frozen=True)
class Theme:
    """Colours of the background and lines, as 0xRRGGBB."""

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
    """(n, 3) or (n, 4) bytes R, G, B as (n,) packed colours."""
    r, g, b = (rgb[..., k].astype(np.uint32) for k in range(3))
    return np.asarray(r | (g << np.uint32(8)) | (b << np.uint32(16)), dtype=np.uint32)


def swapped(rgb: int) -> int:
    """0xRRGGBB as a packed colour."""
    return (rgb >> 16) | (rgb & 0xFF00) | ((rgb & 0xFF) << 16)


def oklch(light: NDArray[Any], chroma: NDArray[Any], degrees: NDArray[Any]) -> Packed:
    """Packed colours of this lightness (0 to 1), chroma and hue, clipped to sRGB."""
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
    """STEPS * TONES colours from a dull blue to a bright yellow (dark) or red (light), for speeds and other amounts."""
    if dark:
        return _shaded(lambda t: (0.5 + 0.4 * t, 0.12 + 0.03 * t, 275 - 185 * t))
    return _shaded(lambda t: (0.8 - 0.28 * t, 0.1 + 0.08 * t, 250 + 120 * t))


def _shaded(path: Any) -> Packed:
    light, chroma, degrees = path(np.linspace(0.0, 1.0, STEPS)[:, None])
    tones = 0.035 * (np.arange(TONES) - (TONES - 1) / 2)
    return np.ravel(oklch(light + tones, chroma + 0 * tones, degrees + 0 * tones))


def shade(step: NDArray[Any]) -> NDArray[np.uint32]:
    """Palette indices for the steps (n,) of particles 0, 1, ..., with varying tones."""
    number = np.arange(len(step), dtype=np.uint32)
    tone = ((number * np.uint32(0x9E3779B1)) >> np.uint32(16)) & np.uint32(TONES - 1)
    return np.asarray(step.astype(np.uint32) * np.uint32(TONES) + tone, dtype=np.uint32)


USUAL_S = 1 / 3  # averaging time of the scale, simulated s: no flicker at any frame rate
USUAL_MULTIPLE = 3.0  # end of the palette over the typical value
GOLDEN = 0.6180339887498949  # (sqrt(5) - 1) / 2


class Colouring(Shown, ABC):
    """Base class of colourings, which give every circle of a world a colour in each picture."""

    @abstractmethod
    def colours(self, world: World, theme: Theme) -> Packed:
        """(n,) current colours of the world's circles, R + G << 8 + B << 16.

        `world` may be a substitute that has only `velocity`, `mass`, `group_number`, `time` and a length.
        """


class ByOrigin(Colouring):
    """Hues in the order in which circles were added; scenes fill their room from the bottom up."""

    def colours(self, world: World, theme: Theme) -> Packed:
        n = len(world)
        return hues(theme.dark)[shade(np.arange(n) * STEPS // max(n, 1))]


class _ByAmount(Colouring):
    """Base class of colourings by an amount that is 0 at rest.

    Args:
        full: the amount at the end of the palette; None: three times the typical one.
    """

    def __init__(self, *, full: float | None = None) -> None:
        self._full = None if full is None else checks.number("full", full, above=0.0)
        self._usual, self._time = 0.0, -np.inf

    @abstractmethod
    def _amount(self, world: World) -> NDArray[Any]:
        """(n,) amount of each circle, finite."""

    def colours(self, world: World, theme: Theme) -> Packed:
        amount = self._amount(world)
        full = self._full
        if full is None:
            mean = float(amount.mean(dtype=np.float64)) if len(amount) else 0.0
            passed = world.time - self._time
            self._usual += (mean - self._usual) * (-np.expm1(-passed / USUAL_S) if passed >= 0 else 1.0)
            self._time = world.time
            full = USUAL_MULTIPLE * self._usual
        return heat(theme.dark)[shade(_steps(amount, 0.0, full))]


class BySpeed(_ByAmount):
    """Colours by speed.

    Args:
        full: m/s at the end of the palette; None: three times the typical speed.
    """

    def _amount(self, world: World) -> NDArray[Any]:
        return np.asarray(np.hypot(*world.velocity.T))


class ByEnergy(_ByAmount):
    """Colours by kinetic energy, m v^2 / 2, 0 for pinned circles.

    Args:
        full: J at the end of the palette; None: three times the typical energy.
    """

    def _amount(self, world: World) -> NDArray[Any]:
        x, y = world.velocity.T
        return np.asarray(np.where(np.isfinite(world.mass), 0.5 * world.mass * (x * x + y * y), 0.0))


class ByMass(Colouring):
    """Colours by mass, logarithmically; pinned circles have the last colour."""

    def colours(self, world: World, theme: Theme) -> Packed:
        logarithm = np.log(world.mass.astype(np.float64))
        finite = logarithm[np.isfinite(logarithm)]
        low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 0.0)
        return heat(theme.dark)[shade(_steps(logarithm, low, high))]


class Groups(Colouring):
    """A hue for each group.

    Args:
        groups: results of `world.add`; circles in none of them are grey. By default all groups of the world.
    """

    def __init__(self, *groups: Group) -> None:
        for k, group in enumerate(groups):
            if not isinstance(group, Group):
                raise InputError(f"groups[{k}] is {group!r}; allowed is what world.add returns")
        self._groups = groups

    def colours(self, world: World, theme: Theme) -> Packed:
        if not self._groups:
            # Steps of the golden ratio keep each new group far from the earlier ones, for any number of groups.
            return hues(theme.dark)[shade((world.group_number * GOLDEN % 1.0 * STEPS).astype(np.uint32))]
        result = np.full(len(world), 0x9A9A9A, dtype=np.uint32)
        for k, group in enumerate(self._groups):
            check_home(f"groups[{k}]", group, world._state)
            step = np.full(len(group), k * STEPS // max(len(self._groups), 1))
            result[members(group)] = hues(theme.dark)[shade(step)]
        return result


class Fixed(Colouring):
    """Fixed colours given by the user.

    Args:
        rgb: (n, 3) from 0 to 255, a row for each circle in the order they were added, or (3,) for all.
    """

    def __init__(self, rgb: ArrayLike) -> None:
        array: NDArray[Any] = np.asarray(rgb)
        if array.ndim not in (1, 2) or array.shape[-1] != 3:
            raise InputError(f"rgb has shape {array.shape}; allowed is (n, 3), a row R, G, B for each circle, or (3,)")
        if array.dtype.kind not in "iuf" or not ((array >= 0) & (array <= 255)).all():
            raise InputError("rgb holds something else than numbers from 0 to 255; allowed are these")
        self._packed = packed(array)

    def colours(self, world: World, theme: Theme) -> Packed:
        if self._packed.ndim and len(self._packed) != len(world):
            raise InputError(f"rgb has {len(self._packed)} rows; allowed are {len(world)}, one for each circle")
        return np.ascontiguousarray(np.broadcast_to(self._packed, len(world)))


COLOURINGS: dict[str, type[Colouring]] = {
    "order": ByOrigin, "speed": BySpeed, "mass": ByMass, "group": Groups, "energy": ByEnergy,
}  # fmt: skip
"""Colourings that find their scale themselves, by their names on pages."""


def by_force(force: NDArray[Any], theme: Theme) -> Packed:
    """(m,) colours of links by the size of their force, N: from slack to three times the typical one."""
    load = np.abs(force)
    usual = float(load.mean()) if len(load) else 0.0
    return heat(theme.dark)[_steps(load, 0.0, USUAL_MULTIPLE * usual) * TONES]


def _steps(value: NDArray[Any], low: float, high: float) -> NDArray[np.int64]:
    """Steps of a palette from `low` to `high`, clamped. NaN: the first."""
    share = (value - low) * ((STEPS - 1) / (high - low)) if high > low else np.zeros(len(value))
    return np.nan_to_num(np.clip(share, 0, STEPS - 1)).astype(np.int64)
