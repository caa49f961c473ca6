"""Contacts with surfaces are solved eight at a time with the bits of one by one, as in worlds that record contacts."""

from typing import Any

import numpy as np
import pytest

import pyverlet as pv

LAWS: dict[str, dict[str, Any]] = {"smooth": {}, "rough": {"friction": 0.5, "restitution": 0.3}}


def heap(room: str, law: dict[str, Any], obstacles: str, dtype: Any, **more: Any) -> pv.World:
    """Sixty discs that fall on the floor, over obstacles and into corners."""
    cage = {"cage": 0.0, "drum": 0.5}
    bounds = pv.Circle(radius=3.0, angular_velocity=cage[room], **law) if room in cage else pv.Box((-3, -3), (3, 3), **law)
    world = pv.World(boundary=bounds, collisions=pv.Collisions(**law), dtype=dtype, **more)
    chance, (y, x) = np.random.default_rng(1), np.divmod(np.arange(60), 8)
    place = 0.42 * np.column_stack((x - 3.5, y - 3.5)) + chance.uniform(-0.02, 0.02, (60, 2))
    radius = chance.uniform(0.1, 0.2, 60) if obstacles == "none" else 0.2  # one radius, or one for each
    world.add(position=place, velocity=chance.uniform(-1, 1, (60, 2)), radius=radius)
    if obstacles == "pegs":
        world.obstacles.extend(pv.Segment((k, -2.0), (k + 0.3, -2.0)) for k in (-2, -1, 0, 1))
    elif obstacles == "paddle":
        world.obstacles.append(pv.Segment((-1, -1.5), (1, -1.5), angular_velocity=0.5))
    return world


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("obstacles", ["none", "pegs", "paddle"])
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("room", ["cage", "drum", "box"])
def test_eight_at_a_time_have_the_bits_of_one_by_one(room: str, law: str, obstacles: str, dtype: Any) -> None:
    together, one_by_one = (heap(room, LAWS[law], obstacles, dtype, contacts=contacts) for contacts in (False, True))
    for frame in range(200):
        for world in (together, one_by_one):
            world.step((1 / 60, 1 / 60, 1 / 60, 1 / 75)[frame // 50])
        for name in ("position", "velocity", "spin"):
            assert getattr(together, name).tobytes() == getattr(one_by_one, name).tobytes(), (frame, name)
