"""Dolls fall over bars to the floor: limbs of sticks, with joints that bend as far as a body's do."""

from __future__ import annotations

import numpy as np

from pyverlet.laws.boundaries import Box
from pyverlet.laws.forces import Drag
from pyverlet.laws.links import AngleLimit, Stick
from pyverlet.laws.obstacles import Capsule
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

BODY = {
    "head": (0.0, 2.0, 0.2, 3.0), "chest": (0.0, 1.6, 0.16, 6.0), "belly": (0.0, 1.25, 0.15, 5.0), "hip": (0.0, 0.9, 0.15, 5.0),
    "left elbow": (-0.36, 1.45, 0.09, 1.0), "left hand": (-0.62, 1.2, 0.09, 0.7),
    "right elbow": (0.36, 1.45, 0.09, 1.0), "right hand": (0.62, 1.2, 0.09, 0.7),
    "left knee": (-0.15, 0.5, 0.11, 2.0), "left foot": (-0.2, 0.1, 0.1, 1.2),
    "right knee": (0.15, 0.5, 0.11, 2.0), "right foot": (0.2, 0.1, 0.1, 1.2),
}  # fmt: skip
"""Position x and y, m, radius, m, and mass, kg, of each part."""

BONES = (
    ("head", "chest"), ("chest", "belly"), ("belly", "hip"), ("chest", "left elbow"), ("left elbow", "left hand"),
    ("chest", "right elbow"), ("right elbow", "right hand"), ("hip", "left knee"), ("left knee", "left foot"),
    ("hip", "right knee"), ("right knee", "right foot"),
)  # fmt: skip

JOINTS = (
    ("head", "chest", "belly", -0.6, 0.6), ("chest", "belly", "hip", -0.5, 0.5),
    ("belly", "chest", "left elbow", -0.9, 1.2), ("belly", "chest", "right elbow", -1.2, 0.9),
    ("chest", "left elbow", "left hand", -0.4, 1.9), ("chest", "right elbow", "right hand", -1.9, 0.4),
    ("belly", "hip", "left knee", -0.9, 0.4), ("belly", "hip", "right knee", -0.4, 0.9),
    ("hip", "left knee", "left foot", -0.1, 1.9), ("hip", "right knee", "right foot", -1.9, 0.1),
)  # fmt: skip
"""Angles of joints, and their range relative to a standing body, rad."""

BARS = ((-3.0, 4.4, -0.4), (0.2, 3.0, 0.2), (3.2, 4.4, 0.4))
"""Centres of the bars, m, and height of their right ends above these, m."""

AIR = 0.5  # N s/m on each part, so that dolls hanging on a bar stop swinging
WIDE, TALL = 1.9, 2.4  # spacing of dolls, and of their rows, m


def build(settings: Settings) -> World:
    """Twelve discs and eleven sticks make a doll; ten angle limits restrict its joints.

    The seed determines how dolls turn as they fall. Remaining particles are balls on top.
    """
    rng = np.random.default_rng(settings.seed)
    dolls, balls = divmod(settings.particles, len(BODY))
    bays = max(1, -(-dolls // 8))  # side by side: if too many bodies lie on one, they press its limbs through each other
    top = 6.0 + 2 * TALL
    surface = settings.surface
    world = settings.empty_world(Box((-5.0, 0.0), (10.0 * bays - 5.0, top + 1.0), **surface))
    world.forces.append(Drag(linear=AIR))
    world.links.iterations = 2
    for middle, height, rise in BARS * bays:
        x = middle + 10.0 * (len(world.obstacles) // len(BARS))
        world.obstacles.append(Capsule((x - 0.7, height - rise), (x + 0.7, height + rise), radius=0.2, **surface))
    x, y, radius, mass = np.array(list(BODY.values())).T
    at = np.column_stack((x, y))
    number = {name: k for k, name in enumerate(BODY)}
    for doll in range(dolls):
        row, column = divmod(doll, 4 * bays)
        place = np.array([10.0 * (column // 4) + WIDE * (column % 4 - 1.5), 6.0 + TALL * row])
        swing = rng.uniform(-2.0, 2.0) * (at - mass @ at / mass.sum())[:, ::-1] * (-1.0, 1.0)
        body = world.add(position=at + place, velocity=swing, radius=radius, mass=mass, fixed_rotation=True)
        i, j = np.array([[number[name] for name in bone] for bone in BONES]).T
        world.links.append(Stick(body, i, j, collide=False))
        for *names, least, most in JOINTS:
            a, b, c = (at[number[name]] for name in names)
            now = np.arctan2(*(c - b)[::-1]) - np.arctan2(*(a - b)[::-1])
            world.links.append(AngleLimit(body, *(number[name] for name in names), least=now + least, most=now + most))
    if balls:
        world.add(position=np.column_stack((0.5 * np.arange(balls) - 4.0, np.full(balls, top + 0.5))), radius=0.2)
    return world


SCENE = Scene(
    "ragdoll", "dolls with joints that bend only so far fall over bars to the floor", build, Settings(particles=72, friction=0.5)
)
