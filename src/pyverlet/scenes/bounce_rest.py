"""Semi-implicit Euler and clamp-and-flip from rest: the lucky case."""

from __future__ import annotations

from pyverlet.laws.integrators import SemiImplicitEuler
from pyverlet.scenes import _drop
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

GRAVITY = -2857 / 2**20 * 3600
"""9.8087 m/s^2: g h^2 is a whole number of 2^-20 m at 60 steps a second, so that nothing is rounded."""


def build(settings: Settings) -> World:
    """A ball let go at rest returns to the same height after every bounce but the first.

    The articles: from rest the method conserves energy. It is a coincidence: from rest all speeds are whole multiples of g h,
    the first clamp puts the heights above the wall on whole multiples of g h^2, and from then on a fall touches the wall exactly
    at the end of a step. One step later, at the largest depth there is, clamp-and-flip takes nothing. The gravity here makes
    all of this exact; with 9.81 it is rounding that decides which bounce loses. See `bounce-random` for any other start.
    """
    return _drop.drop(settings)


SCENE = Scene(
    "bounce-rest",
    "from rest, clamp-and-flip seems to keep the energy",
    build,
    _drop.settings(SemiImplicitEuler(), gravity=(0.0, GRAVITY)),
    line=_drop.HEIGHT,
)
