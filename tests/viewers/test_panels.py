"""Several worlds in one picture: where they stand, what is said about each, and which one a pointer touches."""

import dataclasses
import json
import struct
from collections.abc import Callable
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
from pyverlet.viewers.commands import Drag, Pause, Poke, Release, Reset, SetGravity, SetSubsteps
from pyverlet.viewers.layout import Layout
from pyverlet.viewers.protocol import encode_frame
from pyverlet.viewers.session import Session

from .browser import Serve, comes_true, pause, status, visit

WaitUntil = Callable[[Callable[[], bool]], None]


def room(substeps: int = 4, count: int = 1) -> pv.World:
    world = pv.World(boundary=pv.Box((0, 0), (10, 20)), substeps=substeps)
    world.add(position=np.column_stack((2.0 * np.arange(count) + 2, np.full(count, 0.5))))
    return world


@pytest.mark.parametrize("count", range(1, 8))
@pytest.mark.parametrize("room", [(0, 0, 4, 9), (-1, -1, 1, 1), (0, 0, 9, 2)])
def test_cells_tile_the_picture(room: tuple[float, float, float, float], count: int) -> None:
    layout = Layout(room, count)
    x0, y0, x1, y1 = layout.view
    seen = []
    for panel in range(count):
        dx, dy = layout.offset(panel)
        corners = (room[0] + dx, room[1] + dy, room[2] + dx, room[3] + dy)
        assert x0 - 1e-9 <= corners[0] < corners[2] <= x1 + 1e-9
        assert y0 - 1e-9 <= corners[1] < corners[3] <= y1 + 1e-9
        assert layout.at((corners[0] + corners[2]) / 2, (corners[1] + corners[3]) / 2) == panel
        left, top, width, height = layout.strip(panel)
        # The strip ends where the cell begins.
        assert x0 + left * (x1 - x0) == pytest.approx(corners[0])
        assert y1 - (top + height) * (y1 - y0) == pytest.approx(corners[3])
        assert width * (x1 - x0) == pytest.approx(room[2] - room[0])
        seen.append(corners)
    assert len(set(seen)) == count


def test_one_panel_is_the_room_itself() -> None:
    layout = Layout((0.0, 0.0, 4.0, 9.0), 1)
    assert layout.view == layout.room
    position = np.array([[-100.0, 3.0]], dtype=np.float32)
    assert layout.place(0, position) is position


def test_tall_rooms_stand_in_a_row_and_open_ones_always_do() -> None:
    assert Layout((0, 0, 3, 8), 4).offset(3) == (9, 0)
    assert Layout((0, 0, 9, 3), 2).offset(1)[0] == 0
    assert Layout((0, 0, 9, 3), 2, bounded=False).offset(1) == (9, 0)


def test_a_runaway_does_not_enter_the_neighbour() -> None:
    layout = Layout((0, 0, 4, 9), 2)
    placed = layout.place(0, np.array([[1.0, 1.0], [5.0, 1.0]], dtype=np.float32))
    assert placed[0].tolist() == [1.0, 1.0]
    assert np.isnan(placed[1]).all()


def test_the_picture_of_two_worlds() -> None:
    panels = pv.Panels([pv.Panel("one", room()), pv.Panel("two", room(count=2))], line=5.0)
    frame = Session(panels).latest
    shape = frame.shape
    assert [(panel.name, panel.first, panel.count) for panel in shape.panels] == [("one", 0, 1), ("two", 1, 2)]
    assert [panel.energy for panel in shape.panels] == pytest.approx([0.5 * 9.81, 9.81])
    assert len(shape.outlines) == len(shape.lines) == 2
    (dx, dy) = np.array(shape.outlines[1][0]) - np.array(shape.outlines[0][0])
    assert dx > 10
    assert dy == 0
    np.testing.assert_allclose(frame.position[1] - frame.position[0], (dx, 0), atol=1e-5)
    assert np.array(shape.lines[1]) - np.array(shape.lines[0]) == pytest.approx(np.array([(dx, 0), (dx, 0)]))
    assert frame.status.particles == 3
    assert frame.status.energies == pytest.approx((0.5 * 9.81, 9.81))
    assert frame.status.energy == pytest.approx(1.5 * 9.81)
    assert frame.grid.min() > 0
    assert frame.grid.max() < 65535


def test_a_single_world_has_no_panels() -> None:
    assert Session(room()).latest.shape.panels == ()


def test_commands_reach_every_world(wait_until: WaitUntil) -> None:
    panels = pv.Panels([pv.Panel("one", room()), pv.Panel("two", room())])
    start = panels.state_hash()
    with Session(panels) as session:
        session.submit(SetGravity(0.0, 5.0))
        session.submit(SetSubsteps(3))
        wait_until(lambda: bool((session.latest.position[:, 1] > 2).all()))
        session.submit(Pause(True))
        session.submit(Reset())
        wait_until(lambda: session.latest.status.time == 0)
    assert [world.gravity for world in panels.worlds] == [(0.0, 5.0)] * 2
    assert [world.substeps for world in panels.worlds] == [3, 3]
    assert panels.state_hash() == start


def test_substeps_that_make_the_difference_stay(wait_until: WaitUntil) -> None:
    panels = pv.Panels([pv.Panel("1", room(1)), pv.Panel("2", room(2))])
    with Session(panels) as session:
        assert session.latest.shape.differing == ("substeps",)
        session.submit(SetSubsteps(7))
        session.submit(Pause(True))
        wait_until(lambda: session.latest.status.paused)
    assert [world.substeps for world in panels.worlds] == [1, 2]


def test_a_hand_works_in_the_panel_it_came_down_on(wait_until: WaitUntil) -> None:
    panels = pv.Panels([pv.Panel("one", room()), pv.Panel("two", room())])
    with Session(panels) as session:
        x, y = (float(value) for value in session.latest.position[1])
        session.submit(Drag(1, x, y, 0.1))
        session.submit(Drag(1, x - 11.0, 8.0))  # over the other panel by now
        wait_until(lambda: bool(panels.worlds[1].position[0, 1] > 6))
        session.submit(Release(1))
        session.submit(Poke(1, *(float(value) for value in session.latest.position[0])))
        wait_until(lambda: len(panels.worlds[0].forces) == 1)
        assert panels.worlds[1].forces == []
        session.submit(Release(1))
        wait_until(lambda: panels.worlds[0].forces == [])


def test_panels_travel(wait_until: WaitUntil) -> None:
    from pyverlet.viewers.protocol import encode_frame, encode_shape

    frame = Session(pv.Panels([pv.Panel("one", room()), pv.Panel("two", room())])).latest
    assert b'"name":"two"' in encode_shape(frame.shape)
    broken = dataclasses.replace(frame.status, energies=(1.0, float("nan")))
    assert b'"energies":[1.0,null]' in encode_frame(dataclasses.replace(frame, status=broken))


# ---- Pictures of periodic rooms: what reaches through a seam is on both sides, in pixels, on the page and in a film of one
# file ----


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
