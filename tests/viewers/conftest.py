"""What the tests of the viewer share: worlds, sessions, and pages in a browser."""

import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, Playwright, sync_playwright

import pyverlet as pv
from pyverlet.viewers.commands import Pause
from pyverlet.viewers.session import Session

from .browser import FLAGS, KINDS, SERVE, Program, Serve, chromium, tab

WaitUntil = Callable[[Callable[[], bool]], None]


@pytest.fixture
def world() -> pv.World:
    """See `nine_circles`."""
    return nine_circles()


def nine_circles() -> pv.World:
    """Nine circles side by side on the floor of a box, at rest."""
    world = pv.World(boundary=pv.Box((-10, 0), (10, 20)), substeps=4)
    world.add(position=np.column_stack((np.arange(-8.0, 9.0, 2.0), np.full(9, 0.5))), radius=0.5)
    return world


@pytest.fixture
def wait_until() -> WaitUntil:
    """Waits for a condition; fails the test when it does not come true within ten seconds."""

    def wait(condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 10.0
        while not condition():
            assert time.monotonic() < deadline, "waited ten seconds in vain"
            time.sleep(0.005)

    return wait


@pytest.fixture
def session(world: pv.World) -> Iterator[Session]:
    """A running session around `world`."""
    with Session(world, title="nine") as session:
        yield session


@pytest.fixture
def paused(session: Session, wait_until: WaitUntil) -> Session:
    """The same, paused."""
    session.submit(Pause(True))
    wait_until(lambda: session.latest.status.paused)
    return session


@pytest.fixture
def programs() -> Iterator[list[Program]]:
    """Programs to end when a test has ended."""
    running: list[Program] = []
    yield running
    for each in running:
        each.end()


@pytest.fixture
def program(programs: list[Program]) -> Serve:
    """Serves a scene in a process of its own, as the command line does it."""

    def start(scene: str, particles: int, *settings: int) -> Program:
        programs.append(Program("-c", SERVE, scene, str(particles), *map(str, settings)))
        return programs[-1]

    return start


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="module", params=KINDS)
def browser(playwright: Playwright, request: pytest.FixtureRequest) -> Iterator[Browser]:
    browser = playwright.chromium.launch(executable_path=chromium(), args=[*FLAGS, *request.param])
    yield browser
    browser.close()


@pytest.fixture
def page(
    browser: Browser, programs: list[Program]
) -> Iterator[Page]:  # closed before its server ends, whose end is an error to it
    with tab(browser) as page:
        yield page
