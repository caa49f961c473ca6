"""Views: the part of the plane in a picture, from metres to pixels and back, and picking with the mouse."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.world.world import World

Rect = tuple[float, float, float, float]  # x0, y0, x1, y1 in metres


@dataclass(frozen=True)
class View:
    """A window on the plane. Immutable: `moved` and `zoomed` return new views.

    Attributes:
        left, top: position of the window's upper left corner, m.
        scale: pixels per metre.
        width, height: of the window, pixels.
        y_up: False if pixels count downward from the top (pygame, pictures), True if upward from the bottom (pyglet, arcade).
    """

    left: float
    top: float
    scale: float
    width: int
    height: int
    y_up: bool = False

    @classmethod
    def fit(cls, rect: Rect, size: tuple[int, int], *, y_up: bool = False) -> Self:
        """The view with `rect` (x0, y0, x1, y1 in metres) in the middle, as large as `size` (pixels) allows."""
        x0, y0, x1, y1 = (checks.number("rect", value) for value in rect)
        if not (x0 < x1 and y0 < y1):
            raise InputError(f"rect is {rect}; allowed is (x0, y0, x1, y1) with x0 < x1 and y0 < y1")
        width, height = (checks.integer("size", value) for value in size)
        scale = min(width / (x1 - x0), height / (y1 - y0))
        left = 0.5 * (x0 + x1) - 0.5 * width / scale
        return cls(left, 0.5 * (y0 + y1) + 0.5 * height / scale, scale, width, height, y_up)

    def to_screen(self, point: ArrayLike) -> NDArray[np.float64]:
        """Pixels of a point (2,) or of points (n, 2) in metres."""
        metres = np.asarray(point, dtype=np.float64)
        down = (self.top - metres[..., 1]) * self.scale
        return np.stack(((metres[..., 0] - self.left) * self.scale, self.height - down if self.y_up else down), axis=-1)

    def to_world(self, pixel: ArrayLike) -> NDArray[np.float64]:
        """Metres of a pixel (2,) or of pixels (n, 2)."""
        pixels = np.asarray(pixel, dtype=np.float64)
        down = self.height - pixels[..., 1] if self.y_up else pixels[..., 1]
        return np.stack((self.left + pixels[..., 0] / self.scale, self.top - down / self.scale), axis=-1)

    def moved(self, pixels: tuple[float, float]) -> Self:
        """The view after dragging the picture by so many pixels."""
        dx, dy = pixels
        down = -dy if self.y_up else dy
        return replace(self, left=self.left - dx / self.scale, top=self.top + down / self.scale)

    def zoomed(self, factor: float, pixel: ArrayLike) -> Self:
        """The view magnified by `factor`, with the point under `pixel` fixed."""
        factor = checks.number("factor", factor, above=0.0)
        x, y = (float(value) for value in self.to_world(pixel))
        return replace(self, left=x + (self.left - x) / factor, top=y + (self.top - y) / factor, scale=self.scale * factor)

    def pick(self, world: World, pixel: ArrayLike, *, reach: float = 9.0) -> int | None:
        """The particle under a pixel, or the nearest whose rim is within `reach` pixels of it; None if there is none."""
        return nearest(world, self.to_world(pixel), reach / self.scale)


def nearest(world: World, point: NDArray[Any], reach: float) -> int | None:
    """The particle whose rim is nearest to `point` (2,), if within `reach`; metres. Inside a circle the distance is negative."""
    if not len(world):
        return None
    x, y = world.boundary.periodic.nearest(world.position - np.asarray(point, dtype=world.position.dtype)).T
    gap = np.hypot(x, y) - world.radius
    found = int(np.argmin(gap))
    return found if gap[found] <= reach else None
