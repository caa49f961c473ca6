"""Surfaces that close in on a circle: however narrow the wedge is, it stays in the room and gets no faster than they make it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

PUSH, DRAG, ROLL = 8, 9, 10
"""As in `core/surface_rows.py`."""


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("friction", [0.0, 0.8])
@pytest.mark.parametrize(("room", "dtype"), [("box", "float32"), ("cage", "float64"), ("cage", "float32")])
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
    for _ in range(60):
        world.step(1 / 60)
        place, fast = world.position[small], np.hypot(*world.velocity[small].T)
        inside = np.hypot(*place.T) < 10 if room == "cage" else (np.abs(place) < 10).all(axis=1)
        assert inside.all()
        assert restitution == 1 or fast.max() < 8 * 2 * speed


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("friction", [0.8, 2.0])
def test_what_lets_go_of_a_wedge_takes_back_its_friction_and_its_roll(friction: float, restitution: float) -> None:
    # Where friction would hold a circle in a wedge that closes, surfaces are solved once more without it. What they gave along
    # the tangent and against rolling is not given, and not remembered: |j_t| <= mu j and |L| <= c r j.
    rough: dict[str, Any] = {"restitution": restitution, "friction": friction, "rolling_resistance": 0.3}
    law = pv.Collisions(restitution=restitution, friction=friction, rolling_resistance=0.3)
    world = pv.World(boundary=pv.Box((-10, -10), (10, 10), **rough), gravity=(0, 0), collisions=law, dtype="float64")
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    for x, y in zip(np.cos(angle), np.sin(angle), strict=True):
        world.obstacles.append(pv.Disc((5 * x, 5 * y), 1.0, velocity=(13 * x, 13 * y), angular_velocity=7.0, **rough))
    rng = np.random.default_rng(0)
    place, spin = rng.uniform(-6.5, 6.5, (400, 2)), rng.normal(0, 30, 400)
    world.add(position=place, radius=0.05, spin=spin, on_overlap="push", category=2, mask=1)
    most = 0.0
    for _ in range(60):
        world.step(1 / 60)
        arrays = world._frames.held.engine.arrays
        for side in "01":
            first, end = arrays.get(f"contact_begin{side}", []), arrays.get(f"contact_end{side}", [])
            rows = np.concatenate([np.arange(a, b) for a, b in zip(first, end, strict=True)] or [np.zeros(0)]).astype(int)
            push, drag, roll = (arrays[f"contact{side}"][rows, column] for column in (PUSH, DRAG, ROLL))
            assert (np.abs(drag) <= friction * push * (1 + 1e-9)).all()
            assert (np.abs(roll) <= 0.3 * 0.05 * push * (1 + 1e-9)).all()
            most = max(most, float(push.max(initial=0.0)))
    assert most > 1.0
