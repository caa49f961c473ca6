"""From a world to an open tab: take the port, build, say where to look, serve until Ctrl-C."""

import asyncio
import contextlib
import errno
import getpass
import os
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable, Iterator

import uvicorn

from pyverlet.ground import checks
from pyverlet.ground.errors import InputError
from pyverlet.ground.interrupts import first_signal
from pyverlet.viewers import DEFAULT_PORT
from pyverlet.viewers.commands import ViewOptions
from pyverlet.viewers.presentation import Presentation, Repertoire
from pyverlet.viewers.protocol import MAX_MESSAGE
from pyverlet.viewers.renderer import JpegRenderer, draws_here
from pyverlet.viewers.session import Session
from pyverlet.viewers.view_state import ViewState
from pyverlet.viewers.web import LOOPBACK_NAMES, make_app
from pyverlet.world.panels import Panels
from pyverlet.world.world import World

ENDS, STAYS = "Ctrl-C ends it", "close() ends it"

GOODBYE_S = 1  # whole seconds open tabs get to hang up


def serve(
    build: Callable[[], World | Panels | Presentation],
    *,
    title: str,
    host: str = "127.0.0.1",
    port: int | None = None,
    open_browser: bool = True,
    dt: float = 1 / 60,
    repertoire: Repertoire | None = None,
    view_state: Callable[[Presentation], ViewState] = ViewState,
    while_running: Callable[[Session], contextlib.AbstractContextManager[None]] | None = None,
) -> None:
    """Build a world and show it on a live page until Ctrl-C.

    The port is taken before the world is built, so that a taken one is refused at once. Arguments that are not listed are as for
    `pyverlet.view` and `Session`.

    Args:
        build: makes the world, the panels or the presentation.
        host: address to listen on; anything but this machine's own lets the whole network in.
        while_running: what is entered for the session, and left at its end.

    Raises:
        InputError: the host or port cannot be used, dt is not positive, or whatever `build` refuses.
    """
    _refuse_running_loop()
    with contextlib.suppress(KeyboardInterrupt), take_port(host, DEFAULT_PORT if port is None else port) as listener:
        presentation = Presentation.of(build(), title)
        session = Session(presentation, dt=dt, repertoire=repertoire, view_state=view_state)
        if draws_here(session.latest.shape):
            JpegRenderer().jpeg(session.latest, ViewOptions())  # loads what it needs: no tab shall wait for that
        with on_air(session, listener, only_loopback=host in LOOPBACK_NAMES), _ended_by_signals(session):
            announce(title, address(host, listener), host, open_browser)
            with while_running(session) if while_running else contextlib.nullcontext():
                session.run()  # here, in the thread that built the world: see there


@contextlib.contextmanager
def on_air(session: Session, listener: socket.socket, *, only_loopback: bool) -> Iterator[None]:
    """Serve the page from a thread. Should the server fail, the session ends and the error is raised here."""
    server = uvicorn.Server(server_config(session, only_loopback=only_loopback))
    failures: list[BaseException] = []

    def run() -> None:
        try:
            server.run(sockets=[listener])
        except BaseException as error:  # uvicorn leaves with SystemExit too
            failures.append(error)
        finally:
            session.stop()

    thread = threading.Thread(target=run, name="pyverlet-web", daemon=True)
    thread.start()
    try:
        yield
    finally:
        server.should_exit = True
        thread.join(2.0 * GOODBYE_S + 1.0)
    if failures:
        raise RuntimeError("the web server has failed") from failures[0]


@contextlib.contextmanager
def _ended_by_signals(session: Session) -> Iterator[None]:
    """Ctrl-C, or SIGTERM, lets the frame under way finish, so that the world is complete afterwards."""
    caught: list[int] = []

    def end(number: int) -> None:
        caught.append(number)
        session.stop()

    with first_signal(end, signal.SIGINT, signal.SIGTERM):
        yield
    if signal.SIGTERM in caught:
        signal.raise_signal(signal.SIGTERM)


def server_config(session: Session, *, only_loopback: bool = True) -> uvicorn.Config:
    """How uvicorn serves a session."""
    return uvicorn.Config(
        make_app(session, only_loopback=only_loopback),
        loop="asyncio",
        http="h11",
        ws="websockets-sansio",
        ws_max_size=MAX_MESSAGE,
        ws_per_message_deflate=False,  # compressing a frame of 400 kB takes 16 ms
        lifespan="off",
        log_level="error",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=GOODBYE_S,
    )


def has_screen() -> bool:
    """Whether a browser opened here would be seen: not over ssh, and on Linux only with a display."""
    if os.environ.get("SSH_CONNECTION"):
        return False
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def take_port(host: str, port: int) -> socket.socket:
    """A socket that listens there; InputError if that cannot be."""
    checks.whole("port", port, least=0, most=65535)
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        allowed = "an address or name of this machine, such as '127.0.0.1'"
        raise InputError(f"host is {host!r}; allowed is {allowed}") from None
    listener = socket.socket(family, kind, protocol)
    try:
        # This lets a port be taken again while old connections time out; on Windows it would share it with its owner.
        if os.name == "posix":
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(where)
        # Two programs may bind a port, the first to listen has it. Early calls wait until the server is up.
        listener.listen()
    except OSError as error:
        listener.close()
        raise InputError(_why_not(error, host, port)) from None
    return listener


def _why_not(error: OSError, host: str, port: int) -> str:
    if error.errno == errno.EADDRINUSE:
        return f"port is {port}, which another program is using; allowed is a free port, or 0 to have one chosen"
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"port is {port}, which this user may not open; allowed are 1024 to 65535, or 0 to have one chosen"
    return f"host is {host!r}, which cannot be listened on ({error.strerror}); allowed is an address of this machine"


def address(host: str, listener: socket.socket) -> str:
    """Of the page."""
    name = f"[{host}]" if ":" in host else host
    return f"http://{name}:{listener.getsockname()[1]}/"


def announce(title: str, url: str, host: str, open_browser: bool, *, blocks: bool = True) -> None:
    """Say where to look, and open a tab there if that is wanted and can be seen."""
    shown = open_browser and has_screen()
    sys.stdout.write(f"{title}: {url}   ({ENDS if blocks else STAYS})\n")
    if host in LOOPBACK_NAMES and not shown:
        port = url.rstrip("/").rpartition(":")[2]
        user = "you"
        with contextlib.suppress(KeyError, OSError, ImportError):  # a container's user may have no name
            user = getpass.getuser()
        tunnel = f"ssh -L {port}:{host}:{port} {user}@{socket.gethostname()}"
        sys.stdout.write(f"from another machine: {tunnel}   then open {url} there\n")
    sys.stdout.flush()
    if shown:  # in a thread of its own: some browsers' launchers return only when the browser does
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()


def _refuse_running_loop() -> None:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return
    allowed = "a plain script (in a notebook: pyverlet.widget)"
    raise InputError(f"view() was called inside a running event loop, which it would block; allowed is {allowed}")
