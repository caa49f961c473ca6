"""Grains flow in a rotating drum: its rough wall carries them up, and they run down the slope."""

import numpy as np

from pyverlet.laws.boundaries import Circle
from pyverlet.scenes import _start
from pyverlet.scenes._scene import Scene, Settings, Show
from pyverlet.world.world import World

RADIUS = 0.05  # root mean square radius of the grains, m
FILLING = 0.4  # fraction of the drum's area that the grains cover
FROUDE = 0.01  # w^2 R / g, centrifugal over gravitational acceleration: at a hundredth grains roll down an almost straight slope

GRAVITY = 9.81


def drum_radius(particles: int) -> float:
    """R, m."""
    return float(RADIUS * np.sqrt(particles / FILLING))


def angular_velocity(particles: int) -> float:
    """w, rad/s, clockwise."""
    return -float(np.sqrt(FROUDE * GRAVITY / drum_radius(particles)))


def build(settings: Settings) -> World:
    """1,500 rough grains of 5 cm in a drum that turns with w^2 R / g = 0.01.

    Friction on the wall carries them up on one side until the heap is as steep as possible. From then on grains run down its
    slope as fast as the wall brings new ones. Their centre of mass is offset horizontally so that the torque of the wall, its
    power over w, holds their weight: M g x = P / w.
    """
    rng, radii = settings.draw_radii(RADIUS)
    radius = drum_radius(settings.particles)
    while (centres := _start.in_circle(rng, radii, radius)) is None:
        radius *= 1.01
    turning = angular_velocity(settings.particles)
    world = settings.empty_world(Circle(radius=radius, angular_velocity=turning, **settings.surface))
    world.add(position=centres, radius=radii, mass=(radii / RADIUS) ** 2)
    return world


SCENE = Scene(
    "drum", "rough grains run down the slope in a drum that turns", build,
    Settings(particles=1_500, friction=0.6, restitution=0.1, radius_spread=1.5), show=Show(seconds=lambda settings: 15.0),
)  # fmt: skip
