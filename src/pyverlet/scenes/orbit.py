"""A disc of small bodies around a star: the inner ones run ahead, by Kepler's third law."""

import numpy as np

from pyverlet.laws.boundaries import Open
from pyverlet.laws.forces import Attractor
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

STRENGTH = 200.0  # G M of the star, m^3/s^2: at 10 m an orbit takes 14 s
INNER = 6.0  # radius of the innermost orbit, m
RADIUS = 0.1  # of the bodies, m
SPACING = 0.35  # of the bodies, m: each has about its square as area
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # angle between successive bodies, which spreads them evenly, as in a sunflower
SPREAD = 0.002  # relative standard deviation of the speeds


def build(settings: Settings) -> World:
    """3,000 bodies circle a star, each on its own nearly circular orbit: T^2 = 4 pi^2 a^3 / (G M).

    Neighbours at different distances drift apart, and the even disc winds up into spirals. The bodies pass through each other;
    only the star attracts them.
    """
    rng = np.random.default_rng(settings.seed)
    number = np.arange(settings.particles)
    number = number[np.argsort(GOLDEN * number % (2 * np.pi))]  # sorted by angle, so that colours show the winding
    distance = np.sqrt(INNER**2 + SPACING**2 * number / np.pi * 1.5)
    outward = np.column_stack((np.cos(GOLDEN * number), np.sin(GOLDEN * number)))
    speed = np.sqrt(STRENGTH / distance) * (1.0 + SPREAD * rng.normal(0.0, 1.0, settings.particles).clip(-3.0, 3.0))
    world = settings.empty_world(Open())
    world.forces.append(Attractor(strength=STRENGTH))
    world.add(position=distance[:, None] * outward, velocity=speed[:, None] * outward[:, ::-1] * (-1, 1), radius=RADIUS)
    return world


SCENE = Scene(
    "orbit", "3,000 bodies circle a star, the inner ones faster", build,
    Settings(particles=3_000, collisions=None, gravity=(0.0, 0.0)),
)  # fmt: skip
