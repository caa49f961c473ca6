"""Several worlds in one picture: where they stand, what is said about each, and which one a pointer touches."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Page, expect

import pyverlet as pv
from pyverlet import record
from pyverlet.picture import Fixed, periodic_images
from pyverlet.viewers.commands import Drag, Poke, Release, Reset, SetGravity, SetSubsteps, Step
from pyverlet.viewers.layout import Layout
from pyverlet.viewers.protocol import encode_frame, encode_shape
from pyverlet.viewers.session import Session

from .browser import Serve, comes_true, pause, seen_pixels, status, visit
from .sessions import after, unpack


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


def test_tall_rooms_stand_in_a_row_and_open_ones_always_do() -> None:
    assert Layout((0, 0, 3, 8), 4).offset(3) == (9, 0)
    assert Layout((0, 0, 9, 3), 2).offset(1)[0] == 0
    assert Layout((0, 0, 9, 3), 2, bounded=False).offset(1) == (9, 0)


def test_a_runaway_does_not_enter_the_neighbour_where_there_is_one() -> None:
    position = np.array([[1.0, 1.0], [5.0, 1.0]], dtype=np.float32)
    np.testing.assert_array_equal(Layout((0, 0, 4, 9), 2).place(0, position), [(1.0, 1.0), (np.nan, np.nan)])
    alone = Layout((0.0, 0.0, 4.0, 9.0), 1)  # the room itself
    assert alone.view == alone.room
    assert alone.place(0, position) is position


def test_the_picture_of_two_worlds() -> None:
    panels = pv.Panels([pv.Panel("one", room()), pv.Panel("two", room(count=2))], line=5.0)
    frame = Session(panels).latest
    shape = frame.shape
    assert [(panel.name, panel.first, panel.count) for panel in shape.panels] == [("one", 0, 1), ("two", 1, 2)]
    assert [panel.energy for panel in shape.panels] == pytest.approx([0.5 * 9.81, 9.81])
    assert len(shape.outlines) == len(shape.lines) == 2
    dx, dy = np.array(shape.outlines[1][0]) - np.array(shape.outlines[0][0])
    assert dx > 10
    assert dy == 0
    np.testing.assert_allclose(frame.position[1] - frame.position[0], (dx, 0), atol=1e-5)
    assert np.array(shape.lines[1]) - np.array(shape.lines[0]) == pytest.approx(np.array([(dx, 0), (dx, 0)]))
    assert frame.status.particles == 3
    assert frame.status.energies == pytest.approx((0.5 * 9.81, 9.81))
    assert frame.status.energy == pytest.approx(1.5 * 9.81)
    assert 0 < frame.grid.min() < frame.grid.max() < 65535
    assert b'"name":"two"' in encode_shape(shape)
    broken = dataclasses.replace(frame.status, energies=(1.0, float("nan")))
    assert b'"energies":[1.0,null]' in encode_frame(dataclasses.replace(frame, status=broken))
    assert Session(room()).latest.shape.panels == ()  # of a single world


def test_commands_reach_every_world() -> None:
    panels = pv.Panels([pv.Panel("one", room()), pv.Panel("two", room())])
    start, session = panels.state_hash(), Session(panels)
    assert (after(session, SetGravity(0.0, 5.0), SetSubsteps(3), Step(60)).position[:, 1] > 2).all()
    assert after(session, Reset()).status.time == 0
    assert [(world.gravity, world.substeps) for world in panels.worlds] == [((0.0, 5.0), 3)] * 2
    assert panels.state_hash() == start


def test_substeps_that_make_the_difference_stay() -> None:
    panels = pv.Panels([pv.Panel("1", room(1)), pv.Panel("2", room(2))])
    session = Session(panels)
    assert session.latest.shape.differing == ("substeps",)
    after(session, SetSubsteps(7))
    assert [world.substeps for world in panels.worlds] == [1, 2]


def test_a_hand_works_in_the_panel_it_came_down_on() -> None:
    panels = pv.Panels([pv.Panel("one", room()), pv.Panel("two", room())])
    first, second = panels.worlds
    session = Session(panels)
    x, y = session.latest.position[1].tolist()
    position = after(session, Drag(1, x, y, 0.1), Drag(1, x - 11.0, 8.0), Step(60)).position  # over the other panel by now
    assert second.position[0, 1] > 6
    after(session, Release(1), Poke(1, *position[0].tolist()))
    assert (len(first.forces), len(second.forces)) == (1, 0)
    after(session, Release(1))
    assert first.forces == []


# ---- Pictures of periodic rooms: what reaches through a boundary is on both sides, in pixels, on the page and in a film of one
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
    owner, place = periodic_images.copies(np.array(PLACES), world.radius, world.boundary.periodic)
    assert {tuple(row) for row in np.round(place, 6).tolist()} == wanted
    way = place - np.array(PLACES)[owner]
    period = np.array(world.boundary.periodic.period)
    assert np.abs(way) == pytest.approx(np.where(np.abs(way) > 1, period, 0.0))


def test_a_frame_has_copies_on_its_grid() -> None:
    frame = Session(_world()).latest
    head, body = unpack(encode_frame(frame, velocity=True))
    assert head["copies"] == 5
    owner = np.frombuffer(body[32:52], "<u4")
    grid = np.frombuffer(body[52:72], "<u2").reshape(-1, 2)
    x0, y0, x1, y1 = head["view"]
    place = grid / 65535 * (x1 - x0, y1 - y0) + (x0, y0)
    assert place == pytest.approx(frame.copies[1], abs=(x1 - x0) / 65535)
    assert sorted(owner.tolist()) == [0, 1, 1, 1, 3]
    assert len(frame.segments[0]) == 2  # the link through the periodic boundary, from both of its ends


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
    """Its graph is there, and says what theory does; its circles are drawn, those at the periodic boundary twice."""
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
    red = _where_red(seen_pixels(page) * 255)
    columns = np.flatnonzero(red.any(axis=0))
    scale = (columns.max() - columns.min()) / 11.2  # from -0.6 to 10.6
    assert red.sum() == pytest.approx(np.pi * (0.5 * scale) ** 2 * 9, rel=0.1)
