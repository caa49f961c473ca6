"""What touching circles push each other with, for pictures: found a little better with every frame that is looked at.

`Touches` finds the exact answer for one frame, which takes seconds for thousands of circles. A picture is looked at again
and again: here the pushes of the frame before are where the search goes on, by accelerated projected gradients (Beck, Teboulle
2009), and what flickers from frame to frame is averaged.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.laws.touches import Noted

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

STEPS = 60
"""Of the search, each time."""

NEAR = 0.02
"""Of the radii: pairs that are farther apart do not touch."""

NEW = 0.4
"""Weight of what a new frame says: pushes follow within a few looks, and do not flicker."""


class Pushes(NamedTuple):
    """Contacts of a moment."""

    pairs: Indices
    """(m, 2) numbers of the circles; twice the same where a circle leans on a wall or an obstacle."""
    force: Floats
    """(m,) N, what pushes them apart."""
    angle: Floats
    """(m,) rad, of the normal out of the first."""


class Network:
    """The contacts of one world, look after look."""

    def __init__(self) -> None:
        self._keys: Indices = np.zeros(0, np.int64)
        self._force: Floats = np.zeros(0)

    def look(self, noted: Noted) -> Pushes:
        """What is known after another frame."""
        a, b = noted.pairs.T
        way = noted.position[b] - noted.position[a]
        apart = np.hypot(*way.T)
        near = (apart <= (1 + NEAR) * (noted.radius[a] + noted.radius[b])) & (noted.free[a] | noted.free[b]) & (apart > 0)
        a, b, normal = a[near], b[near], way[near] / apart[near, None]
        keys = noted.number[a] * (1 << 32) + noted.number[b]
        start = self._remembered(keys)
        got = np.where(noted.free[:, None], noted.got[0], 0.0) / noted.dt
        force = start + NEW * (_solved(a, b, normal, got, noted.free, start) - start)
        order = np.argsort(keys, kind="stable")
        self._keys, self._force = keys[order], force[order]
        leaning = [_leaning(noted, whose) for whose in (1, 2)]
        pairs = np.concatenate((np.column_stack((noted.number[a], noted.number[b])), *(each.pairs for each in leaning)))
        angle = np.concatenate((np.arctan2(normal[:, 1], normal[:, 0]), *(each.angle for each in leaning)))
        return Pushes(pairs, np.concatenate((force, *(each.force for each in leaning))), angle)

    def _remembered(self, keys: Indices) -> Floats:
        if not len(self._keys):
            return np.zeros(len(keys))
        where = np.searchsorted(self._keys, keys).clip(max=len(self._keys) - 1)
        return np.where(self._keys[where] == keys, self._force[where], 0.0)


def _leaning(noted: Noted, whose: int) -> Pushes:
    """What the room (1) or obstacles (2) push each circle with: all of it is known, if not by which of several walls."""
    got = noted.got[whose] / noted.dt
    who = np.flatnonzero((got != 0).any(axis=1) & noted.free)
    x, y = -got[who].T  # out of the circle, against what pushes it
    return Pushes(np.column_stack((noted.number[who], noted.number[who])), np.hypot(x, y), np.arctan2(y, x))


def _solved(a: Indices, b: Indices, normal: Floats, got: Floats, free: NDArray[np.bool_], start: Floats) -> Floats:
    """(m,) pushes p >= 0 along the normals that explain what each circle has got, as near as STEPS come from `start`."""
    if not len(a):
        return start
    n, (nx, ny) = len(got), np.ascontiguousarray(normal.T)

    def left(p: Floats) -> Floats:
        """(n, 2) what p does not explain."""
        x, y = p * nx, p * ny
        pushed = np.column_stack((np.bincount(b, x, n) - np.bincount(a, x, n), np.bincount(b, y, n) - np.bincount(a, y, n)))
        return np.asarray((got - pushed) * free[:, None])

    # Twice the most contacts that a circle has bounds the curvature (Gershgorin).
    step = 1.0 / (2.0 * max(np.bincount(a, minlength=n).max(), np.bincount(b, minlength=n).max()) + 2.0)
    p, ahead, t = start, start, 1.0
    for _ in range(STEPS):
        rest = left(ahead)
        slope = (rest[b, 0] - rest[a, 0]) * nx + (rest[b, 1] - rest[a, 1]) * ny
        following = np.maximum(ahead + step * slope, 0.0)
        t, before = 0.5 * (1 + (1 + 4 * t * t) ** 0.5), t
        ahead, p = following + (before - 1) / t * (following - p), following
    return p
