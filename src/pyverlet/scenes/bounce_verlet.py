"""Position Verlet at a wall: flipped, projected, and reflected when it was met."""

from __future__ import annotations

from pyverlet.laws.integrators import PositionVerlet
from pyverlet.laws.naive import ProjectOnly
from pyverlet.laws.rooms import Box
from pyverlet.scenes import _drop
from pyverlet.scenes._scene import Scene, Settings, Variant
from pyverlet.world.world import World


def build(settings: Settings) -> World:
    """Position Verlet with the wall of the sketches, with projection alone, and with the real wall.

    The articles: Verlet takes the bouncing into account. It does not: putting the position back leaves x - x_prev = 0 a step
    later, a restitution of exactly 0. A bounce needs a stated coefficient: clamp-and-flip has one but errs by up to a step at
    the impact, the wall on the right finds the moment of the impact and keeps the height.
    """
    return _drop.drop(settings)


def _projected(settings: Settings) -> World:
    box = _drop.room(settings)
    return _drop.drop(settings, boundary=ProjectOnly(Box(box.lower, box.upper)))


def _reflected(settings: Settings) -> World:
    return _drop.drop(settings, boundary=_drop.room(settings))


SCENE = Scene(
    "bounce-verlet",
    "position Verlet: clamp-and-flip, projection alone, and a real wall",
    build,
    _drop.settings(PositionVerlet()),
    variants=(
        Variant("clamp and flip"),
        Variant("projection alone", build=_projected),
        Variant("moment of impact", build=_reflected),
    ),
    line=_drop.HEIGHT,
)
