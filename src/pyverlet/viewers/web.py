"""The page and its WebSocket: carries a session's frames to any number of tabs, and their commands back.

Each tab has at most `MAX_IN_FLIGHT` frames on the way that it has not drawn yet. A slow tab is sent fewer frames,
always the newest, and never builds up a lag; a stalled or lost one costs nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections import deque
from collections.abc import Awaitable, Callable
from importlib import resources
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from pyverlet.errors import InputError
from pyverlet.viewers.commands import Release
from pyverlet.viewers.frames import Frame, Shape
from pyverlet.viewers.protocol import Ack, decode, encode_frame, encode_refusal, encode_shape
from pyverlet.viewers.session import Session

MAX_IN_FLIGHT = 2
"""Frames sent to a tab and not drawn yet. One would halve the rate; three add a frame of lag and nothing else."""

LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})

POLICY_VIOLATION = 1008
"""WebSocket close code (RFC 6455, 7.4.1)."""

PAGE = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/page.js": ("page.js", "text/javascript; charset=utf-8"),
    "/draw.js": ("draw.js", "text/javascript; charset=utf-8"),
    "/panels.js": ("panels.js", "text/javascript; charset=utf-8"),
    "/chart.js": ("chart.js", "text/javascript; charset=utf-8"),
    "/page.css": ("page.css", "text/css; charset=utf-8"),
}

HEADERS = {
    # The page belongs to the running version: never one from the cache of an older one.
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; connect-src 'self' ws: wss:",
    "X-Content-Type-Options": "nosniff",
}


def make_app(session: Session, *, only_loopback: bool = True) -> Starlette:
    """The web application around a session. It neither starts nor stops it.

    Args:
        session: what to show.
        only_loopback: refuse WebSockets that did not ask for this machine by one of its own names. Every page in the
            world may ask the browser to connect to localhost, or point a name of its own at 127.0.0.1.
    """
    encoder = _Encoder()
    hands = itertools.count()

    async def socket(websocket: WebSocket) -> None:
        if not welcome(websocket.headers.get("origin"), websocket.headers.get("host", ""), only_loopback):
            await websocket.close(POLICY_VIOLATION)
            return
        await websocket.accept()
        await Tab(websocket, session, encoder, next(hands)).serve()

    routes = [Route(path, _file(name, media_type)) for path, (name, media_type) in PAGE.items()]
    return Starlette(routes=[*routes, WebSocketRoute("/socket", socket)])


def welcome(origin: str | None, host: str, only_loopback: bool) -> bool:
    """Whether a WebSocket request with these headers comes from our own page.

    `Origin` must be the very address in `Host`: through `ssh -L` both name the near end. No `Origin` means no browser.
    """
    if only_loopback and _name(f"//{host}") not in LOOPBACK_NAMES:
        return False
    return origin is None or origin in (f"http://{host}", f"https://{host}")


def _name(url: str) -> str | None:
    try:
        return urlsplit(url).hostname
    except ValueError:  # a bracket left open
        return None


def _file(name: str, media_type: str) -> Callable[[Request], Awaitable[Response]]:
    content = (resources.files("pyverlet.viewers") / "page" / name).read_bytes()

    async def answer(request: Request) -> Response:
        return Response(content, media_type=media_type, headers=HEADERS)

    return answer


class _Encoder:
    """Encodes each frame once, however many tabs watch."""

    def __init__(self) -> None:
        self._frame: Frame | None = None
        self._frame_bytes = b""
        self._shape: Shape | None = None
        self._shape_bytes = b""

    def frame(self, frame: Frame) -> bytes:
        if frame is not self._frame:
            self._frame, self._frame_bytes = frame, encode_frame(frame)
        return self._frame_bytes

    def shape(self, shape: Shape) -> bytes:
        if shape is not self._shape:
            self._shape, self._shape_bytes = shape, encode_shape(shape)
        return self._shape_bytes


class Tab:
    """One WebSocket: a reader of commands and acknowledgements, a writer of frames."""

    def __init__(self, websocket: WebSocket, session: Session, encoder: _Encoder, hand: int) -> None:
        self._websocket = websocket
        self._session = session
        self._encoder = encoder
        self._hand = hand
        self._in_flight: deque[int] = deque()
        self._wake = asyncio.Event()

    async def serve(self) -> None:
        """Until the tab is gone."""
        loop = asyncio.get_running_loop()

        def on_frame() -> None:  # on the physics thread
            with contextlib.suppress(RuntimeError):  # the loop has just closed
                loop.call_soon_threadsafe(self._wake.set)

        unsubscribe = self._session.subscribe(on_frame)
        writer = asyncio.create_task(self._write())
        try:
            await self._read()
        except WebSocketDisconnect:
            pass
        finally:
            unsubscribe()
            self._session.submit(Release(self._hand))
            writer.cancel()
            with contextlib.suppress(asyncio.CancelledError, WebSocketDisconnect, RuntimeError):
                await writer

    async def _read(self) -> None:
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            text = message.get("text")
            try:
                if text is None:
                    raise InputError("message is binary; allowed is a JSON text")
                request = decode(text, self._hand)
                if isinstance(request, Ack):
                    self._acknowledge(request.seq)
                else:
                    self._session.submit(request)
            except InputError as error:
                await self._websocket.send_bytes(encode_refusal(str(error)))

    def _acknowledge(self, seq: int) -> None:
        if seq not in self._in_flight:
            raise InputError(f"seq is {seq}; allowed are frames on the way: {list(self._in_flight)}")
        while self._in_flight and self._in_flight[0] <= seq:
            self._in_flight.popleft()
        self._wake.set()

    async def _write(self) -> None:
        shape: Shape | None = None
        seq = -1
        while True:
            frame = self._session.latest
            if frame.seq == seq or len(self._in_flight) >= MAX_IN_FLIGHT:
                await self._wake.wait()
                self._wake.clear()
                continue
            if frame.shape is not shape:
                shape = frame.shape
                await self._websocket.send_bytes(self._encoder.shape(shape))
            seq = frame.seq
            self._in_flight.append(seq)
            await self._websocket.send_bytes(self._encoder.frame(frame))
