"""Semi-implicit Euler and clamp-and-flip from a random velocity: the usual case."""

from __future__ import annotations

import numpy as np

from pyverlet.laws.integrators import SemiImplicitEuler
from pyverlet.scenes import _drop
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

SPEED = 2.0
"""Standard deviation of each component of the starting velocity, m/s."""


def build(settings: Settings) -> World:
    """Balls thrown at random bounce lower and lower, although e = 1.

    The articles: semi-implicit Euler loses energy. The method does not, the wall does: found a depth d below it with speed w,
    a ball that is put back and turned round has lost m g (w h - d), and d is anything from 0 to w h.
    """
    velocity = np.random.default_rng(settings.seed).normal(0.0, SPEED, (settings.particles, 2))
    return _drop.drop(settings, velocity=velocity)


SCENE = Scene(
    "bounce-random",
    "thrown at random, balls lose energy at every clamp-and-flip",
    build,
    _drop.settings(SemiImplicitEuler(), particles=5),
    line=_drop.HEIGHT,
)
