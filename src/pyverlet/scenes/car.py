"""A car with two driven wheels climbs hill after hill, with a load on its bed."""

from __future__ import annotations

import numpy as np

from pyverlet.laws.boundaries import Periodic
from pyverlet.laws.links import Motor, Spring
from pyverlet.laws.obstacles import Chain
from pyverlet.scenes._scene import Scene, Settings, Show
from pyverlet.world.world import World

ROAD = 36.0  # m, length of the periodic road
HILLS = ((2, 0.6), (3, 0.4), (6, 0.08))  # number, and amplitude above the mean of the road, m: slopes of at most 27 degrees
WHEEL, AXLES = 0.55, (2.5, 11.5)  # radius of the wheels, m, and positions along the chassis, in discs
DISC, SPACING = 0.15, 0.32  # radius of the discs of the chassis, and their spacing, m

SHAPE = ((0, 15), (0, 14), (0, 2, 10, 14), (0, 2, 9, 13), (0, 1, 10, 12))
"""Rows of the chassis, from the bottom up: ranges of discs, without the last."""

SPEED, TORQUE = -7.0, 15.0  # of each wheel: rad/s, clockwise, and largest torque, N m


def build(settings: Settings) -> World:
    """The motors turn the wheels relative to the chassis, which pitches when they pull; springs carry it.

    The seed determines the hills. The load is not tied, and the road is periodic.
    """
    rows = [np.concatenate([np.arange(a, b) for a, b in zip(row[::2], row[1::2], strict=True)]) for row in SHAPE]
    count = sum(map(len, rows)) + len(AXLES)
    settings.require(count, "car")
    phases = np.random.default_rng(settings.seed).uniform(0.0, 2 * np.pi, len(HILLS))
    load = np.arange(settings.particles - count)
    x = np.linspace(0.0, ROAD, 301)
    number, tall = np.array(HILLS).T
    height = np.sin(2 * np.pi * np.outer(x, number) / ROAD + phases) @ tall
    height = np.roll(height[:-1], 48 - int(height[:-1].argmax()))  # the car starts on the highest hill
    height = np.append(height, height[0])
    floor = float(height.max()) + 2.15 * WHEEL + DISC
    top = floor + 3.0 + 0.42 * len(load) / 5
    world = settings.empty_world(Periodic((0.0, -2.0), (ROAD, max(top, 7.0)), axes="x"))
    world.obstacles.append(Chain(np.column_stack((x, height)), friction=settings.friction))
    shape = [(3.5 + SPACING * (k + 0.5 * (n % 2)), floor + 0.866 * SPACING * n) for n, row in enumerate(rows) for k in row]
    body = world.add(position=shape, radius=DISC, mass=0.15, friction=settings.friction)
    apart = np.asarray(shape)[:, None] - np.asarray(shape)
    i, j = np.nonzero(np.triu(np.hypot(*apart.T) < 1.1 * SPACING, 1))
    world.links.append(Spring(body, i, j, stiffness=6e4, damping=20.0, collide=False))
    hubs = [(3.5 + SPACING * axle, floor - DISC - 1.1 * WHEEL) for axle in AXLES]
    wheels = world.add(position=hubs, radius=WHEEL, mass=1.0, friction=settings.friction)
    last = len(rows[0]) - 1
    for wheel, axle in enumerate(AXLES):
        for side in (-3.5, -0.5, 0.5, 3.5):
            strut = (wheels, wheel), (body, int(np.clip(axle + side, 0, last)))
            world.links.append(Spring(*strut, stiffness=800.0, damping=25.0, collide=False))
        world.links.append(Motor((wheels, wheel), (body, 0), (body, last), speed=SPEED, max_torque=TORQUE))
    across, up = load % 5, load // 5
    bed = np.column_stack((4.45 + 0.4 * across + 0.05 * (up % 2), floor + 0.65 + 0.4 * up))
    if len(load):
        world.add(position=bed, radius=0.18, mass=0.15)
    return world


SCENE = Scene(
    "car", "a car with two driven wheels climbs hills, with a load on its bed", build,
    Settings(particles=56, friction=0.9), show=Show(view=lambda _: (0.0, -2.0, ROAD, 7.0), seconds=lambda _: 20.0),
)  # fmt: skip
