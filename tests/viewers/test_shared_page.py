"""A page beside a program that goes on, and undo without a browser."""

import threading
import urllib.request
from typing import Any

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.viewers.commands import Click, Delete, Drag, Key, Pause, Pin, Redo, Release, SetSlider, Spawn, Undo
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.view_state import ViewState

from .conftest import WaitUntil, nine_circles


def test_a_handle_on_a_page(wait_until: WaitUntil) -> None:
    world = nine_circles()
    page = pv.view(world, block=False, open_browser=False)
    try:
        assert repr(page) == f"Page({page.url})"
        with urllib.request.urlopen(page.url) as answer:
            assert b"pyverlet" in answer.read()
        wait_until(lambda: world.time > 0.05)
        with page:  # between two frames, for as long as this takes
            now = world.time
            threading.Event().wait(0.2)
            assert world.time == now
            group = world.add(position=(0, 10), radius=0.5)
            group.velocity[:] = (0, 3)
            with page:
                assert world.time == now
        wait_until(lambda: world.time > now + 0.05)
    finally:
        page.close()
        page.close()
    assert not page.open
    assert repr(page) == "Page(closed)"
    then = world.time
    world.step(1 / 60)  # the program's alone again
    assert world.time == pytest.approx(then + 1 / 60)
    with pytest.raises(OSError, match="refused"):
        urllib.request.urlopen(page.url)


def test_the_program_and_the_page_share_the_world_safely() -> None:
    world = pv.World(boundary=pv.Box((-20, 0), (20, 30)))
    world.add(position=pv.fill(world.boundary, radius=0.5, count=300).position)
    page = pv.view(world, block=False, open_browser=False)
    try:
        for k in range(60):  # while another thread steps it
            group = world.add(position=(0.3 * k - 9, 28.0), radius=0.3)
            if k % 2:
                world.remove(group)
            if k % 7 == 0:
                world.step(1 / 120)
            if k % 20 == 0:
                world.restore(world.save())
    finally:
        page.close()
    assert len(world) == 330
    assert np.isfinite(world.position).all()
    assert world.escaped() == 0


def test_draw_keys_click_and_sliders_of_a_program(wait_until: WaitUntil) -> None:
    world, told = nine_circles(), []
    lift = pv.slider("lift of the test", 0, 10, 2)

    def wrong(world: pv.World, pen: object) -> None:
        raise RuntimeError("no pen")

    from pyverlet.viewers.session import Session
    from pyverlet.viewers.user_callbacks import CallbackFunctions

    answers = CallbackFunctions(draw=wrong, keys=lambda world, key: told.append(key), click=lambda *what: told.append(what[2]))
    presentation = Presentation("mine", pv.Panels.of(world), callbacks=answers)
    with Session(presentation) as session:
        for command in (Key("a"), Click(0, 1.0, 2.0, "middle"), SetSlider("lift of the test", 99.0)):
            session.submit(command)
        wait_until(lambda: told == ["a", "middle"] and lift.value == 10)
        wait_until(lambda: session.latest.status.complaint is not None)
        assert "draw has failed" in (session.latest.status.complaint or "")
        assert ("lift of the test", 0.0, 10.0, 0.0, 10.0) in session.latest.status.sliders
        now = world.time
        wait_until(lambda: world.time > now)
    with pytest.raises(pv.InputError, match="keys is 3"):
        CallbackFunctions(keys=3)  # type: ignore[arg-type]


def test_undo_gives_back_every_bit() -> None:
    world = nine_circles()
    view_state = ViewState(Presentation.of(world, "nine"))
    for _ in range(5):
        view_state.step(1 / 60)
    x, y = (float(value) for value in world.position[3])
    hashes = [world.state_hash()]
    strokes: list[list[Any]] = [
        [Delete(0, x, y, 0.1)],
        [Spawn(0, 0.0, 9.0), Spawn(0, 3.0, 9.0)],
        [Pin(0, -8.0, 0.5, 0.3)],
        [Drag(0, 8.0, 0.5, 0.3)],
    ]
    for stroke in strokes:
        for command in stroke:
            view_state.do(command)
        for _ in range(3):
            view_state.step(1 / 60)
        view_state.do(Release(0))
        hashes.append(world.state_hash())
    assert view_state.history.depth == (4, 0)
    for known in reversed(hashes[:-1]):
        view_state.do(Undo())
        assert world.state_hash() == known
    view_state.do(Undo())  # there is nothing more
    assert (world.state_hash(), view_state.history.depth) == (hashes[0], (0, 4))
    for known in hashes[1:]:
        view_state.do(Redo())
        assert world.state_hash() == known
    # What is done after an undo takes the place of what could be redone; what hits nothing is nothing done.
    view_state.do(Undo())
    view_state.do(Delete(0, 100.0, 100.0, 0.1))
    assert view_state.history.depth == (3, 1)
    view_state.do(Delete(0, 8.0, 0.5, 0.3))
    assert view_state.history.depth == (4, 0)
    # It goes on from there as it would have.
    twin = nine_circles()
    other = ViewState(Presentation.of(twin, "nine"))
    for _ in range(5):
        other.step(1 / 60)
    while view_state.history.depth[0]:
        view_state.do(Undo())
    for each in (view_state, other):
        for _ in range(20):
            each.step(1 / 60)
    assert world.state_hash() == twin.state_hash()


def test_pauses_do_not_keep_a_program_waiting(wait_until: WaitUntil) -> None:
    world = nine_circles()
    page = pv.view(world, block=False, open_browser=False)
    try:
        page._session.submit(Pause(True))
        wait_until(lambda: page._session.latest.status.paused)
        world.add(position=(0, 10), radius=0.5)
        wait_until(lambda: page._session.latest.status.particles == 10 or len(world) == 10)
    finally:
        page.close()
    assert len(world) == 10
