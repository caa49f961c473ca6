"""Free fall without bounds, compared with the exact solution."""

import numpy as np

from pyverlet.common.arrays import Floats
from pyverlet.laws.boundaries import Open
from pyverlet.scenes._scene import Scene, Settings
from pyverlet.world.world import World

RADIUS = 0.5  # radius of every circle, m
HEIGHT = 10.0  # initial height, m
THROW = 5.0  # upward speed of the last circle, m/s; the first is released at rest


def build(settings: Settings) -> World:
    """One circle falls from a height of 10 m: no bounds, no collisions, gravity alone.

    More circles stand side by side and are thrown upward at increasing speeds, up to 5 m/s. The exact solution is
    y(t) = y0 + v0 t + g t^2 / 2, and second-order methods reproduce it up to rounding at every frame.
    """
    world = settings.empty_world(Open())
    x, upward = 3 * RADIUS * np.arange(settings.particles), np.linspace(0.0, THROW, settings.particles)
    velocity = np.column_stack((np.zeros_like(upward), upward))
    world.add(position=np.column_stack((x, np.full_like(x, HEIGHT))), velocity=velocity, radius=RADIUS, mass=1.0)
    return world


def height(settings: Settings, t: Floats) -> Floats:
    """Exact heights (m, n) in metres at the times `t` (m,) in seconds."""
    t = np.asarray(t, dtype=np.float64)[:, None]
    upward = np.linspace(0.0, THROW, settings.particles)
    return np.asarray(HEIGHT + upward * t + settings.gravity[1] * t**2 / 2)


SCENE = Scene(
    "fall", "one circle falls freely; --plot compares it with y0 + v0 t + g t^2 / 2", build,
    Settings(particles=1, collisions=None), closed_form=height,
)  # fmt: skip
