"""Frames: the 16-bit grid, the part of the plane on show, the lines of the bounds."""

from __future__ import annotations

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.viewers.frames import GRID_MAX, Camera, outline, quantise

VIEW = (-47.0, -47.0, 47.0, 47.0)


def test_the_grid_is_off_by_half_a_place_at_most() -> None:
    position = np.random.default_rng(1).uniform(-46, 46, (10_000, 2)).astype(np.float32)
    back = quantise(position, VIEW) * (94.0 / GRID_MAX) - 47.0
    # Half a place of the grid, and float32's own rounding of coordinates up to 65535 (2^-8 of a place).
    assert np.abs(back - position).max() <= 94.0 / GRID_MAX * (0.5 + 2**-7)


def test_what_is_outside_is_clipped_and_does_not_wrap() -> None:
    position = np.array([[-48, 0], [48, 0], [0, -1e9], [0, 1e30], [np.inf, np.nan]], dtype=np.float32)
    grid = quantise(position, VIEW)
    middle = GRID_MAX // 2 + 1
    assert grid.tolist() == [[0, middle], [GRID_MAX, middle], [middle, 0], [middle, GRID_MAX], [GRID_MAX, 0]]


def test_the_grid_is_what_numpy_makes_of_it() -> None:
    position = np.random.default_rng(2).uniform(-60, 60, (10_000, 2)).astype(np.float32)
    scale = np.float32(GRID_MAX / 94.0)
    plain = np.clip((position - np.float32(-47.0)) * scale + np.float32(0.5), 0, GRID_MAX).astype(np.uint16)
    assert (quantise(position, VIEW) == plain).all()


def test_the_frame_shows_all_of_the_bounds() -> None:
    world = pv.World(boundary=pv.Circle(center=(3, 4), radius=10))
    x0, y0, x1, y1 = Camera(world).view(world.position)
    assert x0 < -7 < 13 < x1
    assert y0 < -6 < 14 < y1
    assert x1 - x0 == pytest.approx(y1 - y0)


def test_without_bounds_the_view_follows_and_only_grows() -> None:
    world = pv.World(collisions=None)
    group = world.add(position=[(-1.0, 10.0), (1.0, 10.0)], radius=0.5)
    camera = Camera(world)
    first = camera.view(world.position)
    world.run(seconds=2.0)
    later = camera.view(world.position)
    assert later[1] < group.position[:, 1].min() < later[3]
    assert later[3] - later[1] == pytest.approx(first[3] - first[1])
    group.position[:] = [(-40.0, 0.0), (40.0, 0.0)]
    wide = camera.view(world.position)
    assert wide[0] < -40 < 40 < wide[2]


def test_a_runaway_neither_shrinks_the_others_to_dust_nor_takes_the_view_along() -> None:
    world = pv.World(collisions=None)
    group = world.add(position=[(-1.0, 0.0), (0.0, 0.0), (1.0, 0.0)], radius=0.5)
    camera = Camera(world)
    first = camera.view(world.position)
    group.position[2, 0] = 1e7
    for _ in range(100):
        view = camera.view(world.position)
    assert view[2] - view[0] <= 8.001 * (first[2] - first[0])
    assert view[0] < -1 < 0 < view[2]


def test_outlines() -> None:
    (circle,) = outline(pv.Circle(center=(1, 2), radius=5))
    np.testing.assert_allclose(np.hypot(*(np.array(circle) - (1, 2)).T), 5.0)
    assert outline(pv.Box((0, 0), (3, 2))) == (((0, 0), (3, 0), (3, 2), (0, 2)),)
    assert outline(pv.Open()) == ()
