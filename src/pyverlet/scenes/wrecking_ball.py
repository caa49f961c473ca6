"""A heavy ball on a light chain swings into a tower of circles."""

import numpy as np

from pyverlet.laws.boundaries import Box
from pyverlet.laws.links import Stick
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world import builders
from pyverlet.world.world import World

BRICK, BALL = 0.25, 1.2  # radii, m
LENGTH, LINKS = 9.0, 24  # length of the chain, m, and number of links; fewer with few particles
COLUMNS = 12  # of the tower
CHAIN = 5.0  # kg
LEAST = 8  # particles: two links, a ball and a few bricks


def build(settings: Settings) -> World:
    """The ball has 40 times the mass of its chain, and 200 times that of a brick; it starts level with its peg and breaks the
    tower.

    The chain is solved as a whole and does not stretch. The bricks stand in rows, each in the gaps of the one below.
    """
    settings.require(LEAST, "wrecking-ball")
    links = min(LINKS, settings.particles // 2 - 2)
    bricks = settings.particles - links - 2
    rows = -(-bricks // COLUMNS)
    height = max(BRICK * (2 + 1.75 * rows), LENGTH + BALL) + 3.0
    peg = (-BALL - 0.3, LENGTH + 1.5 * BALL)
    world = settings.empty_world(Box((-LENGTH - 3 * BALL, 0.0), (16.0, height), **settings.surface))
    chain = builders.chain(world, peg, (peg[0] - LENGTH + BALL, peg[1]), links=links, mass=CHAIN, radius=0.1)
    chain.group.pin(0)
    ball = world.add(position=(peg[0] - LENGTH, peg[1]), radius=BALL - 0.11, mass=200.0)
    world.links.append(Stick((chain.group, -1), (ball, 0), collide=False))
    row, column = np.divmod(np.arange(bricks), COLUMNS)
    x = BRICK * (2.01 * column + 1.005 * (row % 2))
    world.add(position=np.column_stack((x, BRICK * (1.0 + 1.75 * row))), radius=BRICK, mass=1.0)
    return world


SCENE = Scene(
    "wrecking-ball", "a heavy ball on a light chain breaks a tower of circles", build, Settings(particles=400, friction=0.6)
)
