"""What the bouncing sketches share: balls let go 3 m above the floor of a tall room, one step a frame, in float64."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from pyverlet.laws.integrators import Integrator
from pyverlet.laws.naive import ClampAndFlip
from pyverlet.laws.rooms import Boundary, Box
from pyverlet.scenes._scene import Settings
from pyverlet.world.world import World

RADIUS = 0.25
"""Of every ball, m."""

HEIGHT = 3.0
"""Of the centres at the start, m: where the line is drawn."""

SPACING = 3 * RADIUS
"""Between the centres of neighbours, m."""

LEAST_WIDTH, CEILING = 3.0, 8.0
"""Of the room, m: a ball that gains energy has space to climb."""


def settings(integrator: Integrator, **changes: Any) -> Settings:
    """Those of a sketch: one ball, one step a frame, no collisions, walls with e = 1."""
    base = Settings(particles=1, substeps=1, collisions=None, restitution=1.0, dtype=np.float64, integrator=integrator)
    return dataclasses.replace(base, **changes)


def room(settings: Settings) -> Box:
    """Wide enough for all balls side by side; the floor is at y = 0."""
    half = max(LEAST_WIDTH, SPACING * settings.particles) / 2
    return Box((-half, 0), (half, CEILING), restitution=settings.restitution, friction=settings.friction)


def drop(settings: Settings, *, boundary: Boundary | None = None, velocity: Any = 0.0) -> World:
    """The balls in a row at the same height, under clamp-and-flip unless said; velocity (n, 2) in m/s."""
    world = settings.empty_world(ClampAndFlip(room(settings)) if boundary is None else boundary)
    x = SPACING * (np.arange(settings.particles) - (settings.particles - 1) / 2)
    world.add(position=np.column_stack((x, np.full_like(x, HEIGHT))), velocity=velocity, radius=RADIUS, mass=1.0)
    return world
