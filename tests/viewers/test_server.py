"""The real server over real sockets: who gets in, what is refused, how a slow or lost tab is treated."""

import contextlib
import io
import json
import random
import socket
import struct
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass
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
from pyverlet.state.slots import Slots
from pyverlet.viewers.launch import server_config
from pyverlet.viewers.protocol import MAX_MESSAGE
from pyverlet.viewers.session import Session
from pyverlet.viewers.web import MAX_IN_FLIGHT, welcome

WaitUntil = Callable[[Callable[[], bool]], None]


@dataclass(frozen=True)
class Server:
    """A session on the air."""

    session: Session
    port: int

    @property
    def http(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def socket(self) -> str:
        return f"ws://127.0.0.1:{self.port}/socket"


@pytest.fixture
def server(session: Session, wait_until: WaitUntil) -> Iterator[Server]:
    """The real server, with the settings it has in earnest, in a thread of this process."""
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as listener:
        port = listener.getsockname()[1]
        program = uvicorn.Server(server_config(session))
        thread = threading.Thread(target=program.run, kwargs={"sockets": [listener]})
        thread.start()
        wait_until(lambda: program.started)
        yield Server(session, port)
        program.should_exit = True
        thread.join(10.0)
        assert not thread.is_alive()


def dial(server: Server, origin: str | None = None, headers: dict[str, str] | None = None) -> ClientConnection:
    """A WebSocket to the server, by default with the origin of its own page."""
    # Whoever has stopped reading would wait for the server's farewell for ten seconds.
    return connect(server.socket, origin=Origin(origin or server.http), additional_headers=headers, close_timeout=0.5)


class Tab:
    """A page reduced to its manners."""

    def __init__(self, connection: ClientConnection) -> None:
        self.connection = connection
        self.shapes: list[dict[str, Any]] = []

    def head(self, timeout: float = 5.0) -> dict[str, Any]:
        data = self.connection.recv(timeout)
        assert isinstance(data, bytes)
        (length,) = struct.unpack_from("<I", data)
        head: dict[str, Any] = json.loads(data[4 : 4 + length])
        return head

    def frame(self, timeout: float = 5.0) -> dict[str, Any]:
        while (head := self.head(timeout))["kind"] != "frame":
            self.shapes.append(head)
        return head

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
        while True:
            head = self.head()
            if head["kind"] == "refused":
                return str(head["reason"])
            if head["kind"] == "frame":
                self.ack(head)


@pytest.fixture
def tab(server: Server) -> Iterator[Tab]:
    with dial(server) as connection:
        yield Tab(connection)


def test_the_page_is_served_and_fetches_nothing_from_elsewhere(server: Server) -> None:
    for path, media_type, holds in (
        ("/", "text/html", b'data-testid="physics-ms"'),
        ("/main.js", "text/javascript", b"WebSocket"),
        ("/page.js", "text/javascript", b"export function mount"),
        ("/draw.js", "text/javascript", b"UNMASKED_RENDERER_WEBGL"),
        ("/chart.js", "text/javascript", b"class Chart"),
        ("/panels.js", "text/javascript", b"class Panels"),
        ("/page.css", "text/css", b"@container"),
    ):
        with urllib.request.urlopen(server.http + path) as answer:
            content = answer.read()
            assert answer.headers["Content-Type"].startswith(media_type)
            assert "default-src 'self'" in answer.headers["Content-Security-Policy"]
            assert answer.headers["Cache-Control"] == "no-store"
        assert holds in content
        assert b"https://" not in content
        assert b"http://" not in content.replace(b"http://www.w3.org/", b"")
    for path in ("/../pyproject.toml", "/%2e%2e/web.py", "/page/index.html", "/etc/passwd", "/socket"):  # nothing but the page
        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(server.http + path)
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


def test_a_foreign_origin_is_refused_and_the_simulation_goes_on(server: Server, tab: Tab, wait_until: WaitUntil) -> None:
    for origin in ("http://evil.example", "https://127.0.0.1.evil.example", "null", "http://127.0.0.1:1"):
        with pytest.raises(InvalidStatus) as refusal, dial(server, origin):
            pass
        assert refusal.value.response.status_code == 403
    # DNS rebinding: the page of evil.example, whose name now means 127.0.0.1, has a matching Origin and Host.
    evil = f"evil.example:{server.port}"
    with pytest.raises(InvalidStatus), dial(server, f"http://{evil}", {"Host": evil}):
        pass
    frames = server.session.latest.status.frames
    wait_until(lambda: server.session.latest.status.frames > frames + 5)
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
        assert ("allowed" if isinstance(text, str) else "binary") in tab.refusal()
        after = tab.frame()
        tab.ack(after)
        assert after["seq"] > before["seq"]
        assert after["status"]["error"] is None
    assert tab.connection.protocol.extensions == []  # frames travel uncompressed


def test_an_oversized_message_ends_its_tab_and_nothing_else(server: Server, tab: Tab) -> None:
    with dial(server) as rude:
        rude.send("x" * (MAX_MESSAGE + 1))
        with contextlib.suppress(ConnectionClosed):
            while True:
                rude.recv(5.0)
        assert rude.close_code == 1009
    assert tab.goes_on()


def test_a_flood_of_commands_is_worked_off(server: Server, tab: Tab, world: pv.World, wait_until: WaitUntil) -> None:
    with dial(server) as rude:
        for k in range(5000):
            rude.send(json.dumps({"type": "gravity", "x": k / 1000, "y": -9.81}))
        wait_until(lambda: world.gravity[0] == pytest.approx(4.999))
    assert tab.goes_on()


def test_a_tab_that_is_gone_before_it_is_refused_is_no_error(
    server: Server, tab: Tab, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    # Starlette raises one error for a socket that breaks, and another for one that is known to be closed.
    gone = RuntimeError('Cannot call "send" once a close message has been sent.')

    async def send(self: WebSocket, data: bytes) -> None:
        raise gone

    with dial(server) as rude:
        Tab(rude).frame()
        monkeypatch.setattr(WebSocket, "send_bytes", send)
        rude.send("{")
        with contextlib.suppress(ConnectionClosed):
            while True:
                rude.recv(5.0)
        monkeypatch.undo()
    assert not [record for record in caplog.records if record.exc_info]
    with dial(server) as other:
        Tab(other).frame()


def test_two_tabs_see_the_same_frames_and_one_steers_for_both(server: Server, tab: Tab) -> None:
    with dial(server) as connection:
        other = Tab(connection)
        other.send(type="pause", on=True)
        other.send(type="gravity", x=0, y=-3.5)
        for each in (tab, other):
            while not ((frame := each.frame())["status"]["paused"] and frame["status"]["gravity"] == [0, -3.5]):
                each.ack(frame)


def test_a_stalled_tab_has_few_frames_in_flight_and_then_gets_the_newest(server: Server, tab: Tab) -> None:
    sent = [tab.frame()]
    with contextlib.suppress(TimeoutError):
        while True:
            sent.append(tab.frame(timeout=0.5))
    assert len(sent) == MAX_IN_FLIGHT <= 3
    now = server.session.latest.seq
    assert now > sent[-1]["seq"] + 20
    tab.ack(sent[0])
    assert tab.frame()["seq"] >= now  # none of those in between


class Treacle:
    """A force of nothing that takes its time: four times in a frame of as many substeps."""

    velocity_dependent = False

    def apply(self, state: Slots, t: float) -> None:
        time.sleep(0.02)


@pytest.mark.slow
def test_a_slow_world_makes_pictures_between_substeps_for_tabs_that_draw_them_only(
    server: Server, tab: Tab, world: pv.World, wait_until: WaitUntil
) -> None:
    def between(frame: dict[str, Any]) -> bool:
        return bool(abs(frame["status"]["time"] * 60 - round(frame["status"]["time"] * 60)) > 1e-3)

    world.forces.append(Treacle())
    wait_until(lambda: server.session.latest.status.physics_ms > 60)
    frames = [tab.frame()]
    while len(frames) < 40:
        tab.ack(frames[-1])
        frames.append(tab.frame())
    assert sum(map(between, frames[10:])) > 15  # of every four pictures three
    times = [frame["status"]["time"] for frame in frames]
    assert times == sorted(times)
    sent = []  # from here on it draws nothing
    with contextlib.suppress(TimeoutError):
        while True:
            sent.append(tab.frame(timeout=0.7))
    assert len(sent) <= MAX_IN_FLIGHT <= 3
    before = server.session.latest
    wait_until(lambda: world.frames >= before.status.frames + 5)
    now = server.session.latest
    assert now.seq - before.seq <= now.status.frames - before.status.frames + 1


def test_an_acknowledgement_of_a_frame_never_sent_is_refused(tab: Tab) -> None:
    frame = tab.frame()
    for seq in (frame["seq"] + 1_000_000, -1):
        tab.send(type="ack", seq=seq)
        assert "seq" in tab.refusal()


def test_a_lost_tab_lets_go_and_costs_nothing(server: Server, tab: Tab, world: pv.World, wait_until: WaitUntil) -> None:
    for _ in range(5):
        with contextlib.suppress(OSError, ConnectionClosed), dial(server) as lost:
            Tab(lost).send(type="drag", x=0.0, y=0.5, reach=1.0)
            wait_until(lambda: len(world.forces) == 1)
            lost.socket.shutdown(socket.SHUT_RDWR)  # no goodbye
        wait_until(lambda: world.forces == [])
    assert tab.goes_on()


LOOK = {"type": "look", "part": None, "width": 320, "height": 240, "colour": "order", "dark": True, "velocity": False}


SENSE: dict[str, tuple[Any, ...]] = {
    "seq": (0, 1, 50), "on": (True, False), "x": (-8.0, 0, 3.5, 1e9), "y": (-9.81, 0.5, 10, -1e9), "reach": (0, 0.5, 1e9),
    "value": (1, 0.5, 8, "rk4"), "scene": (None, "box"), "particles": (None, 5), "part": (None, [0, 0, 1e-6, 1e9]),
    "width": (320,), "height": (240,), "colour": ("order", "energy"), "dark": (True,), "velocity": (True, False),
}  # fmt: skip
NONSENSE: tuple[Any, ...] = (
    None, True, -1, 2**70, 1e308, -1e308, 1e-300, float("nan"), float("inf"), "", "x" * 500, [], {}, [1, 1, 0, 0], [[]],
)  # fmt: skip
KINDS = ("ack", "look", "pause", "step", "reset", "speed", "build", "gravity", "substeps", "restitution", "friction",
         "integrator", "drag", "poke", "pin", "spawn", "delete", "release", "", None)  # fmt: skip


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
def test_nonsense_is_refused_and_the_world_goes_on(
    server: Server, tab: Tab, world: pv.World, wait_until: WaitUntil, seed: int
) -> None:
    rng = random.Random(seed)
    with dial(server) as connection:
        for _ in range(800):
            connection.send(nonsense(rng))
        connection.send(json.dumps({"type": "pause", "on": False}))
        connection.send(json.dumps({"type": "reset"}))
        time.sleep(0.3)
    with dial(server) as connection:  # the server is there, and so is the world
        other = Tab(connection)
        other.send(type="speed", value=1)
        other.send(type="pause", on=False)
        other.send(type="reset")
        seen = server.session.latest.seq
        wait_until(lambda: server.session.latest.seq > seen + 20)
        assert not server.session.latest.status.paused
        assert server.session.latest.status.error is None
        other.ack(other.frame())


def test_ten_tabs_one_of_them_stalled(server: Server, tab: Tab) -> None:
    """Nine go on, the tenth gets two at most, and the physics keeps its pace."""
    with contextlib.ExitStack() as stack:
        tabs = [tab, *(Tab(stack.enter_context(dial(server))) for _ in range(8))]
        stalled = Tab(stack.enter_context(dial(server)))
        stalled.frame()
        began, before, seconds = time.perf_counter(), server.session.latest.status, 1.2
        rates: list[float] = []
        threads = [threading.Thread(target=lambda each=each: rates.append(each.rate(seconds))) for each in tabs]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        after = server.session.latest.status
        pace = (after.frames - before.frames + after.dropped - before.dropped) / (time.perf_counter() - began)
        assert pace == pytest.approx(60, rel=0.1)
        assert min(rates) > 0
        kept = 0
        with contextlib.suppress(TimeoutError):
            while True:
                stalled.frame(timeout=0.5)
                kept += 1
        assert kept <= MAX_IN_FLIGHT - 1


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


def test_pictures_are_of_the_size_and_the_part_that_were_asked_for(monkeypatch: pytest.MonkeyPatch, server: Server) -> None:
    monkeypatch.setattr("pyverlet.viewers.renderer.PICTURES_FROM", 9)
    with dial(server) as connection:
        connection.send(json.dumps({**LOOK, "part": [-10, 0, 10, 10]}))
        connection.send(json.dumps({"type": "pause", "on": True}))
        wanted = None
        while wanted is None:
            data = connection.recv(60.0)  # the raster may have to be compiled
            assert isinstance(data, bytes)
            (length,) = struct.unpack_from("<I", data)
            head = json.loads(data[4 : 4 + length])
            if head["kind"] == "shape":
                assert head["drawnHere"]
                assert len(data) == 4 + length  # no circles travel
                continue
            assert head["kind"] == "picture"
            connection.send(json.dumps({"type": "ack", "seq": head["seq"]}))
            if head["view"] == [-10, 0, 10, 10]:
                wanted = Image.open(io.BytesIO(data[4 + length :]))
        assert wanted.size == (320, 160)  # 20 x 10 m in 320 x 240 pixels
        pixel = np.asarray(wanted.convert("RGB"))[152, 160]  # the middle one, 8 pixels above the floor
        assert int(pixel.max()) - int(pixel.min()) > 40


def test_without_pillow_a_large_world_says_what_would_help(monkeypatch: pytest.MonkeyPatch, server: Server) -> None:
    monkeypatch.setattr("pyverlet.viewers.renderer.PICTURES_FROM", 9)
    monkeypatch.setattr("pyverlet.viewers.renderer._can_draw", lambda: False)
    with dial(server) as connection:
        tab = Tab(connection)
        assert tab.frame()["kind"] == "frame"
        assert "pip install 'pyverlet[page]'" in tab.shapes[0]["note"]


def test_pictures_go_on_when_a_circle_is_pinned_or_lost(monkeypatch: pytest.MonkeyPatch, server: Server) -> None:
    monkeypatch.setattr("pyverlet.viewers.renderer.PICTURES_FROM", 5)
    with dial(server) as connection:
        tab = Tab(connection)
        for message in (LOOK, {"type": "pin", "x": 0, "y": 0.5, "reach": 1}, {"type": "delete", "x": 8, "y": 0.5, "reach": 1}):
            tab.send(**message)
            for _ in range(4):
                head = tab.head(60.0)
                if head["kind"] == "picture":
                    tab.ack(head)
        while head["kind"] != "picture" or head["status"]["particles"] != 8:
            head = tab.head(60.0)
            if head["kind"] == "picture":
                tab.ack(head)


def test_a_tab_whose_frames_cannot_be_made_is_told_by_a_closed_socket(monkeypatch: pytest.MonkeyPatch, server: Server) -> None:
    def broken(*_: Any, **__: Any) -> bytes:
        raise MemoryError

    monkeypatch.setattr("pyverlet.viewers.protocol.encode_frame", broken)
    with dial(server) as connection, pytest.raises(ConnectionClosed):
        Tab(connection).frame()
