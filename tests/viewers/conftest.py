"""What the tests of the viewer share: worlds and sessions."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

import pyverlet as pv
from pyverlet.viewers.commands import Pause
from pyverlet.viewers.session import Session

WaitUntil = Callable[[Callable[[], bool]], None]


@pytest.fixture(scope="session", autouse=True)
def _compiled() -> None:
    """Tests with clocks in them do not wait for a compiler."""
    pv.warm_up(nine_circles())


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
