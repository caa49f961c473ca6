"""A dam breaks: a column of water falls, runs along the floor and carries floating discs away."""

from __future__ import annotations

import numpy as np

from pyverlet.laws.boundaries import Box
from pyverlet.laws.forces import Fluid
from pyverlet.scenes._scene import Scene, Settings, Show
from pyverlet.world.world import World

SPACING, DENSITY = 0.2, 1000.0  # of particles, m; of water, kg/m^2

SOUND, VISCOSITY = 1.05, 0.06
"""Distance of sound per substep of a frame of 1/60 s, in spacings, and viscosity times substep, in squares of the spacing."""

DISCS = (300.0, 600.0, 2500.0)  # densities, kg/m^2: two float, one stays on the floor


def build(settings: Settings) -> World:
    """A column of water, 1.5 times as high as wide, is released at the left wall.

    The front runs along the floor as in the experiment of Martin and Moyce (1952), climbs the other wall, and falls back as a
    wave. Of three discs in its way one is light, one floats half submerged, and one is too heavy to float.
    """
    discs = DISCS[: settings.particles // 10]
    count = settings.particles - len(discs)
    across = max(round(np.sqrt(count / 1.5)), 1)
    wide, h = across * SPACING, 1 / (60 * max(settings.substeps, 1))
    place, rng = np.arange(count), np.random.default_rng(settings.seed)
    column = SPACING * (np.column_stack((place % across, place // across)) + rng.uniform(0.48, 0.52, (count, 2)))
    world = settings.empty_world(Box((0, 0), (4 * wide, 2.25 * max(wide, column[:, 1].max() / 1.5))))
    water = world.add(position=column, radius=0.47 * SPACING, mass=DENSITY * SPACING**2, friction=0.0, restitution=0.0)
    radius = max(wide / 8, SPACING)
    for k, density in enumerate(discs):
        where, mass = ((2.2 + 0.6 * k) * wide, 1.01 * radius), density * np.pi * radius**2
        world.add(position=where, radius=radius, mass=mass, friction=0.0, restitution=0.0)
    stiffness, viscosity = (SOUND * SPACING / h) ** 2, VISCOSITY * SPACING**2 / h
    world.forces.append(Fluid(water, rest_density=DENSITY, stiffness=stiffness, viscosity=viscosity))
    return world


SCENE = Scene(
    "dam-break", "a column of water falls, runs along the floor and carries off discs", build,
    Settings(particles=3_000, substeps=6), show=Show(seconds=lambda settings: 20.0),
)  # fmt: skip
