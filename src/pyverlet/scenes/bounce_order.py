"""The same two lines in two orders, side by side."""

from __future__ import annotations

from pyverlet.laws.integrators import ExplicitEuler, SemiImplicitEuler
from pyverlet.scenes import _drop
from pyverlet.scenes._scene import Scene, Settings, Variant
from pyverlet.world.world import World


def build(settings: Settings) -> World:
    """Left: position, then velocity (explicit Euler). Right: velocity, then position (semi-implicit Euler).

    The articles: swapped, the lines lose energy instead of gaining it. Half true: explicit Euler gains, but semi-implicit
    Euler loses nothing in flight. It keeps v^2/2 + g y - (h/2) g v to rounding, and only the wall's clamp-and-flip takes from it.
    """
    return _drop.drop(settings)


SCENE = Scene(
    "bounce-order",
    "the same two lines swapped: position or velocity first",
    build,
    _drop.settings(SemiImplicitEuler()),
    variants=(
        Variant("position first", {"integrator": ExplicitEuler()}),
        Variant("velocity first", {"integrator": SemiImplicitEuler()}),
    ),
    line=_drop.HEIGHT,
)
