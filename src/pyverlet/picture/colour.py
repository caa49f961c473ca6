"""What a circle's colour says: where it started, how fast or heavy it is, which group it belongs to, or what it was given."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.ground.shown import Shown
from pyverlet.picture.palette import STEPS, TONES, Packed, Theme, heat, hues, packed, shade
from pyverlet.state.group import Group

USUAL_S = 1 / 3  # simulated seconds over which the scale follows what is usual: no flicker, at any number of pictures a second
USUAL_MULTIPLE = 3.0  # the end of the palette, in terms of what is usual
GOLDEN = 0.6180339887498949  # (sqrt(5) - 1) / 2


class Circles(Protocol):
    """What colours are made from: a world, or a copy of what it was at some moment."""

    @property
    def velocity(self) -> NDArray[Any]:
        """(n, 2) m/s."""

    @property
    def mass(self) -> NDArray[Any]:
        """(n,) kg, infinite where pinned."""

    @property
    def group_number(self) -> NDArray[Any]:
        """(n,) of whole numbers, the same for those that were added together."""

    @property
    def time(self) -> float:
        """Of the world, s."""

    def __len__(self) -> int:
        """How many."""


class Colouring(Shown, ABC):
    """Gives every circle of a world a colour, picture after picture."""

    @abstractmethod
    def colours(self, world: Circles, theme: Theme) -> Packed:
        """(n,) colours, R + G << 8 + B << 16, of the world's circles now."""


class ByOrigin(Colouring):
    """Through the hues in the order the circles were added: scenes fill their room from the bottom up."""

    def colours(self, world: Circles, theme: Theme) -> Packed:
        n = len(world)
        return hues(theme.dark)[shade(np.arange(n) * STEPS // max(n, 1))]


class _ByAmount(Colouring):
    """From little to much of something that is 0 at rest.

    Args:
        full: the amount at the end of the palette; None follows three times what is usual.
    """

    def __init__(self, *, full: float | None = None) -> None:
        self._full = None if full is None else checks.number("full", full, above=0.0)
        self._usual, self._time = 0.0, -np.inf

    @abstractmethod
    def _amount(self, world: Circles) -> NDArray[Any]:
        """(n,) of each circle, finite."""

    def colours(self, world: Circles, theme: Theme) -> Packed:
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
    """From slow to fast.

    Args:
        full: m/s at the end of the palette; None follows three times the usual speed.
    """

    def _amount(self, world: Circles) -> NDArray[Any]:
        return np.asarray(np.hypot(*world.velocity.T))


class ByEnergy(_ByAmount):
    """From little to much kinetic energy, m v^2 / 2; pinned circles have none.

    Args:
        full: J at the end of the palette; None follows three times the usual energy.
    """

    def _amount(self, world: Circles) -> NDArray[Any]:
        x, y = world.velocity.T
        return np.asarray(np.where(np.isfinite(world.mass), 0.5 * world.mass * (x * x + y * y), 0.0))


class ByMass(Colouring):
    """From light to heavy, over equal ratios; pinned circles stand at the end."""

    def colours(self, world: Circles, theme: Theme) -> Packed:
        logarithm = np.log(world.mass.astype(np.float64))
        finite = logarithm[np.isfinite(logarithm)]
        low, high = (finite.min(), finite.max()) if len(finite) else (0.0, 0.0)
        return heat(theme.dark)[shade(_steps(logarithm, low, high))]


class Groups(Colouring):
    """One hue for each group.

    Args:
        groups: what `world.add` returned; circles in none of them are grey. Without any, all groups of the world.
    """

    def __init__(self, *groups: Group) -> None:
        for k, group in enumerate(groups):
            if not isinstance(group, Group):
                raise InputError(f"groups[{k}] is {group!r}; allowed is what world.add returns")
        self._groups = groups

    def colours(self, world: Circles, theme: Theme) -> Packed:
        if not self._groups:
            # Steps of the golden ratio: however many groups there are, or come later, each is far from those before it.
            return hues(theme.dark)[shade((world.group_number * GOLDEN % 1.0 * STEPS).astype(np.uint32))]
        result = np.full(len(world), 0x9A9A9A, dtype=np.uint32)
        for k, group in enumerate(self._groups):
            step = np.full(len(group), k * STEPS // max(len(self._groups), 1))
            result[group.index] = hues(theme.dark)[shade(step)]
        return result


class Fixed(Colouring):
    """Colours of the user's own, which stay.

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

    def colours(self, world: Circles, theme: Theme) -> Packed:
        if self._packed.ndim and len(self._packed) != len(world):
            raise InputError(f"rgb has {len(self._packed)} rows; allowed are {len(world)}, one for each circle")
        return np.ascontiguousarray(np.broadcast_to(self._packed, len(world)))


COLOURINGS: dict[str, type[Colouring]] = {
    "order": ByOrigin, "speed": BySpeed, "mass": ByMass, "group": Groups, "energy": ByEnergy,
}  # fmt: skip
"""Those that find their scale themselves, by the names that pages have for them."""


def by_force(force: NDArray[Any], theme: Theme) -> Packed:
    """(m,) colours of links by how hard they pull or push, N: from slack to three times the usual."""
    load = np.abs(force)
    usual = float(load.mean()) if len(load) else 0.0
    return heat(theme.dark)[_steps(load, 0.0, USUAL_MULTIPLE * usual) * TONES]


def _steps(value: NDArray[Any], low: float, high: float) -> NDArray[np.int64]:
    """Steps of a palette from `low` to `high`; beyond, its ends. NaN: its start."""
    share = (value - low) * ((STEPS - 1) / (high - low)) if high > low else np.zeros(len(value))
    return np.nan_to_num(np.clip(share, 0, STEPS - 1)).astype(np.int64)
