"""Frames: the 16-bit grid, the part of the plane on show, the lines of the bounds."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.viewers.frame_pacing import PICTURE_S, FramePacing
from pyverlet.viewers.frames import GRID_MAX, Camera, Frame, outline, quantise
from pyverlet.viewers.jpeg_renderer import JpegRenderer
from pyverlet.viewers.session import Session
from pyverlet.viewers.view_options import COLOURINGS, ViewOptions

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


# ---- When pictures of slow worlds are due ----


def made(pacing: FramePacing, ends: list[float]) -> list[float]:
    """Which of these times, the ends of substeps, have a picture."""
    shown = []
    for end in ends:
        if pacing.due(end):
            pacing.made(end)
            shown.append(end)
    return shown


@pytest.mark.parametrize("substep_ms", [0.4, 5.6, 6.0, 8.0, 9.5, 12.0, 16.0])
def test_a_world_of_short_substeps_has_as_many_pictures_as_a_screen(substep_ms: float) -> None:
    shown = made(FramePacing(), [1.0 + k * substep_ms / 1000 for k in range(round(10_000 / substep_ms))])
    assert len(shown) == pytest.approx(600, abs=2)
    gaps = [b - a for a, b in pairwise(shown[1:])]
    assert max(gaps) < PICTURE_S + substep_ms / 1000 + 1e-9
    assert min(gaps) > PICTURE_S - substep_ms / 1000 - 1e-9


def test_a_world_of_long_substeps_has_one_after_each() -> None:
    ends = [0.03 * k for k in range(1, 100)]
    assert made(FramePacing(), ends) == ends


def test_of_what_was_missed_one_is_made_up_for() -> None:
    pacing = FramePacing()
    assert made(pacing, [1.0, 3.0, 3.001, 3.002, 3.003, 3.0167]) == [1.0, 3.0, 3.001, 3.0167]


# ---- Pictures of frames whose rows stand in the engine's order ----


@pytest.fixture
def frame() -> Frame:
    """Forty circles apart from each other, of uneven sizes and masses and in two groups, that move."""
    world = pv.World(boundary=pv.Box((-10, 0), (10, 20)))
    rng = np.random.default_rng(1)
    place = np.stack(np.meshgrid(np.arange(8.0), np.arange(5.0)), axis=-1).reshape(-1, 2)
    for part in (slice(0, 25), slice(25, 40)):
        count = len(place[part])
        group = world.add(position=place[part] + (-4, 3), radius=rng.uniform(0.2, 0.4, count), mass=rng.uniform(1, 9, count))
        group.velocity[:] = rng.normal(0, 3, (count, 2))
    return Session(world).latest


def shuffled(frame: Frame, seed: int) -> Frame:
    """The same, as it would come from between two substeps."""
    order = np.random.default_rng(seed).permutation(len(frame.rows)).astype(np.int32)
    rows, moving = frame.rows[order], frame.moving[order]
    return replace(frame, seq=frame.seq + seed, rows=rows, moving=moving, order=order, moving_order=order)


def test_the_users_order_comes_back(frame: Frame) -> None:
    other = shuffled(frame, 1)
    assert (other.rows != frame.rows).any()
    assert (other.position == frame.position).all()
    assert (other.velocity == frame.velocity).all()
    assert (other.grid == frame.grid).all()
    with pytest.raises(ValueError, match="read-only"):
        other.position[0] = 0.0


@pytest.mark.parametrize("colour", COLOURINGS)
def test_rows_in_any_order_give_the_same_picture(frame: Frame, colour: str) -> None:
    options = ViewOptions(width=300, height=300, colour=colour)
    renderer = JpegRenderer()
    expected = renderer.jpeg(frame, options)
    for seed in (1, 2, 2):
        assert renderer.jpeg(shuffled(frame, seed), options) == expected
    renderer.thread.shutdown()


def test_one_artist_serves_looks_of_different_colours_in_turn(frame: Frame) -> None:
    renderer, other = JpegRenderer(), shuffled(frame, 3)
    views = [ViewOptions(width=200, height=200, colour=colour) for colour in ("order", "mass", "speed")]
    expected = [JpegRenderer().jpeg(frame, options) for options in views]
    assert len(set(expected)) == 3
    assert [renderer.jpeg(other, options) for options in views + views[::-1]] == expected + expected[::-1]
