"""Thousands of circles fall into a heap inside a circular cage: the default scene, and the benchmark."""

import numpy as np

from pyverlet.laws.boundaries import Circle
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

RADIUS = 0.5  # root mean square radius of the circles, m; that of each if radius_spread is 1
AREA_FRACTION = 0.6  # fraction of the cage's area that circles cover
GROWTH = 1.01  # factor by which the cage grows until a few circles fit it: two equal ones cover half at most


def build(settings: Settings) -> World:
    """N circles of radius 0.5 m fall inside a circular cage of radius sqrt(0.25 N / 0.6) m.

    They cover 60 % of its area and start on a slightly shaken lattice that fills it. Restitution and friction are 0, so they end
    in a heap at rest at the bottom. With a radius_spread the radii are drawn uniformly and scaled so that the area stays the
    same; masses are proportional to the area, 1 kg at 0.5 m. If a few circles do not fit 60 % of a cage, it is slightly larger.
    """
    rng, radii = settings.draw_radii(RADIUS)
    cage_radius = RADIUS * np.sqrt(settings.particles / AREA_FRACTION)
    while (centres := _start.in_circle(rng, radii, cage_radius)) is None:
        cage_radius *= GROWTH
    world = settings.empty_world(Circle(center=(0, 0), radius=cage_radius, **settings.surface))
    world.add(position=centres, velocity=0.0, radius=radii, mass=(radii / RADIUS) ** 2)
    return world


SCENE = Scene("cage", "5,000 circles fall into a heap inside a circular cage", build)
