"""What the tests of the viewer share: a world, and sessions that are told what to do."""

import json
import struct
import time
from collections.abc import Callable
from typing import Any

import numpy as np

import pyverlet as pv
from pyverlet.viewers.commands import Command
from pyverlet.viewers.frames import Frame
from pyverlet.viewers.session import Session

LOOK = {"type": "look", "part": None, "width": 400, "height": 300, "colour": "order", "dark": True, "velocity": False}
"""How a page looks at a world, as it says so."""


def nine_circles() -> pv.World:
    """Nine circles side by side on the floor of a box, at rest."""
    world = pv.World(boundary=pv.Box((-10, 0), (10, 20)), substeps=4)
    world.add(position=np.column_stack((np.arange(-8.0, 9.0, 2.0), np.full(9, 0.5))), radius=0.5)
    return world


class Treacle:
    """A force of nothing that takes its time in each substep."""

    velocity_dependent = False

    def __init__(self, seconds: float = 0.012) -> None:
        self.seconds = seconds

    def apply(self, state: Any, t: float) -> None:
        time.sleep(self.seconds)


def wait_until(condition: Callable[[], bool]) -> None:
    """Fails the test when a condition does not come true within ten seconds."""
    deadline = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline, "waited ten seconds in vain"
        time.sleep(0.005)


def after(session: Session, *commands: Command) -> Frame:
    """The frame after these were obeyed, one after the other, in a session that this thread turns."""
    for command in commands:
        session.submit(command)
        session.run_once()
    return session.latest


def unpack(data: bytes) -> tuple[dict[str, Any], bytes]:
    """Head and body of a message to a page."""
    (length,) = struct.unpack_from("<I", data)
    assert length % 4 == 0
    head: dict[str, Any] = json.loads(data[4 : 4 + length])
    return head, data[4 + length :]
