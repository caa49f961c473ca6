"""Pictures of periodic rooms: what reaches through a seam is on both sides, in pixels, on the page and in a film of one file."""

from __future__ import annotations

import json
import struct
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import image
from numpy.typing import NDArray
from playwright.sync_api import Page, expect

import pyverlet as pv
from pyverlet import record
from pyverlet.picture import Fixed, periodic_images
from pyverlet.viewers.protocol import encode_frame
from pyverlet.viewers.session import Session

from .browser import Serve, comes_true, pause, status, visit

RED, PLACES = (255, 0, 0), [(0.1, 4.0), (9.9, 7.9), (5.0, 4.0), (6.0, 0.3)]


def _world(axes: str = "xy") -> pv.World:
    """One at the left end, one in the upper right corner, one in the middle, one at the foot; the first two are linked."""
    world = pv.World(gravity=(0, 0), boundary=pv.Periodic((0, 0), (10, 8), axes=axes), collisions=None)
    four = world.add(position=PLACES, radius=0.5, spin=1.0, on_overlap="push")
    world.links.append(pv.Rope(four, 0, 1, length=4.0))
    return world


@pytest.mark.parametrize(
    ("axes", "wanted"),
    [
        ("xy", {(10.1, 4.0), (-0.1, 7.9), (9.9, -0.1), (-0.1, -0.1), (6.0, 8.3)}),
        ("x", {(10.1, 4.0), (-0.1, 7.9)}),
        ("y", {(9.9, -0.1), (6.0, 8.3)}),
    ],
)
def test_copies(axes: str, wanted: set[tuple[float, float]]) -> None:
    world = _world(axes)
    owner, place = periodic_images.copies(np.array(PLACES), world.radius, world.boundary.seam)
    assert {tuple(row) for row in np.round(place, 6).tolist()} == wanted
    way = place - np.array(PLACES)[owner]
    period = np.array(world.boundary.seam.period)
    assert np.abs(way) == pytest.approx(np.where(np.abs(way) > 1, period, 0.0))


def test_a_frame_has_copies_on_its_grid() -> None:
    frame = Session(_world()).latest
    data = encode_frame(frame, velocity=True)
    (length,) = struct.unpack_from("<I", data)
    head, body = json.loads(data[4 : 4 + length]), data[4 + length :]
    assert head["copies"] == 5
    owner = np.frombuffer(body[32:52], "<u4")
    grid = np.frombuffer(body[52:72], "<u2").reshape(-1, 2)
    x0, y0, x1, y1 = head["view"]
    place = grid / 65535 * (x1 - x0, y1 - y0) + (x0, y0)
    assert place == pytest.approx(frame.copies[1], abs=(x1 - x0) / 65535)
    assert sorted(owner.tolist()) == [0, 1, 1, 1, 3]
    assert len(frame.segments[0]) == 2  # the link through the seam, from both of its ends


def _where_red(picture: NDArray[Any]) -> NDArray[Any]:
    return (picture[..., 0] > 180) & (picture[..., 1] < 90) & (picture[..., 2] < 90)


def test_pictures_have_both_halves() -> None:
    """In a picture of 100 pixels a metre, from (-1, -1) to (11, 9): nine discs, of which four are the circles' own."""
    world = _world()
    shot = record.to_image(world, size=(1200, 1000), part=(-1, -1, 11, 9), colour=Fixed(np.tile(RED, (4, 1)).astype(np.uint8)))
    red = _where_red(shot)
    for x, y in [*PLACES, (10.1, 4.0), (-0.1, 7.9), (9.9, -0.1), (-0.1, -0.1), (6.0, 8.3)]:
        assert red[round((9 - y) * 100) + 25, round((x + 1) * 100) - 10]
    discs = np.pi * 50**2 * 9
    assert red.sum() == pytest.approx(discs, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("size", [1, 300])
def test_the_gas_on_the_page(page: Page, program: Serve, size: int) -> None:
    """Its graph is there, and says what theory does; its circles are drawn, those at the seam twice."""
    visit(page, program("gas", size).address)
    expect(page.get_by_test_id("graph")).to_be_visible()
    expect(page.get_by_test_id("graph")).to_contain_text("equation of state")
    if size > 1:
        assert comes_true(page, lambda: status(page)["time"] > 3.0)
        pause(page)
        graph = status(page)["graph"]
        assert sum(graph["bars"]) * graph["most"] / len(graph["bars"]) == pytest.approx(1.0, abs=0.01)
        measured, theory = (float(word.strip(";")) for word in graph["note"].split() if word[0].isdigit())
        assert measured == pytest.approx(theory, rel=0.15)  # 300 circles for 3 s
        page.locator("#scene").select_option("cage")
        expect(page.get_by_test_id("graph")).to_be_hidden()


@pytest.mark.slow
def test_a_film_of_one_file(page: Page, tmp_path: Path) -> None:
    """As the page, from positions alone: the disc at the left end is at the right end, too."""
    path = tmp_path / "a.html"
    record.to_video(_world(), path, seconds=0.2, colour=Fixed(np.tile(RED, (4, 1)).astype(np.uint8)))
    page.goto(path.as_uri())
    page.wait_for_timeout(500)
    red = _where_red(np.asarray(image.imread(BytesIO(page.screenshot()))[:, :, :3]) * 255)
    columns = np.flatnonzero(red.any(axis=0))
    scale = (columns.max() - columns.min()) / 11.2  # from -0.6 to 10.6
    assert red.sum() == pytest.approx(np.pi * (0.5 * scale) ** 2 * 9, rel=0.1)
