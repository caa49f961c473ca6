"""A cloth on a line of pegs, under a load of balls, which tears if it is pulled too hard, for example by the mouse."""

import numpy as np

from pyverlet.laws.boundaries import Box
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world import builders
from pyverlet.world.world import World

SPACING = 0.25  # between threads, m
ASPECT = 1.6  # columns / rows
SLACK = 0.12  # excess length of the horizontal threads, so that the cloth hangs in folds between its pegs
SHEAR = 0.2  # N/m per kilogram: small, so that folds are visible
PEGS = 9  # least number of pegs
SPAN = 6  # most columns between pegs: threads carry their weight, and twice as much while the cloth falls into folds
STRENGTH = 25.0  # breaking force of a thread, in weights of a column of the cloth
LEAST = 12  # least number of particles


def build(settings: Settings) -> World:
    """A cloth hangs from nine pegs, or more if it is wide.

    Each thread breaks at a certain force, so that a hard pull tears the cloth; colours in a window or a film show the tension.
    Particles that do not fill a row lie on the floor.
    """
    settings.require(LEAST, "cloth")
    columns = max(3, round(np.sqrt(ASPECT * settings.particles)))
    rows = settings.particles // columns
    width, height = SPACING * (columns - 1), SPACING * (rows - 1)
    world = settings.empty_world(Box((-0.8 * width, -0.7 * height), (0.8 * width, 1.15 * height), **settings.surface))
    mass = 0.05 * columns * rows
    cloth = builders.cloth(
        world, (-width / 2, height), width=width, height=height, columns=columns, rows=rows, mass=mass, radius=0.4 * SPACING,
        slack=SLACK, shear=SHEAR * mass, breaking_force=STRENGTH * mass / columns * 9.81,
    )  # fmt: skip
    pegs = max(PEGS, 1 - (1 - columns) // SPAN)
    cloth.group.pin(np.unique(np.linspace(0, columns - 1, pegs).astype(int)))
    loose = settings.particles - columns * rows
    if loose:
        x = SPACING * (np.arange(loose) - (loose - 1) / 2)
        world.add(position=np.column_stack((x, np.full(loose, -0.6 * height))), radius=0.4 * SPACING, mass=0.05)
    return world


SCENE = Scene(
    "cloth", "a cloth hangs from pegs; drag it hard enough and it tears", build, Settings(particles=1_500, friction=0.2)
)
