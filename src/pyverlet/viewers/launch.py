"""Starts the server: takes the port, builds the world, announces the address, and serves until Ctrl-C."""

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

from pyverlet.common import checks
from pyverlet.common.errors import InputError
from pyverlet.common.interrupts import first_signal
from pyverlet.viewers import DEFAULT_PORT
from pyverlet.viewers.commands import ViewOptions
from pyverlet.viewers.presentation import Presentation
from pyverlet.viewers.protocol import MAX_MESSAGE
from pyverlet.viewers.renderer import JpegRenderer, draws_here
from pyverlet.viewers.session import Session
from pyverlet.viewers.view_state import ViewState
from pyverlet.viewers.web import make_app
from pyverlet.world.panels import Panels
from pyverlet.world.world import World

ENDS, STAYS = "Ctrl-C ends it", "close() ends it"

HERE = "127.0.0.1"  # without a password, so not reachable from other machines

GOODBYE_S = 1  # whole seconds for open tabs to close


def serve(
    build: Callable[[], World | Panels | Presentation],
    *,
    title: str,
    port: int | None = None,
    open_browser: bool = True,
    dt: float = 1 / 60,
    view_state: Callable[[Presentation], ViewState] = ViewState,
    while_running: Callable[[Session], contextlib.AbstractContextManager[None]] | None = None,
) -> None:
    """Build a world and show it on a live page until Ctrl-C.

    The port is taken before the world is built, so that an occupied one is refused at once. Other arguments are as for
    `pyverlet.view` and `Session`.

    Args:
        build: makes the world, the panels or the presentation.
        while_running: context manager entered for the session, and left at its end.

    Raises:
        InputError: the port cannot be used, dt is not positive, or whatever `build` refuses.
    """
    _refuse_running_loop()
    with contextlib.suppress(KeyboardInterrupt), take_port(DEFAULT_PORT if port is None else port) as listener:
        presentation = Presentation.of(build(), title)
        session = Session(presentation, dt=dt, view_state=view_state)
        if draws_here(session.latest.shape):
            JpegRenderer().jpeg(session.latest, ViewOptions())  # loads its modules, so that no tab has to wait for that
        with on_air(session, listener), _ended_by_signals(session):
            announce(title, address(listener), open_browser)
            with while_running(session) if while_running else contextlib.nullcontext():
                session.run()  # in the thread that built the world: see there


@contextlib.contextmanager
def on_air(session: Session, listener: socket.socket) -> Iterator[None]:
    """Serve the page from a thread. If the server fails, the session ends and the error is raised here."""
    server = uvicorn.Server(server_config(session))
    failures: list[BaseException] = []

    def run() -> None:
        try:
            server.run(sockets=[listener])
        except BaseException as error:  # uvicorn exits with SystemExit
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
    """Let Ctrl-C or SIGTERM end the session after the current frame, so that the world is complete."""
    caught: list[int] = []

    def end(number: int) -> None:
        caught.append(number)
        session.stop()

    with first_signal(end, signal.SIGINT, signal.SIGTERM):
        yield
    if signal.SIGTERM in caught:
        signal.raise_signal(signal.SIGTERM)


def server_config(session: Session) -> uvicorn.Config:
    """The uvicorn configuration of a session."""
    return uvicorn.Config(
        make_app(session),
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
    """Whether a browser opened here would be visible: not over ssh, and on Linux only with a display."""
    if os.environ.get("SSH_CONNECTION"):
        return False
    return not sys.platform.startswith("linux") or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def take_port(port: int) -> socket.socket:
    """A socket that listens on the port; early requests wait until the server is up. InputError if that fails."""
    checks.integer("port", port, least=0, most=65535)
    try:
        return socket.create_server((HERE, port))
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            says = "another program is using; allowed is a free port, or 0 to have one chosen"
        elif error.errno in (errno.EACCES, errno.EPERM):
            says = "this user may not open; allowed are 1024 to 65535, or 0 to have one chosen"
        else:
            says = f"cannot be listened on ({error.strerror}); allowed is another, or 0 to have one chosen"
        raise InputError(f"port is {port}, which {says}") from None


def address(listener: socket.socket) -> str:
    """The URL of the page."""
    return f"http://{HERE}:{listener.getsockname()[1]}/"


def announce(title: str, url: str, open_browser: bool, *, blocks: bool = True) -> None:
    """Print the address, and open a tab if wanted and visible."""
    shown = open_browser and has_screen()
    sys.stdout.write(f"{title}: {url}   ({ENDS if blocks else STAYS})\n")
    if not shown:
        port = url.rstrip("/").rpartition(":")[2]
        user = "you"
        with contextlib.suppress(KeyError, OSError, ImportError):  # a container's user may have no name
            user = getpass.getuser()
        tunnel = f"ssh -L {port}:{HERE}:{port} {user}@{socket.gethostname()}"
        sys.stdout.write(f"from another machine: {tunnel}   then open {url} there\n")
    sys.stdout.flush()
    if shown:  # in a thread, as some launchers return only when the browser exits
        threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()


def _refuse_running_loop() -> None:
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return
    allowed = "a plain script (in a notebook: pyverlet.widget)"
    raise InputError(f"view() was called inside a running event loop, which it would block; allowed is {allowed}")
