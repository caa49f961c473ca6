"""Birds that keep distance, align and stay together: Reynolds (1987), Flocks, Herds, and Schools."""

from __future__ import annotations

import numpy as np

from pyverlet.laws.boundaries import Periodic
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.actors import Actor
from pyverlet.world.world import World

RADIUS, SIGHT, SPEED = 0.15, 1.5, 5.0  # of a bird, m; range of sight, m; speed, m/s
ROOM = 1.4  # m^2 per bird


class Flock(Actor):
    """Before each frame every bird turns according to its neighbours, and continues at the common speed.

    Args:
        sight: m. apart: m, nearer ones are avoided. speed: m/s. turns: 1/s, how fast a bird follows.
    """

    _shows = ("sight", "apart", "speed", "turns")

    def __init__(self, *, sight: float, apart: float, speed: float, turns: float = 4.0) -> None:
        self.sight, self.apart, self.speed, self.turns = sight, apart, speed, turns

    def act(self, world: World, dt: float) -> None:
        i, j, distance, way = world.neighbours(self.sight)
        velocity, count = world.velocity.astype(float), np.zeros(len(world))
        seen, middle, away = np.zeros((3, len(world), 2))  # sums over neighbours
        close = (1.0 - distance / self.apart).clip(0.0)[:, None] * way
        for a, b, to in ((i, j, 1.0), (j, i, -1.0)):
            np.add.at(count, a, 1.0)
            np.add.at(seen, a, velocity[b] - velocity[a])
            np.add.at(middle, a, to * distance[:, None] * way)
            np.add.at(away, a, -to * close)
        seen, middle = (total / np.maximum(count, 1.0)[:, None] for total in (seen, middle))
        velocity += self.turns * dt * (seen + middle + 3.0 * self.speed * away)
        pace = np.hypot(*velocity.T)[:, None]
        world.velocity[:] = np.where(pace > 0, velocity * self.speed / np.maximum(pace, 1e-12), 0.0)


def build(settings: Settings) -> World:
    """800 birds in a periodic sky, each of which reacts only to its neighbours, form flocks.

    `world.neighbours` lists the visible pairs, at a cost proportional to their number.
    """
    rng = np.random.default_rng(settings.seed)
    side = max(float(np.sqrt(ROOM * settings.particles)), 2.1 * SIGHT)
    centres = _start.in_box(rng, np.full(settings.particles, RADIUS), side, side)
    assert centres is not None
    world = settings.empty_world(Periodic((-side / 2, 0), (side / 2, side)))
    angle = rng.uniform(0, 2 * np.pi, settings.particles)
    world.add(position=centres, velocity=SPEED * np.column_stack((np.cos(angle), np.sin(angle))), radius=RADIUS)
    world.actors.append(Flock(sight=SIGHT, apart=0.6, speed=SPEED))
    return world


SCENE = Scene(
    "boids", "birds that keep apart, fly along and stay together", build,
    Settings(particles=800, substeps=1, gravity=(0.0, 0.0), collisions=None),
)  # fmt: skip
