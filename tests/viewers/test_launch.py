"""Starting and ending: ports, addresses, screens, Ctrl-C, and what an import costs."""

import asyncio
import contextlib
import os
import re
import signal
import socket
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.worlds import refused

import pyverlet as pv
from pyverlet.viewers import launch, view
from pyverlet.viewers.commands import Click, Delete, Drag, Key, Pause, Pin, Redo, Release, SetSlider, Spawn, Step, Undo
from pyverlet.viewers.handle import Page
from pyverlet.viewers.launch import serve
from pyverlet.viewers.presentation import CallbackFunctions, Presentation
from pyverlet.viewers.session import Session
from pyverlet.viewers.view_state import ViewState

from .browser import Served
from .sessions import after, nine_circles, wait_until

SCRIPT = """
import numpy as np, pyverlet as pv
world = pv.World(boundary=pv.Box((-10, 0), (10, 20)))
world.add(position=np.column_stack((np.arange(-8.0, 9.0, 2.0), np.full(9, 5.0))), radius=0.5)
pv.view(world, port=0, title="nine")
print("frames after view:", world.frames, flush=True)
"""


POSIX = pytest.mark.skipif(os.name != "posix", reason="signals as a terminal sends them, and a browser that is a shell script")
SCREENS = ("DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION")


def start(**environment: str) -> Served:
    kept = {name: value for name, value in os.environ.items() if name not in SCREENS}
    return Served("-c", SCRIPT, env={**kept, **environment})


@POSIX
def test_a_script_views_its_world_until_ctrl_c_and_goes_on() -> None:
    with start() as script:
        port = script.address.rstrip("/").rpartition(":")[2]
        assert script.address == f"http://127.0.0.1:{port}/"
        assert f"ssh -L {port}:127.0.0.1:{port} " in script.line()
        with urllib.request.urlopen(script.address, timeout=10) as page:
            assert page.status == 200
        time.sleep(0.5)
        out, _ = script.end()
    assert script.process.returncode == 0
    assert int(re.findall(r"frames after view: (\d+)", out)[0]) > 10


@pytest.mark.slow
@POSIX
def test_sigterm_ends_the_program_as_usual() -> None:
    with start() as script:
        time.sleep(0.5)
        script.end(signal.SIGTERM)
    assert script.process.returncode == -signal.SIGTERM


@POSIX
@pytest.mark.parametrize(("screen", "opens"), [({"DISPLAY": ":7"}, True), pytest.param({}, False, marks=pytest.mark.slow)])
def test_the_browser_opens_by_itself_where_there_is_a_screen(tmp_path: Path, screen: dict[str, str], opens: bool) -> None:
    browser, visited = tmp_path / "browser", tmp_path / "visited"
    browser.write_text(f'#!/bin/sh\necho "$1" > {visited}\n')
    browser.chmod(0o755)
    with start(BROWSER=f"{browser} %s", **screen) as script:
        deadline = time.monotonic() + (10.0 if opens else 1.0)
        while time.monotonic() < deadline and not (visited.exists() and visited.read_text()):
            time.sleep(0.02)
        script.end()
    assert visited.exists() is opens
    if opens:
        assert visited.read_text().strip() == script.address


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({"DISPLAY": ":0"}, True), ({"WAYLAND_DISPLAY": "wayland-0"}, True), ({}, False), ({"DISPLAY": ""}, False),
        ({"DISPLAY": "localhost:10.0", "SSH_CONNECTION": "10.0.0.1 5000 10.0.0.2 22"}, False),
    ],
)  # fmt: skip
def test_has_screen_on_linux(monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], expected: bool) -> None:
    for name in SCREENS:
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "platform", "linux")
    assert launch.has_screen() is expected


def never() -> pv.World:
    raise AssertionError("the port comes first")


@pytest.mark.parametrize("listening", [True, False])
def test_a_taken_port_is_named_before_anything_is_built(listening: bool) -> None:
    with contextlib.closing(socket.socket()) as other:
        other.bind(("127.0.0.1", 0))
        if listening:
            other.listen()
        port = other.getsockname()[1]
        with pytest.raises(pv.InputError, match=f"port is {port}, which another program is using; allowed is"):
            serve(never, title="cage", port=port, open_browser=False)


@pytest.mark.parametrize(
    ("call", "named"),
    [
        (lambda: serve(never, title="cage", port=70_000, open_browser=False), "port is 70000"),
        (lambda: serve(never, title="cage", port=-1, open_browser=False), "port is -1"),
        (lambda: serve(never, title="cage", port="80", open_browser=False), "port is '80'"),  # type: ignore[arg-type]
        (lambda: view(pv.World(), port=0, open_browser=False, dt=0.0), "dt is 0"),
        *((lambda dt=dt: Session(pv.World(), dt=dt), f"dt is {dt:g}") for dt in (0.0, float("nan"))),
        *((lambda height=height: pv.widget(pv.World(), height=height), "height is") for height in (5, 1e9, "tall")),
    ],
)
def test_bad_arguments_are_named(call: Callable[[], None], named: str) -> None:
    refused(re.escape(named), call)


def test_what_build_refuses_is_passed_on_and_the_port_is_free_again() -> None:
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as probe:
        port = probe.getsockname()[1]
    for _ in range(2):
        refused("substeps", serve, lambda: pv.World(substeps=0), title="cage", port=port, open_browser=False)


def test_inside_an_event_loop() -> None:
    async def main() -> None:
        view(pv.World(), port=0, open_browser=False)

    refused("event loop", asyncio.run, main())


# ---- A page beside a program that goes on, and undo without a browser ----


@contextlib.contextmanager
def shown(world: pv.World) -> Iterator[Page]:
    page = pv.view(world, block=False, open_browser=False)
    try:
        yield page
    finally:
        page.close()


def test_a_handle_on_a_page() -> None:
    world = nine_circles()
    with shown(world) as page:
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
        page.close()  # and once more at the end
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
    with shown(world):
        for k in range(60):  # while another thread steps it
            group = world.add(position=(0.3 * k - 9, 28.0), radius=0.3)
            if k % 2:
                world.remove(group)
            if k % 7 == 0:
                world.step(1 / 120)
            if k % 20 == 0:
                world.restore(world.save())
    assert len(world) == 330
    assert np.isfinite(world.position).all()
    assert world.escaped() == 0


def test_draw_keys_click_and_sliders_of_a_program() -> None:
    world, told = nine_circles(), []
    lift = pv.slider("lift of the test", 0, 10, 2)

    def wrong(world: pv.World, pen: object) -> None:
        raise RuntimeError("no pen")

    answers = CallbackFunctions(draw=wrong, keys=lambda world, key: told.append(key), click=lambda *what: told.append(what[2]))
    session = Session(Presentation("mine", pv.Panels.of(world), callbacks=answers))
    status = after(session, Key("a"), Click(0, 1.0, 2.0, "middle"), SetSlider("lift of the test", 99.0), Step(3)).status
    assert (told, lift.value) == (["a", "middle"], 10)
    assert world.frames >= 3  # it goes on without what has failed
    assert "draw has failed" in (status.complaint or "")
    assert ("lift of the test", 0.0, 10.0, 0.0, 10.0) in status.sliders
    with pytest.raises(pv.InputError, match="keys is 3"):
        CallbackFunctions(keys=3)  # type: ignore[arg-type]


def played(world: pv.World, frames: int) -> ViewState:
    view_state = ViewState(Presentation.of(world, "nine"))
    for _ in range(frames):
        view_state.step(1 / 60)
    return view_state


def test_undo_gives_back_every_bit() -> None:
    world = nine_circles()
    view_state = played(world, 5)
    x, y = world.position[3].tolist()
    hashes = [world.state_hash()]
    strokes: list[list[Any]] = [
        [Delete(0, x, y, 0.1)], [Spawn(0, 0.0, 9.0), Spawn(0, 3.0, 9.0)], [Pin(0, -8.0, 0.5, 0.3)], [Drag(0, 8.0, 0.5, 0.3)]
    ]  # fmt: skip
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
    while view_state.history.depth[0]:
        view_state.do(Undo())
    for _ in range(20):
        view_state.step(1 / 60)
    twin = nine_circles()
    played(twin, 25)
    assert world.state_hash() == twin.state_hash()


def test_pauses_do_not_keep_a_program_waiting() -> None:
    world = nine_circles()
    with shown(world) as page:
        page._session.submit(Pause(True))
        wait_until(lambda: page._session.latest.status.paused)
        world.add(position=(0, 10), radius=0.5)
        wait_until(lambda: page._session.latest.status.particles == 10 or len(world) == 10)
    assert len(world) == 10
