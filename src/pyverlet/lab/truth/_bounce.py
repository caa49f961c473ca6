"""The one bouncing ball that the experiments share: 1 kg, in float64, one step a frame of 1/60 s."""

from __future__ import annotations

import numpy as np

from pyverlet.ground.arrays import Floats
from pyverlet.laws.integrators import Integrator
from pyverlet.laws.naive import ClampAndFlip
from pyverlet.laws.rooms import Boundary, Box, Open
from pyverlet.world.world import World

G = 9.81
H = 1 / 60
RADIUS = 0.25
HEIGHT = 3.0  # of the centre at the start, m

ROOM = Box((-5, 0), (5, 50), restitution=1.0)
FLIP = ClampAndFlip(ROOM)
OPEN = Open()
MINUTE = 3600  # frames


def path(
    integrator: Integrator, boundary: Boundary, frames: int, *, speed: float = 0.0, gravity: float = G
) -> tuple[Floats, Floats, Floats]:
    """Height, velocity and energy of a ball thrown upward at `speed`, m/s: (frames + 1,) each, the start included."""
    world = World(gravity=(0, -gravity), integrator=integrator, boundary=boundary, collisions=None, substeps=1, dtype=np.float64)
    world.add(position=(0, HEIGHT), velocity=(0, speed), radius=RADIUS, mass=1.0)
    rows = np.empty((frames + 1, 3))
    for frame in range(frames + 1):
        if frame:
            world.step(H)
        rows[frame] = world.position[0, 1], world.velocity[0, 1], world.energy().total
    y, v, energy = rows.T
    return y, v, energy


def tops(y: Floats) -> Floats:
    """Largest heights between bounces, as they were reached at the end of steps."""
    inner = y[1:-1]
    return inner[(inner > y[:-2]) & (inner >= y[2:])]
