"""Grains ride down three conveyor belts into a pit that a wheel stirs."""

import numpy as np

from pyverlet.laws.boundaries import Box
from pyverlet.laws.obstacles import Capsule, Segment
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

RADIUS = 0.25  # root mean square radius of the grains, m
WIDTH = 24.0  # of the room, m
BELTS = ((-3.0, 13.0), (3.0, 9.5), (-3.0, 6.0))  # middle of each belt, m
SPEED = 3.0  # of the belts, m/s
TURN = 1.0  # of the wheel in the pit, rad/s


def build(settings: Settings) -> World:
    """300 grains lie on the topmost of three belts, which carry them down, left and right in turn, into a pit.

    A belt is a capsule whose surface runs around it at 3 m/s and drags the grains by friction. In the pit turns a wheel of four
    arms, a moving obstacle that nothing stops.
    """
    rng, radii = settings.draw_radii(RADIUS)
    height = 4.0
    while (centres := _start.in_box(rng, radii, 14.0, height)) is None:
        height *= 1.05
    walls = settings.surface
    world = settings.empty_world(Box((-WIDTH / 2, -6.0), (WIDTH / 2, 14.0 + 1.2 * height), **walls))
    for k, (x, y) in enumerate(BELTS):
        way = -SPEED if k % 2 == 0 else SPEED  # clockwise: to the right on top
        world.obstacles.append(Capsule((x - 7, y), (x + 7, y), radius=0.5, surface_speed=way, **walls))
    for side in (-1, 1):
        world.obstacles.append(Segment((side * WIDTH / 2, 3.0), (side * 5.0, -6.0), **walls))
    for k in range(2):
        arm = 2.2 * np.array([np.cos(k * np.pi / 2), np.sin(k * np.pi / 2)])
        hub = np.array([0.0, -2.5])
        world.obstacles.append(Capsule(tuple(hub - arm), tuple(hub + arm), radius=0.2, angular_velocity=TURN, **walls))
    x, y = BELTS[0]
    world.add(position=centres + np.array([x, y + 0.51]), radius=radii, mass=(radii / RADIUS) ** 2)
    return world


SCENE = Scene(
    "conveyor", "grains ride down three conveyor belts into a pit that a wheel stirs", build,
    Settings(particles=300, friction=0.5, restitution=0.1),
)  # fmt: skip
