"""Warns once if float32 is too coarse for particles that rest, touch or move so far from the origin."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pyverlet.common.errors import CoarseCoordinatesWarning

FRAMES = 20
"""Frames between checks."""

TREMBLE = 0.03
"""Rounding moves a resting particle by eps x per substep, a speed of eps x / h: at most this fraction of sqrt(g r)."""

ROUGH = 0.02
"""Largest rounding of coordinates of touching circles, over the radius."""

DRIFT, MOVES = 0.05, 0.05
"""Largest deviation by rounding between two checks, over the distance moved; and the distance that counts as motion, in radii."""


def precise_up_to(radius: NDArray[Any], gravity: float, h: float, dtype: np.dtype[Any]) -> NDArray[np.float64]:
    """(n,) m from the origin up to which circles of these radii rest under gravity, m/s^2, with substeps of h, s."""
    r = radius.astype(np.float64)
    at_rest = TREMBLE * h * np.sqrt(gravity * r) if gravity else np.inf
    return np.asarray(np.minimum(at_rest, ROUGH * r) / float(np.finfo(dtype).eps))


def fine_up_to(state: Any, gravity: float, h: float, substeps: int) -> float:
    """m from the origin up to which coordinates are precise enough for everything in a world."""
    if state.dtype != np.float32 or not len(state.radius):
        return np.inf
    least = state.radius.min(keepdims=True)
    moves = DRIFT * MOVES * float(least[0]) / (FRAMES * substeps * float(np.finfo(state.dtype).eps))
    return min(float(precise_up_to(least, gravity, h, state.dtype)[0]), np.inf if gravity else moves)


def _drift(known: dict[str, NDArray[Any]], h: float, count: int) -> NDArray[np.float64]:
    """(n,) deviation of moving particles by rounding in so many substeps of h seconds, over what ASTRAY allows.

    In steady motion all rounding errors are equal, in accelerated motion they are random.
    """
    spacing = np.spacing(np.abs(known["position"])).astype(float)
    way, evenly = np.abs(known["velocity"].astype(float)) * h, np.abs(known["acceleration"]) * (count * h * h) < spacing
    rounded = np.abs(np.rint(way / spacing) * spacing - way)
    error = np.hypot(*np.where(evenly, count * rounded, spacing * np.sqrt(count / 12.0)).T)
    whole = count * np.hypot(*way.T)  # a fast fall may have a slow sideways drift
    return np.asarray(np.divide(error, DRIFT * whole, out=np.zeros_like(error), where=whole > MOVES * known["radius"]))


class Precision:
    """Checks now and then for particles too far from the origin; three times for resting ones, as falling ones do not matter."""

    def __init__(self) -> None:
        self._said = False
        self._seen: list[tuple[float, int, NDArray[Any]]] = []  # of the last two checks

    def look(self, world: Any, h: float) -> None:
        """Check the particles after a frame in substeps of h seconds.

        Warns:
            CoarseCoordinatesWarning: once for a world of float32, if a particle is supported against gravity beyond
                `precise_up_to`, touches others where coordinates are rounded by ROUGH of its radius, or moves without gravity
                where they deviate by ASTRAY.
        """
        if self._said or world.frames % FRAMES or world.dtype != np.float32 or not len(world):
            return
        gravity, known = float(np.hypot(*world.gravity)), world._state.shown
        if not np.abs(known["position"]).max() > fine_up_to(world._state, gravity, h, world.substeps):
            self._seen = []
            return
        where, free = np.abs(known["position"]).max(axis=1).astype(float), np.isfinite(world.mass)
        rests = self._rests(world, gravity) if gravity else np.zeros(len(world), bool)
        if rests is None:
            return
        at_rest = precise_up_to(known["radius"], gravity, h, world.dtype)
        touching = precise_up_to(known["radius"], 0.0, h, world.dtype) if world.collisions else np.full(len(where), np.inf)
        # Under gravity slow particles lie in a heap, where contacts correct them.
        drift = np.zeros(len(world)) if gravity else _drift(known, h, FRAMES * world.substeps)
        moving = where / np.maximum(drift, 1e-300)
        for does, limit, which in (("rests", at_rest, rests), ("moves", moving, ~rests), ("may touch others", touching, ~rests)):
            self._warn(does, where, limit, which & free & (where > limit), known["radius"])

    def _rests(self, world: Any, gravity: float) -> NDArray[np.bool_] | None:
        """(n,) which are supported against gravity, by the last three checks; None if these are not sufficient."""
        looks = [*self._seen, (world.time, world._state.version, world._state.shown["position"].copy())]
        self._seen = looks[-2:]
        if len(looks) < 3:
            return None
        (t0, first, x0), (t1, second, x1), (t2, third, now) = looks
        if not (first == second == third and abs(t2 - 2 * t1 + t0) < 1e-6 * (t2 - t0)):
            return None
        x2 = now.astype(float)
        bent = np.hypot(*(x2 - 2 * x1 + x0).T)  # g (t1 - t0)^2 in free fall
        still = np.hypot(*(x2 - x0).T) < gravity * (t2 - t0) ** 2
        return np.asarray((bent < 0.5 * gravity * (t1 - t0) ** 2) & still)

    def _warn(
        self, does: str, where: NDArray[Any], limit: NDArray[Any], coarse: NDArray[np.bool_], radius: NDArray[Any]
    ) -> None:  # fmt: skip
        """Warn of the worst of the particles with too coarse coordinates, unless there is none or a warning was issued."""
        if self._said or not coarse.any():
            return
        self._said = True
        k = int(np.argmax(np.where(coarse, where / limit, 0.0)))
        warnings.warn(
            f"particle {k} of radius {radius[k]:.3g} m {does} {where[k]:.3g} m from the origin, where float32 coordinates are "
            f"too coarse for that; allowed are {limit[k]:.2g} m, or a world with dtype=float64",
            CoarseCoordinatesWarning,
            stacklevel=4,  # the caller of World.step
        )
