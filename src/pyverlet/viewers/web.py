"""The page and its WebSocket: sends a session's frames to any number of tabs, and receives their commands.

Each tab has at most `MAX_IN_FLIGHT` frames sent but not drawn. A slow tab gets fewer frames, always the newest, without delay;
a stalled or lost one costs nothing.
"""

import asyncio
import contextlib
import itertools
from collections import deque
from importlib import resources
from urllib.parse import urlsplit

from starlette.applications import Starlette
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from pyverlet.common.errors import InputError
from pyverlet.viewers.commands import Release, ViewOptions
from pyverlet.viewers.frames import Frame
from pyverlet.viewers.protocol import Display, Encoder
from pyverlet.viewers.renderer import draws_here
from pyverlet.viewers.session import Session

MAX_IN_FLIGHT = 3
"""Frames sent to a tab but not drawn. One would halve the rate; with two a screen missed one in a hundred, since neither frames
of a world nor ticks of a page are equally long. The page ensures that they cause no growing delay."""

LOOPBACK_NAMES = frozenset({"127.0.0.1", "localhost", "::1"})

POLICY_VIOLATION = 1008  # WebSocket close code (RFC 6455, 7.4.1)

MEDIA_TYPES = {"html": "text/html; charset=utf-8", "js": "text/javascript; charset=utf-8", "css": "text/css; charset=utf-8"}

HEADERS = {
    # Pages must match the running version, so they are not cached.
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data: blob:; connect-src 'self' ws: wss:",
    "X-Content-Type-Options": "nosniff",
}


def make_app(session: Session) -> Starlette:
    """The web application of a session, which it neither starts nor stops."""
    encoder, pointers = Encoder(), itertools.count()

    async def socket(websocket: WebSocket) -> None:
        if not welcome(websocket.headers.get("origin"), websocket.headers.get("host", "")):
            await websocket.close(POLICY_VIOLATION)
            return
        await websocket.accept()
        await Tab(websocket, session, encoder, next(pointers)).serve()

    routes = []
    for file in (resources.files("pyverlet.viewers") / "page").iterdir():
        if media_type := MEDIA_TYPES.get(file.name.rpartition(".")[2]):
            answer = Response(file.read_bytes(), media_type=media_type, headers=HEADERS)
            routes.append(Route("/" if file.name == "index.html" else f"/{file.name}", answer, methods=["GET"]))
    return Starlette(routes=[*routes, WebSocketRoute("/socket", socket)])


def welcome(origin: str | None, host: str) -> bool:
    """Whether a WebSocket request with these headers comes from our own page, under a name of this machine.

    Any web page may ask the browser to connect to localhost, or point a name of its own at 127.0.0.1. So `Origin` must equal the
    address in `Host`: through `ssh -L` both name the near end. Requests without `Origin` do not come from browsers.
    """
    name = None
    with contextlib.suppress(ValueError):  # an unclosed bracket
        name = urlsplit(f"//{host}").hostname
    return name in LOOPBACK_NAMES and (origin is None or origin in (f"http://{host}", f"https://{host}"))


class Tab:
    """One WebSocket: reads commands and acknowledgements, writes frames."""

    def __init__(self, websocket: WebSocket, session: Session, encoder: Encoder, pointer: int) -> None:
        self._websocket, self._session, self._encoder = websocket, session, encoder
        self._display = Display(session, encoder, pointer)
        self._in_flight: deque[int] = deque()
        self._wake = asyncio.Event()

    async def serve(self) -> None:
        """Serve until the tab is closed."""
        loop = asyncio.get_running_loop()

        def on_frame() -> None:  # on the physics thread
            with contextlib.suppress(RuntimeError):  # the loop has just closed
                loop.call_soon_threadsafe(self._wake.set)

        unsubscribe = self._session.subscribe(on_frame)
        tasks = [asyncio.create_task(self._read()), asyncio.create_task(self._write())]
        try:
            done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                with contextlib.suppress(WebSocketDisconnect):
                    task.result()  # if writing fails, the socket is closed, and the page reconnects
        finally:
            unsubscribe()
            self._session.submit(Release(self._display.pointer))
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _read(self) -> None:
        while True:
            message = await self._websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            for refusal in self._display.obey(message.get("text"), self._acknowledge):
                await self._send(refusal)
            self._wake.set()

    async def _send(self, message: bytes) -> None:
        try:
            await self._websocket.send_bytes(message)
        except RuntimeError as error:  # raised by Starlette if the tab was closed meanwhile
            raise WebSocketDisconnect from error

    def _acknowledge(self, seq: int) -> None:
        if seq not in self._in_flight:
            raise InputError(f"seq is {seq}; allowed are frames on the way: {list(self._in_flight)}")
        while self._in_flight[0] < seq:
            self._in_flight.popleft()
        self._in_flight.popleft()  # only one: a frame is sent again when the tab changes its view

    async def _write(self) -> None:
        while True:
            news = self._display.news() if len(self._in_flight) < MAX_IN_FLIGHT else None
            if news is None:
                await self._wake.wait()
                self._wake.clear()
                continue
            frame, options, shape = news
            for message in shape:
                await self._send(message)
            self._session.take(frame, velocity=options.moving)
            self._in_flight.append(frame.seq)
            await self._send(await self._encode(frame, options))

    async def _encode(self, frame: Frame, options: ViewOptions) -> bytes:
        if not draws_here(frame.shape):
            return self._encoder.frame(frame, options)
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._encoder.renderer.thread, self._encoder.frame, frame, options)
