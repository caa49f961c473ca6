"""Starting and ending: ports, addresses, screens, Ctrl-C, and what an import costs."""

import asyncio
import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path

import pytest

import pyverlet as pv
from pyverlet.viewers import launch, view
from pyverlet.viewers.launch import serve

SCRIPT = """
import numpy as np, pyverlet as pv
world = pv.World(boundary=pv.Box((-10, 0), (10, 20)))
world.add(position=np.column_stack((np.arange(-8.0, 9.0, 2.0), np.full(9, 5.0))), radius=0.5)
pv.view(world, port=0, title="nine")
print("frames after view:", world.frames, flush=True)
"""


def start(environment: dict[str, str], script: str = SCRIPT) -> subprocess.Popen[str]:
    kept = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION")}
    return subprocess.Popen(
        [sys.executable, "-W", "error", "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**kept, **environment},
    )  # fmt: skip


def address_in(line: str) -> str:
    found = re.search(r"http://127\.0\.0\.1:\d+/", line)
    assert found, line
    return found[0]


@pytest.mark.skipif(os.name != "posix", reason="signals as a terminal sends them")
def test_a_script_views_its_world_until_ctrl_c_and_goes_on() -> None:
    with start({}) as script:
        assert script.stdout is not None
        first, second = script.stdout.readline(), script.stdout.readline()
        address = address_in(first)
        port = address.rstrip("/").rpartition(":")[2]
        assert f"ssh -L {port}:127.0.0.1:{port} " in second
        with urllib.request.urlopen(address, timeout=10) as page:
            assert page.status == 200
        time.sleep(0.5)
        script.send_signal(signal.SIGINT)
        out, err = script.communicate(timeout=20)
    assert script.returncode == 0
    assert "Traceback" not in err
    frames = re.search(r"frames after view: (\d+)", out)
    assert frames
    assert int(frames[1]) > 10


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals as a terminal sends them")
def test_sigterm_ends_the_program_as_usual() -> None:
    with start({}) as script:
        assert script.stdout is not None
        address_in(script.stdout.readline())
        time.sleep(0.5)
        script.send_signal(signal.SIGTERM)
        _, err = script.communicate(timeout=20)
    assert script.returncode == -signal.SIGTERM
    assert "Traceback" not in err


@pytest.mark.skipif(os.name != "posix", reason="a browser that is a shell script")
@pytest.mark.parametrize(("screen", "opens"), [({"DISPLAY": ":7"}, True), pytest.param({}, False, marks=pytest.mark.slow)])
def test_the_browser_opens_by_itself_where_there_is_a_screen(tmp_path: Path, screen: dict[str, str], opens: bool) -> None:
    browser, visited = tmp_path / "browser", tmp_path / "visited"
    browser.write_text(f'#!/bin/sh\necho "$1" > {visited}\n')
    browser.chmod(0o755)
    with start({"BROWSER": f"{browser} %s", **screen}) as script:
        assert script.stdout is not None
        address = address_in(script.stdout.readline())
        deadline = time.monotonic() + (10.0 if opens else 1.0)
        while time.monotonic() < deadline and not (visited.exists() and visited.read_text()):
            time.sleep(0.02)
        script.send_signal(signal.SIGINT)
        script.communicate(timeout=20)
    assert visited.exists() is opens
    if opens:
        assert visited.read_text().strip() == address


@pytest.mark.parametrize(
    ("environment", "expected"),
    [
        ({"DISPLAY": ":0"}, True), ({"WAYLAND_DISPLAY": "wayland-0"}, True), ({}, False), ({"DISPLAY": ""}, False),
        ({"DISPLAY": "localhost:10.0", "SSH_CONNECTION": "10.0.0.1 5000 10.0.0.2 22"}, False),
    ],
)  # fmt: skip
def test_has_screen_on_linux(monkeypatch: pytest.MonkeyPatch, environment: dict[str, str], expected: bool) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SSH_CONNECTION"):
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
        (lambda: serve(never, title="cage", host="no such host", port=0, open_browser=False), "host is 'no such host'"),
        (lambda: serve(never, title="cage", host="192.0.2.1", port=0, open_browser=False), "host is '192.0.2.1'"),
        (lambda: view(pv.World(), port=0, open_browser=False, dt=0.0), "dt is 0"),
    ],
)
def test_bad_arguments_are_named(call: Callable[[], None], named: str) -> None:
    with pytest.raises(pv.InputError, match=re.escape(named)):
        call()


def test_what_build_refuses_is_passed_on_and_the_port_is_free_again() -> None:
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as probe:
        port = probe.getsockname()[1]

    def refuse() -> pv.World:
        return pv.World(substeps=0)

    for _ in range(2):
        with pytest.raises(pv.InputError, match="substeps"):
            serve(refuse, title="cage", port=port, open_browser=False)


def test_inside_an_event_loop() -> None:
    async def main() -> None:
        view(pv.World(), port=0, open_browser=False)

    with pytest.raises(pv.InputError, match="event loop"):
        asyncio.run(main())


def test_importing_pyverlet_does_not_load_the_server() -> None:
    heavy = "starlette", "uvicorn", "websockets", "asyncio"
    code = f"import pyverlet, pyverlet.viewers, sys; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
