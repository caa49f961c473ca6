"""One warning where float32 is too coarse for what rests, and none elsewhere."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import pyverlet as pv

DT = 1 / 60


def said(world: pv.World, frames: int = 70) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(frames):
            world.step(DT)
    return [str(each.message) for each in caught if each.category is pv.CoarseCoordinatesWarning]


def resting(place: tuple[float, float], radius: float = 0.2, kind: str = "box", **options: Any) -> pv.World:
    """Three circles that rest on a floor there."""
    x, y = place
    size = 10 * radius
    rooms: dict[str, pv.Boundary] = {
        "box": pv.Box((x - size, y - radius), (x + size, y + size)),
        "cage": pv.Circle(center=(x, y + size - radius), radius=size),
        "open": pv.Open(),
    }
    world = pv.World(boundary=rooms[kind], **options)
    if kind == "open":
        world.obstacles.append(pv.Segment((x - size, y - radius), (x + size, y - radius)))
    world.add(position=[(x + 2.1 * k * radius, y + 0.3 * radius) for k in (-1, 0, 1)], radius=radius)
    return world


@pytest.mark.parametrize("kind", ["box", "cage", "open"])
@pytest.mark.parametrize("place", [(1e4, 0.0), (0.0, -1e4), (-2e3, 2e3)])
def test_what_rests_far_away_is_warned_of_once(kind: str, place: tuple[float, float]) -> None:
    (message,) = said(resting(place, kind=kind), 160)
    assert "from the origin" in message
    assert "dtype=float64" in message
    assert " 7.3e+02 m" in message  # 0.03 h sqrt(g r) / eps


@pytest.mark.parametrize(
    ("place", "options"),
    [((300.0, 300.0), {}), ((0.0, 0.0), {}), ((1e4, 0.0), {"dtype": np.float64}), ((1e4, 0.0), {"gravity": (0, 0)})],
    ids=str,
)
def test_there_is_none_near_by_nor_in_float64_nor_without_weight(place: tuple[float, float], options: dict[str, Any]) -> None:
    assert said(resting(place, **options)) == []


def test_micrometres_are_fine_near_the_origin_and_too_small_a_metre_away() -> None:
    world = resting((0.0, 0.0), radius=1e-6)
    assert said(world) == []
    assert np.abs(world.velocity).max() < 1e-4
    assert len(said(resting((1.0, 0.0), radius=1e-6))) == 1


@pytest.mark.parametrize("velocity", [(0, 0), (300, 200), (0, 5)])
def test_what_falls_flies_or_is_pinned_far_away_is_no_reason(velocity: tuple[float, float]) -> None:
    world = pv.World()
    world.add(position=[(9e3, 9e3), (9e3, 9.1e3), (8e3, 9e3)], velocity=velocity, mass=[1.0, 5.0, np.inf])
    world.velocity[2] = 0
    assert said(world, 200) == []
