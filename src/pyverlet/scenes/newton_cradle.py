"""Newton's cradle: balls on threads in a row; the first swings down, the last swings up."""

import numpy as np

from pyverlet.common.errors import InputError
from pyverlet.laws.boundaries import Open
from pyverlet.laws.links import Stick
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

RADIUS, LENGTH = 0.5, 4.0  # of the balls and of their threads, m
GAP = 1e-3  # between resting neighbours, in radii: impacts pass from ball to ball, one after the other
LIFT = 0.9  # rad: initial angle of the first ball


def build(settings: Settings) -> World:
    """The first ball is released at 0.9 rad and hits the others at rest; the last takes all its speed.

    Half of the particles are the suspension points. A stick of 4 m holds each ball. Two balls of equal mass exchange their
    velocities if e = 1, and so on along the row.
    """
    if settings.particles % 2:
        raise InputError(f"particles is {settings.particles}; allowed is an even number in 'newton-cradle': balls and pegs")
    balls = settings.particles // 2
    world = settings.empty_world(Open())
    peg = np.column_stack((RADIUS * (2 + GAP) * np.arange(balls), np.full(balls, LENGTH)))
    hanging = peg - (0.0, LENGTH)
    hanging[0] = peg[0] - LENGTH * np.array([np.sin(LIFT), np.cos(LIFT)])
    pegs = world.add(position=peg, radius=0.1 * RADIUS)
    pegs.pin()
    group = world.add(position=hanging, radius=RADIUS)
    world.links.append(Stick((pegs, np.arange(balls)), (group, np.arange(balls)), length=LENGTH))
    return world


SCENE = Scene(
    "newton-cradle", "the first of five balls swings down, the last swings up", build,
    Settings(particles=10, restitution=1.0, substeps=16, dtype=np.float64),
)  # fmt: skip
