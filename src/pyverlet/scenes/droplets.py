"""A vapour that is cooled: Lennard-Jones particles condense to droplets."""

from __future__ import annotations

import numpy as np

from pyverlet.laws.boundaries import Periodic
from pyverlet.laws.forces import Langevin, LennardJones
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings, Show
from pyverlet.world.world import World

SIGMA, EPSILON = 1.0, 50.0  # m and J, with masses of 1 kg: the unit of time, sigma sqrt(m / epsilon), is 0.14 s
DENSITY = 0.18  # particles per sigma^2

TEMPERATURE = 0.38
"""k T, in epsilon. The critical point of this law with this cutoff is 0.459 in two dimensions (Smit and Frenkel 1991)."""


def build(settings: Settings) -> World:
    """A gas in a heat bath far below its boiling point separates into droplets, which grow as they meet, and vapour.

    The molecules attract each other by Lennard-Jones; friction and kicks of the bath remove the heat of condensation.
    """
    rng = np.random.default_rng(settings.seed)
    count = settings.particles
    side = max(float(np.sqrt(count / DENSITY)) * SIGMA, 5.2 * SIGMA)
    centres = _start.in_box(rng, np.full(count, 0.5 * SIGMA), side, side)
    assert centres is not None
    world = settings.empty_world(Periodic((-side / 2, 0), (side / 2, side)))
    heat = TEMPERATURE * EPSILON
    world.add(position=centres, velocity=rng.normal(0, np.sqrt(heat), (count, 2)), radius=0.5 * SIGMA)
    bath = Langevin(temperature=heat, friction=1.0, seed=settings.seed)
    world.forces += [LennardJones(epsilon=EPSILON, sigma=SIGMA), bath]
    return world


SCENE = Scene(
    "droplets", "a vapour of Lennard-Jones particles in a cold bath condenses to droplets", build,
    Settings(particles=2_000, substeps=10, gravity=(0.0, 0.0), collisions=None), show=Show(seconds=lambda settings: 30.0),
)  # fmt: skip
