"""Circles of mixed sizes thrown about inside a box, until friction and restitution bring them to rest."""

import numpy as np

from pyverlet.laws.boundaries import Box
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

RADIUS = 0.5  # root mean square radius of the circles, m
AREA_FRACTION = 0.35  # fraction of the box's area that circles cover
ASPECT = 16 / 9  # width / height of the box
SPEED = 3.0  # initial standard deviation of each velocity component, m/s


def build(settings: Settings) -> World:
    """2,000 circles of mixed radii in a box, with sizes of up to 1:3, thrown in every direction.

    They cover 35 % of the box, bounce with half their speed, have friction with each other and the walls, and come to rest.
    Masses are proportional to the area, 1 kg at a radius of 0.5 m.
    """
    rng, radii = settings.draw_radii(RADIUS)
    area = np.pi * float(radii @ radii) / AREA_FRACTION
    # A single large circle must fit between floor and ceiling; otherwise rows of circles determine the height.
    height = max(float(np.sqrt(area / ASPECT)), 2.2 * float(radii.max()))
    width = max(area / height, 2.2 * float(radii.max()))
    while (centres := _start.in_box(rng, radii, width, height)) is None:
        height *= 1.05
    world = settings.empty_world(Box((-width / 2, 0), (width / 2, height), **settings.surface))
    velocity = rng.normal(0.0, SPEED, (settings.particles, 2))
    world.add(position=centres, velocity=velocity, radius=radii, mass=(radii / RADIUS) ** 2)
    return world


SCENE = Scene(
    "box", "2,000 circles of mixed sizes bounce about a box and come to rest", build,
    Settings(particles=2_000, restitution=0.5, friction=0.2, radius_spread=3.0),
)  # fmt: skip
