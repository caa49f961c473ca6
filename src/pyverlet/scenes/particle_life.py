"""Particle life: kinds that attract, repel and chase each other form lifelike shapes (after Ventrella's Clusters, 2007)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pyverlet.laws.boundaries import Periodic
from pyverlet.laws.forces import Drag, PairForce
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

KINDS, RADIUS, RANGE = 6, 0.06, 1.0  # number of kinds; radius and range of a particle, m
NEIGHBOURS = 35  # average number within the range
PULL, FRICTION = 12.0, 20.0  # largest force between two of 1 kg, N, and N s/m: a viscous medium


class Likings(PairForce):
    """Force on i by j: repulsion within 0.3 of the range, beyond it likes[kind of i, kind of j] times a triangle function.

    F = pull (1 - r / 0.3) for r < 0.3, else -pull likes (1 - |2 r - 1.3| / 0.7), with r in ranges. likes is not symmetric: one
    kind may chase another that flees it, and momentum is not conserved.

    Args:
    likes: (k, k) from -1 to 1. kind: (n,) of each particle; later ones have the last one's kind. pull: N. range: m.
    """

    _shows = ("likes", "kind", "pull", "range")

    symmetric = False

    def __init__(self, *, likes: ArrayLike, kind: ArrayLike, pull: float, range: float) -> None:  # noqa: A002
        self.likes, self.kind = np.asarray(likes, float), np.asarray(kind, np.int64)
        self.pull, self.range = pull, range

    def force(self, distance: NDArray[Any], i: NDArray[Any], j: NDArray[Any]) -> NDArray[Any]:
        r = distance / self.range
        first, second = (self.kind.take(which, mode="clip") for which in (i, j))
        liked = -self.likes[first, second] * (1.0 - np.abs(2.0 * r - 1.3) / 0.7)
        return np.asarray(self.pull * np.where(r < 0.3, 1.0 - r / 0.3, liked))

    def renumber(self, now: NDArray[Any]) -> None:
        """After particles were removed: the others keep their kind."""
        kept = self.kind[now[: len(self.kind)] >= 0]
        self.kind = kept if len(kept) else self.kind[-1:]

    def save(self) -> NDArray[Any]:
        """The kinds of all particles."""
        return self.kind

    def restore(self, saved: NDArray[Any]) -> None:
        """Set the kinds that `save` returned."""
        self.kind = saved


def build(settings: Settings) -> World:
    """1,500 particles of six kinds in a viscous medium; the seed determines which kinds attract each other, not mutually.

    They form cells with skins, worms and pairs that chase each other for ever: the forces are not equal and opposite, so that
    their work never ends. Each seed is a different world.
    """
    rng = np.random.default_rng(settings.seed)
    count = settings.particles
    side = max(float(np.sqrt(np.pi * RANGE**2 * count / NEIGHBOURS)), 2.1 * RANGE)
    centres = _start.in_box(rng, np.full(count, RADIUS), side, side)
    assert centres is not None
    world = settings.empty_world(Periodic((-side / 2, 0), (side / 2, side)))
    centres = rng.permutation(centres)
    kind = np.arange(count) * KINDS // count
    for each in range(KINDS):  # a group each, for colours
        if (kind == each).any():
            world.add(position=centres[kind == each], radius=RADIUS)
    likes = rng.uniform(-1, 1, (KINDS, KINDS))
    likes[np.diag_indices(KINDS)] = rng.uniform(0, 1, KINDS)  # each attracts its own kind, so that they gather
    world.forces += [Likings(likes=likes, kind=kind, pull=PULL, range=RANGE), Drag(linear=FRICTION)]
    return world


SCENE = Scene(
    "particle-life", "six kinds of particles that like, flee and chase each other", build,
    Settings(particles=1_500, substeps=1, gravity=(0.0, 0.0), collisions=None),
)  # fmt: skip
