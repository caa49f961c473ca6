"""The real server over real sockets: who gets in, what is refused, how a slow or lost tab is treated."""

import contextlib
import io
import json
import random
import socket
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import uvicorn
from PIL import Image
from starlette.websockets import WebSocket
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

import pyverlet as pv
from pyverlet.viewers.commands import COMMANDS
from pyverlet.viewers.launch import server_config
from pyverlet.viewers.protocol import MAX_MESSAGE
from pyverlet.viewers.session import Session
from pyverlet.viewers.web import MAX_IN_FLIGHT, welcome

from .sessions import LOOK, Treacle, unpack, wait_until


@pytest.fixture
def port(session: Session) -> Iterator[int]:
    """Of the real server, with the settings it has in earnest, in a thread of this process."""
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as listener:
        program = uvicorn.Server(server_config(session))
        thread = threading.Thread(target=program.run, kwargs={"sockets": [listener]})
        thread.start()
        wait_until(lambda: program.started)
        yield listener.getsockname()[1]
        program.should_exit = True
        thread.join(10.0)
        assert not thread.is_alive()


class Tab:
    """A page reduced to its manners."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.shapes: list[dict[str, Any]] = []

    def parts(self, timeout: float = 5.0) -> tuple[dict[str, Any], bytes]:
        """Head and body of the next message."""
        data = self.connection.recv(timeout)
        assert isinstance(data, bytes)
        return unpack(data)

    def picture(self, timeout: float = 60.0) -> tuple[dict[str, Any], bytes]:
        """The next one of the server's, acknowledged."""
        while (parts := self.parts(timeout))[0]["kind"] != "picture":
            self.shapes.append(parts[0])
        self.ack(parts[0])
        return parts

    def frame(self, timeout: float = 5.0) -> dict[str, Any]:
        while (head := self.parts(timeout)[0])["kind"] != "frame":
            self.shapes.append(head)
        return head

    def unacknowledged(self, timeout: float) -> list[dict[str, Any]]:
        """All frames that come to one that acknowledges none."""
        frames = []
        with contextlib.suppress(TimeoutError):
            while True:
                frames.append(self.frame(timeout))
        return frames

    def ended(self) -> int | None:
        """The code with which the server closes the socket; what comes before is forgotten."""
        with contextlib.suppress(ConnectionClosed):
            while True:
                self.connection.recv(5.0)
        return self.connection.close_code

    def send(self, **message: Any) -> None:
        self.connection.send(json.dumps(message))

    def ack(self, frame: dict[str, Any]) -> None:
        self.send(type="ack", seq=frame["seq"])

    def rate(self, seconds: float) -> float:
        """Frames a second, when each is acknowledged at once."""
        count, end = 0, time.monotonic() + seconds
        while time.monotonic() < end:
            self.ack(self.frame())
            count += 1
        return count / seconds

    def goes_on(self, frames: int = 15) -> bool:
        """Whether newer frames keep coming, each soon after the one before is acknowledged; how fast is the machine's affair."""
        seqs = []
        for _ in range(frames):
            seqs.append((frame := self.frame())["seq"])
            self.ack(frame)
        return seqs == sorted(set(seqs))

    def refusal(self) -> str:
        """The next refusal; frames before it are acknowledged."""
        while (head := self.parts()[0])["kind"] != "refused":
            if head["kind"] == "frame":
                self.ack(head)
        return str(head["reason"])


@contextlib.contextmanager
def opened(port: int, origin: str | None = None, headers: dict[str, str] | None = None) -> Iterator[Tab]:
    """A WebSocket to the server, by default with the origin of its own page."""
    own = Origin(origin or f"http://127.0.0.1:{port}")
    # Whoever has stopped reading would wait for the server's farewell for ten seconds.
    with connect(f"ws://127.0.0.1:{port}/socket", origin=own, additional_headers=headers, close_timeout=0.5) as connection:
        yield Tab(connection)


@pytest.fixture
def tab(port: int) -> Iterator[Tab]:
    with opened(port) as tab:
        yield tab


def test_the_page_is_served_and_fetches_nothing_from_elsewhere(port: int) -> None:
    address = f"http://127.0.0.1:{port}"
    for path, media_type, holds in (
        ("/", "text/html", b'data-testid="physics-ms"'),
        ("/main.js", "text/javascript", b"WebSocket"),
        ("/page.js", "text/javascript", b"export function mount"),
        ("/draw.js", "text/javascript", b"UNMASKED_RENDERER_WEBGL"),
        ("/chart.js", "text/javascript", b"class Chart"),
        ("/panels.js", "text/javascript", b"class Panels"),
        ("/page.css", "text/css", b"@container"),
    ):
        with urllib.request.urlopen(address + path) as answer:
            content = answer.read()
            assert answer.headers["Content-Type"].startswith(media_type)
            assert "default-src 'self'" in answer.headers["Content-Security-Policy"]
            assert answer.headers["Cache-Control"] == "no-store"
        assert holds in content
        assert b"https://" not in content
        assert b"http://" not in content.replace(b"http://www.w3.org/", b"")
    for path in ("/../pyproject.toml", "/%2e%2e/web.py", "/page/index.html", "/etc/passwd", "/socket"):  # nothing but the page
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(address + path)
        assert refused.value.code == 404
        refused.value.close()


def test_a_tab_gets_the_shape_and_then_frames_at_the_pace_of_the_clock(tab: Tab) -> None:
    first = tab.frame()
    assert tab.shapes[0]["title"] == "nine"
    tab.ack(first)
    began = time.monotonic()
    assert tab.goes_on(60)
    last = tab.frame()
    passed = last["status"]["time"] - first["status"]["time"]
    assert 55 / 60 < passed < time.monotonic() - began + 0.2  # never ahead of the clock; behind it, where frames were dropped
    assert len(tab.shapes) == 1


def test_a_foreign_origin_is_refused_and_the_simulation_goes_on(port: int, tab: Tab, session: Session) -> None:
    for origin in ("http://evil.example", "https://127.0.0.1.evil.example", "null", "http://127.0.0.1:1"):
        with pytest.raises(InvalidStatus) as refusal, opened(port, origin):
            pass
        assert refusal.value.response.status_code == 403
    # DNS rebinding: the page of evil.example, whose name now means 127.0.0.1, has a matching Origin and Host.
    evil = f"evil.example:{port}"
    with pytest.raises(InvalidStatus), opened(port, f"http://{evil}", {"Host": evil}):
        pass
    frames = session.latest.status.frames
    wait_until(lambda: session.latest.status.frames > frames + 5)
    tab.ack(tab.frame())


@pytest.mark.parametrize(
    ("origin", "host", "expected"),
    [
        ("http://127.0.0.1:8000", "127.0.0.1:8000", True),
        ("http://localhost:9000", "localhost:9000", True),  # the near end of ssh -L
        ("http://[::1]:8000", "[::1]:8000", True),
        (None, "127.0.0.1:8000", True),  # not a browser
        ("http://localhost:3000", "localhost:8000", False),  # another server's page on this machine
        ("http://evil.example", "127.0.0.1:8000", False),
        ("http://evil.example", "evil.example", False),
        ("http://lab.example:8000", "lab.example:8000", False),
        ("http://evil.example", "lab.example:8000", False),
        (None, "[", False),
        (None, "", False),
    ],
)
def test_who_is_welcome(origin: str | None, host: str, expected: bool) -> None:
    assert welcome(origin, host) is expected


def test_a_malformed_message_is_refused_with_a_reason_and_the_tab_goes_on(tab: Tab) -> None:
    malformed = ("", "{", "[]", '{"type": "explode"}', '{"type": "substeps", "value": 0}', "\x00", b"\x00\x01")
    for text in malformed:
        before = tab.frame()
        tab.ack(before)
        tab.connection.send(text)
        assert ("allowed" if isinstance(text, str) else "no text") in tab.refusal()
        after = tab.frame()
        tab.ack(after)
        assert after["seq"] > before["seq"]
        assert after["status"]["error"] is None
    assert tab.connection.protocol.extensions == []  # frames travel uncompressed


def test_an_oversized_message_ends_its_tab_and_nothing_else(port: int, tab: Tab) -> None:
    with opened(port) as rude:
        rude.connection.send("x" * (MAX_MESSAGE + 1))
        assert rude.ended() == 1009
    assert tab.goes_on()


def test_a_flood_of_commands_is_worked_off(port: int, tab: Tab, world: pv.World) -> None:
    with opened(port) as rude:
        for k in range(5000):
            rude.send(type="gravity", x=k / 1000, y=-9.81)
        wait_until(lambda: world.gravity[0] == pytest.approx(4.999))
    assert tab.goes_on()


def test_a_tab_that_is_gone_before_it_is_refused_is_no_error(
    port: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    # Starlette raises one error for a socket that breaks, and another for one that is known to be closed.
    async def send(self: WebSocket, data: bytes) -> None:
        raise RuntimeError('Cannot call "send" once a close message has been sent.')

    with opened(port) as rude:
        rude.frame()
        monkeypatch.setattr(WebSocket, "send_bytes", send)
        rude.connection.send("{")
        rude.ended()
        monkeypatch.undo()
    assert not [record for record in caplog.records if record.exc_info]
    with opened(port) as other:
        other.frame()


def test_two_tabs_see_the_same_frames_and_one_steers_for_both(port: int, tab: Tab) -> None:
    with opened(port) as other:
        other.send(type="pause", on=True)
        other.send(type="gravity", x=0, y=-3.5)
        for each in (tab, other):
            while not ((frame := each.frame())["status"]["paused"] and frame["status"]["gravity"] == [0, -3.5]):
                each.ack(frame)


def test_a_stalled_tab_has_few_frames_in_flight_and_then_gets_the_newest(tab: Tab, session: Session) -> None:
    sent = tab.unacknowledged(timeout=0.5)
    assert len(sent) == MAX_IN_FLIGHT <= 3
    now = session.latest.seq
    assert now > sent[-1]["seq"] + 20
    tab.ack(sent[0])
    assert tab.frame()["seq"] >= now  # none of those in between


@pytest.mark.slow
def test_a_slow_world_makes_pictures_between_substeps_for_tabs_that_draw_them_only(
    tab: Tab, world: pv.World, session: Session
) -> None:
    def between(frame: dict[str, Any]) -> bool:
        return bool(abs(frame["status"]["time"] * 60 - round(frame["status"]["time"] * 60)) > 1e-3)

    world.forces.append(Treacle(0.02))  # four substeps a frame
    wait_until(lambda: session.latest.status.physics_ms > 60)
    frames = [tab.frame()]
    while len(frames) < 40:
        tab.ack(frames[-1])
        frames.append(tab.frame())
    assert sum(map(between, frames[10:])) > 15  # of every four pictures three
    times = [frame["status"]["time"] for frame in frames]
    assert times == sorted(times)
    assert len(tab.unacknowledged(timeout=0.7)) <= MAX_IN_FLIGHT <= 3  # from here on it draws nothing
    before = session.latest
    wait_until(lambda: world.frames >= before.status.frames + 5)
    now = session.latest
    assert now.seq - before.seq <= now.status.frames - before.status.frames + 1


def test_an_acknowledgement_of_a_frame_never_sent_is_refused(tab: Tab) -> None:
    frame = tab.frame()
    for seq in (frame["seq"] + 1_000_000, -1):
        tab.send(type="ack", seq=seq)
        assert "seq" in tab.refusal()


def test_a_lost_tab_lets_go_and_costs_nothing(port: int, tab: Tab, world: pv.World) -> None:
    for _ in range(5):
        with contextlib.suppress(OSError, ConnectionClosed), opened(port) as lost:
            lost.send(type="drag", x=0.0, y=0.5, reach=1.0)
            wait_until(lambda: len(world.forces) == 1)
            lost.connection.socket.shutdown(socket.SHUT_RDWR)  # no goodbye
        wait_until(lambda: world.forces == [])
    assert tab.goes_on()


SENSE: dict[str, tuple[Any, ...]] = {
    "seq": (0, 1, 50), "on": (True, False), "x": (-8.0, 0, 3.5, 1e9), "y": (-9.81, 0.5, 10, -1e9), "reach": (0, 0.5, 1e9),
    "value": (1, 0.5, 8, "rk4"), "scene": (None, "box"), "particles": (None, 5), "part": (None, [0, 0, 1e-6, 1e9]),
    "width": (320,), "height": (240,), "colour": ("order", "energy"), "dark": (True,), "velocity": (True, False),
}  # fmt: skip
NONSENSE: tuple[Any, ...] = (
    None, True, -1, 2**70, 1e308, -1e308, 1e-300, float("nan"), float("inf"), "", "x" * 500, [], {}, [1, 1, 0, 0], [[]],
)  # fmt: skip
KINDS = (*COMMANDS, "ack", "look", "", None)


def nonsense(rng: random.Random) -> str | bytes:
    """A message as hardly a page sends it: words of the protocol in any order, values far out, wrong, missing or cut off."""
    message: dict[str, Any] = {"type": rng.choice(KINDS)}
    for name, values in SENSE.items():
        if rng.random() < 0.95:
            message[name] = rng.choice(NONSENSE if rng.random() < 0.1 else values)
    text = json.dumps(message)
    if rng.random() < 0.1:
        text = text[: rng.randrange(len(text))]
    return text.encode() if rng.random() < 0.05 else text


@pytest.mark.parametrize("seed", range(2))
def test_nonsense_is_refused_and_the_world_goes_on(port: int, tab: Tab, session: Session, seed: int) -> None:
    rng = random.Random(seed)
    with opened(port) as rude:
        for _ in range(800):
            rude.connection.send(nonsense(rng))
        rude.send(type="pause", on=False)
        rude.send(type="reset")
        time.sleep(0.3)
    with opened(port) as other:  # the server is there, and so is the world
        other.send(type="speed", value=1)
        other.send(type="pause", on=False)
        other.send(type="reset")
        seen = session.latest.seq
        wait_until(lambda: session.latest.seq > seen + 20)
        assert (session.latest.status.paused, session.latest.status.error) == (False, None)
        other.ack(other.frame())


def test_ten_tabs_one_of_them_stalled(port: int, tab: Tab, session: Session) -> None:
    """Nine go on, the tenth gets two at most, and the physics keeps its pace."""
    with contextlib.ExitStack() as stack:
        stalled, *tabs = (stack.enter_context(opened(port)) for _ in range(9))
        stalled.frame()
        began, before, seconds = time.perf_counter(), session.latest.status, 1.2
        with ThreadPoolExecutor(9) as pool:
            assert min(pool.map(lambda each: each.rate(seconds), (tab, *tabs))) > 0
        after = session.latest.status
        pace = (after.frames - before.frames + after.dropped - before.dropped) / (time.perf_counter() - began)
        assert pace == pytest.approx(60, rel=0.1)
        assert len(stalled.unacknowledged(timeout=0.5)) <= MAX_IN_FLIGHT - 1


def test_a_tab_may_look_elsewhere_while_nothing_moves(tab: Tab) -> None:
    tab.send(type="pause", on=True)
    while not (frame := tab.frame())["status"]["paused"]:
        tab.ack(frame)
    tab.ack(frame)
    for k in range(5):
        tab.send(**{**LOOK, "part": [0, 0, 1 + k, 1]})
        again = tab.frame()
        assert again["view"] == [0, 0, 1 + k, 1]
        tab.ack(again)


def test_pictures_are_of_the_size_and_the_part_that_were_asked_for(monkeypatch: pytest.MonkeyPatch, port: int) -> None:
    monkeypatch.setattr("pyverlet.viewers.renderer.PICTURES_FROM", 9)
    with opened(port) as tab:
        tab.send(**{**LOOK, "part": [-10, 0, 10, 10]})
        tab.send(type="pause", on=True)
        shape, circles = tab.parts(60.0)
        assert shape["drawnHere"]
        assert circles == b""  # none travel
        while (picture := tab.picture())[0]["view"] != [-10, 0, 10, 10]:
            pass
    wanted = Image.open(io.BytesIO(picture[1]))
    assert wanted.size == (400, 200)  # 20 x 10 m in 400 x 300 pixels
    pixel = np.asarray(wanted.convert("RGB"))[190, 200]  # the middle one, 10 pixels above the floor
    assert int(pixel.max()) - int(pixel.min()) > 40


def test_without_pillow_a_large_world_says_what_would_help(monkeypatch: pytest.MonkeyPatch, port: int) -> None:
    monkeypatch.setattr("pyverlet.viewers.renderer.PICTURES_FROM", 9)
    monkeypatch.setattr("pyverlet.viewers.renderer._can_draw", lambda: False)
    with opened(port) as tab:
        assert tab.frame()["kind"] == "frame"
        assert "pip install 'pyverlet[page]'" in tab.shapes[0]["note"]


def test_pictures_go_on_when_a_circle_is_pinned_or_lost(monkeypatch: pytest.MonkeyPatch, port: int) -> None:
    monkeypatch.setattr("pyverlet.viewers.renderer.PICTURES_FROM", 5)
    with opened(port) as tab:
        for message in (LOOK, {"type": "pin", "x": 0, "y": 0.5, "reach": 1}, {"type": "delete", "x": 8, "y": 0.5, "reach": 1}):
            tab.send(**message)
            for _ in range(3):
                tab.picture()
        while tab.picture()[0]["status"]["particles"] != 8:
            pass


def test_a_tab_whose_frames_cannot_be_made_is_told_by_a_closed_socket(monkeypatch: pytest.MonkeyPatch, port: int) -> None:
    def broken(*_: Any, **__: Any) -> bytes:
        raise MemoryError

    monkeypatch.setattr("pyverlet.viewers.protocol.encode_frame", broken)
    with opened(port) as tab, pytest.raises(ConnectionClosed):
        tab.frame()
