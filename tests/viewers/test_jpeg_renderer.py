"""Pictures of frames whose rows stand in the engine's order."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.viewers.frames import Frame
from pyverlet.viewers.jpeg_renderer import JpegRenderer
from pyverlet.viewers.session import Session
from pyverlet.viewers.view_options import COLOURINGS, ViewOptions


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
