"""Boulders fall onto a bridge that hangs between two cliffs."""

import numpy as np

from pyverlet.laws.boundaries import Box
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world import builders
from pyverlet.world.world import World

PLANKS = 40  # of the bridge; fewer with few particles
LEAST = 8  # particles: a few planks between two fixed ones, and a boulder
SPAN = 24.0  # between the cliffs, m
ROCK = 0.3  # root mean square radius of the boulders, m


def build(settings: Settings) -> World:
    """A deck of planks, fixed at both ends, catches boulders of mixed sizes; the rest rolls off over its edges.

    The deck is a rope and is solved as a whole: it does not stretch under any load. Colours in a window or a film show the
    tension.
    """
    settings.require(LEAST, "rope-bridge")
    planks = min(PLANKS, settings.particles // 2)
    rocks = settings.particles - planks - 2
    rng, radii = settings.draw_radii(ROCK, rocks)
    width, height = 0.7 * SPAN, 1.0
    while (centres := _start.in_box(rng, radii, width, height)) is None:
        height *= 1.2
    world = settings.empty_world(Box((-0.6 * SPAN, -8.0), (0.6 * SPAN, height + 3.0), **settings.surface))
    builders.bridge(world, (-SPAN / 2, 0.0), (SPAN / 2, 0.0), planks=planks, mass=2.0 * planks, slack=0.05)
    world.add(position=centres + np.array([0.0, 2.0]), radius=radii, mass=(radii / ROCK) ** 2)
    return world


SCENE = Scene(
    "rope-bridge", "boulders fall onto a bridge that hangs between two cliffs", build,
    Settings(particles=400, restitution=0.2, friction=0.5, radius_spread=2.0),
)  # fmt: skip
