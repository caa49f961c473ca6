"""Says once that float32 is too coarse for particles that rest so far from the origin."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.ground.errors import CoarseCoordinatesWarning

FRAMES = 20
"""Between looks."""

TREMBLE = 0.03
"""Rounding moves what rests by eps x a substep, which is eps x / h of speed: calm is less than this part of sqrt(g r)."""

ROUGH = 0.02
"""Part of the radius by which coordinates may be rounded."""


def precise_up_to(radius: NDArray[Any], gravity: float, h: float, dtype: np.dtype[Any]) -> NDArray[np.float64]:
    """(n,) m from the origin up to which circles of these radii rest calmly under gravity, m/s^2, with substeps of h, s."""
    r = radius.astype(np.float64)
    return np.asarray(np.minimum(TREMBLE * h * np.sqrt(gravity * r), ROUGH * r) / float(np.finfo(dtype).eps))


class Precision:
    """Looks now and then for particles that rest far from the origin: three times, for those that fall do not matter."""

    def __init__(self) -> None:
        self._said = False
        self._seen: list[tuple[float, NDArray[Any], NDArray[Any]]] = []

    def look(self, world: Any, h: float) -> None:
        """After a frame in substeps of h seconds.

        Warns:
            CoarseCoordinatesWarning: once for a world of float32, if one beyond `precise_up_to` is held up against gravity.
        """
        if self._said or world.frames % FRAMES or world.dtype != np.float32 or not len(world):
            return
        gravity, known = float(np.hypot(*world.gravity)), world._state.shown
        precise = precise_up_to(known["radius"].min(keepdims=True), gravity, h, world.dtype)[0]
        if not gravity or not np.abs(known["position"]).max() > precise:
            self._seen = []
            return
        where = np.abs(known["position"]).max(axis=1)
        self._seen = [*self._seen[-2:], (world.time, world._state.number.copy(), world.position.astype(float))]
        if len(self._seen) < 3:
            return
        (t0, first, x0), (t1, second, x1), (t2, third, x2) = self._seen
        if not (np.array_equal(first, second) and np.array_equal(second, third) and abs(t2 - 2 * t1 + t0) < 1e-6 * (t2 - t0)):
            return
        bent = np.hypot(*(x2 - 2 * x1 + x0).T)  # g (t1 - t0)^2 of what falls freely
        still = np.hypot(*(x2 - x0).T) < gravity * (t2 - t0) ** 2
        limit = precise_up_to(world.radius, gravity, h, world.dtype)
        held = (bent < 0.5 * gravity * (t1 - t0) ** 2) & still & np.isfinite(world.mass) & (where > limit)
        if held.any():
            self._said = True
            k = int(np.argmax(np.where(held, where / limit, 0.0)))
            warnings.warn(
                f"particle {k} of radius {world.radius[k]:.3g} m rests {where[k]:.3g} m from the origin, where float32 "
                f"coordinates are too coarse for it to be calm; allowed are {limit[k]:.2g} m, or a world with dtype=float64",
                CoarseCoordinatesWarning,
                stacklevel=3,  # who has called World.step
            )
