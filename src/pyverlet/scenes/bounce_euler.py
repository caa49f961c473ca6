"""The first sketch of all: explicit Euler, and a ball that climbs."""

from __future__ import annotations

from pyverlet.laws.integrators import ExplicitEuler
from pyverlet.scenes import _drop
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World


def build(settings: Settings) -> World:
    """One ball bounces on the floor with e = 1 and climbs higher and higher.

    The articles: explicit Euler gains energy. True, and how much is known: position first, with the old velocity, gains
    m g^2 h^2 / 2 in every step of free fall, whatever the ball does; 0.8 J a second and kilogram at 60 steps a second.
    """
    return _drop.drop(settings)


SCENE = Scene(
    "bounce-euler",
    "explicit Euler: one ball bounces higher and higher",
    build,
    _drop.settings(ExplicitEuler()),
    line=_drop.HEIGHT,
)
