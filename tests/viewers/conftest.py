"""What the tests of the viewer share: worlds, sessions, and pages in a browser."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, Playwright, sync_playwright

import pyverlet as pv
from pyverlet.viewers.commands import Pause
from pyverlet.viewers.session import Session

from .browser import FLAGS, KINDS, SERVE, Serve, Served, chromium, tab
from .sessions import after, nine_circles


@pytest.fixture
def world() -> pv.World:
    """See `nine_circles`."""
    return nine_circles()


@pytest.fixture
def session(world: pv.World) -> Iterator[Session]:
    """A running session around `world`."""
    with Session(world, title="nine") as session:
        yield session


@pytest.fixture
def paused(world: pv.World) -> Session:
    """One that is paused and has no thread: see `after`."""
    session = Session(world, title="nine")
    after(session, Pause(True))
    return session


@pytest.fixture
def programs() -> Iterator[list[Served]]:
    """Programs to end when a test has ended, unless it has ended them."""
    running: list[Served] = []
    yield running
    for each in running:
        with each:
            if each.process.poll() is None:
                each.end()
            assert each.process.returncode in (0, 130)


@pytest.fixture
def program(programs: list[Served]) -> Serve:
    """Serves a scene in a process of its own, as the command line does it."""

    def start(scene: str, particles: int, *settings: int) -> Served:
        programs.append(Served("-c", SERVE, scene, str(particles), *map(str, settings)))
        return programs[-1]

    return start


@pytest.fixture(scope="module")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="module")
def chrome(playwright: Playwright) -> Iterator[Browser]:
    """One kind of browser, where that is enough."""
    browser = playwright.chromium.launch(executable_path=chromium(), args=FLAGS)
    yield browser
    browser.close()


@pytest.fixture(scope="module", params=KINDS)
def browser(playwright: Playwright, request: pytest.FixtureRequest) -> Iterator[Browser]:
    browser = playwright.chromium.launch(executable_path=chromium(), args=[*FLAGS, *request.param])
    yield browser
    browser.close()


@pytest.fixture
def page(browser: Browser, programs: list[Served]) -> Iterator[Page]:  # closed before its server ends: that is an error to it
    with tab(browser) as page:
        yield page
