"""Several worlds in one picture: where they stand, what is said about each, and which one a pointer touches."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.viewers.commands import Drag, Pause, Poke, Release, Reset, SetGravity, SetSubsteps
from pyverlet.viewers.layout import Layout
from pyverlet.viewers.session import Session

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
