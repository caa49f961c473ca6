"""J8 and J9: what position Verlet does, and does not do, at contacts."""

from __future__ import annotations

import numpy as np

from pyverlet.lab.truth._claim import HEIGHT, RADIUS, H, Number, experiment, path
from pyverlet.laws.collisions import Collisions
from pyverlet.laws.integrators import PositionVerlet
from pyverlet.laws.naive import ProjectOnly
from pyverlet.laws.rooms import Box
from pyverlet.world.world import World


@experiment(
    "J8",
    claim="Verlet takes the bouncing into account by itself: put the position back, and the velocity follows.",
    mathematics="""
        After the projection x is on the wall and x_prev above it: the ball still moves down. A step later both are on the
        wall and x - x_prev = 0: it rests. That is a restitution of exactly 0. A bounce needs a stated e, and then rises
        to e² of the drop.
    """,
    setting="A ball falls 2.75 m on a floor: one that only projects, for 10 s, and pyverlet's with e = 0.5.",
    verdict="Wrong. Projection alone never bounces.",
)
def bouncing() -> list[Number]:
    """Height after the first contact."""
    y, _, _ = path(PositionVerlet(), ProjectOnly(Box((-5, 0), (5, 50))), 600)
    after = y[int(np.argmax(y <= RADIUS)) :]
    y, v, _ = path(PositionVerlet(), Box((-5, 0), (5, 50), restitution=0.5), 60)
    rising = int(np.flatnonzero((v[:-1] < 0) & (v[1:] > 0))[0]) + 1
    rebound = float(y[rising] - RADIUS + v[rising] ** 2 / (2 * 9.81))
    return [
        Number("rise after the fall, projection alone", float(after.max() - RADIUS), "m", below=1e-12),
        Number("rise after the fall, e = 0.5", rebound, "m", 0.25 * (HEIGHT - RADIUS)),
    ]


@experiment(
    "J9",
    claim="Overlapping circles are to be pushed apart, half the overlap each.",
    mathematics="""
        Verlet's velocity is (x - x_prev) / h: a position moved by d / 2 is a velocity of d / (2 h) more, for each of the
        two. In a pile, where weight makes new overlaps in every step, this feeds it without end: gooey heaps that boil.
        What was put in must be taken out again: pyverlet's contacts push with a speed of their own, which is taken back at
        the end of the substep.
    """,
    setting="Two circles of radius 0.5 m at rest, 0.05 m deep in each other, no gravity: a step of 1/60 s; in pyverlet 1 s.",
    verdict="Only half of it: by position alone it injects a velocity of overlap / h.",
)
def pushing() -> list[Number]:
    """Speed at which the two part."""
    overlap, reach = 0.05, 1.0
    x = np.array([-(reach - overlap) / 2, (reach - overlap) / 2])
    x_prev = x.copy()
    depth = reach - (x[1] - x[0])
    x += np.array([-depth / 2, depth / 2])
    apart = float((x[1] - x_prev[1] - x[0] + x_prev[0]) / H)
    world = World(gravity=(0, 0), collisions=Collisions(), dtype=np.float64)
    pair = world.add(position=[(-(reach - overlap) / 2, 0), ((reach - overlap) / 2, 0)], radius=reach / 2)
    world.run(seconds=1.0, dt=H)
    speed = float(pair.velocity[1, 0] - pair.velocity[0, 0])
    return [
        Number("speed of parting, projection alone", apart, "m/s", overlap / H),
        Number("speed of parting in pyverlet", speed, "m/s", below=1e-12),
        Number("overlap left in pyverlet", float(world.overlap().max), below=1e-9),
    ]
