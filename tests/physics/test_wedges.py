"""Surfaces that close in on a circle: however narrow the wedge is, it stays in the room and gets no faster than they make it."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("friction", [0.0, 0.8])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("room", ["box", "cage"])
def test_circles_between_a_wall_and_a_pinned_circle_that_moves_into_it(
    room: str, dtype: str, friction: float, restitution: float
) -> None:
    # Their normals become ever more opposite: to give way at speed s, a circle would have to leave at s / sin(angle).
    # It gets eight times s, and again in the next wedge; where that is not enough, it is overlapped. Elastic ones may get more:
    # between surfaces that close in on each other v d is kept.
    rng = np.random.default_rng(0)
    boundary = pv.Circle(radius=10) if room == "cage" else pv.Box((-10, -10), (10, 10))
    boundary.restitution, boundary.friction = restitution, friction
    law = pv.Collisions(restitution=restitution, friction=friction)
    world = pv.World(boundary=boundary, gravity=(0, 0), collisions=law, dtype=dtype)
    angle, speed = np.linspace(0, 2 * np.pi, 12, endpoint=False), 13.0
    out = np.column_stack((np.cos(angle), np.sin(angle)))
    pistons = world.add(position=5 * out, radius=1.0, velocity=speed * out, mass=np.inf)
    # The small ones do not meet each other: what one is given it keeps.
    world.add(position=rng.uniform(-6.5, 6.5, (400, 2)), radius=0.05, on_overlap="push", category=2, mask=1)
    small = np.arange(len(pistons), len(world))
    for _ in range(90):
        world.step(1 / 60)
        place, fast = world.position[small], np.hypot(*world.velocity[small].T)
        inside = np.hypot(*place.T) < 10 if room == "cage" else (np.abs(place) < 10).all(axis=1)
        assert inside.all()
        assert restitution == 1 or fast.max() < 8 * 2 * speed
