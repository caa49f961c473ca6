"""Contact forces for pages that show them: a few frames per second are recorded."""

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.laws.contact_records import Pushes
from pyverlet.world.world import World

AGAIN_S = 0.1  # least time between recorded frames
SHARE = 6.0  # least time between recorded frames, over the duration of one: neither it nor the next is a plain frame
MOST = 20_000  # most circles: with more, sorting contacts would delay pictures


class Contacts(NamedTuple):
    """Contacts, by rows of a picture."""

    pairs: NDArray[np.uint32]  # (m, 2) circles; twice the same for a wall or an obstacle
    force: NDArray[np.float32]  # (m,) N
    angle: NDArray[np.float32]  # (m,) rad, direction of the normal out of the first


NONE = Contacts(np.empty((0, 2), np.uint32), np.empty(0, np.float32), np.empty(0, np.float32))


class Forces:
    """Contact forces in worlds side by side; `wanted`: whether a viewer shows them."""

    def __init__(self, worlds: Sequence[World]) -> None:
        self._worlds = worlds
        self._found: list[Pushes | None] = []
        self._due = 0.0
        self.wanted = False

    @contextmanager
    def look(self) -> Iterator[None]:
        """Context of a frame, in which contacts are recorded if it is time."""
        if not self.wanted or time.monotonic() < self._due or sum(map(len, self._worlds)) > MOST:
            yield
            return
        began = time.monotonic()
        with ExitStack() as stack:
            recording = [stack.enter_context(world.recording_contacts()) for world in self._worlds]
            yield
        now = time.monotonic()
        self._due = now + max(AGAIN_S, SHARE * (now - began))
        self._found = [each.pushes() for each in recording]

    def now(self) -> Contacts:
        """The contacts recorded last, between circles that still exist."""
        if not self.wanted or len(self._found) != len(self._worlds):
            return NONE
        parts, first = [NONE], 0
        for world, found in zip(self._worlds, self._found, strict=True):
            number = world.number
            if found is not None and len(number) and len(found.pairs):
                row = np.searchsorted(number, found.pairs).clip(max=len(number) - 1)
                there = (number[row] == found.pairs).all(axis=1) & (found.force > 0)
                parts.append(Contacts(row[there] + first, found.force[there], found.angle[there]))
            first += len(world)
        pairs, force, angle = map(np.concatenate, zip(*parts, strict=True))
        return Contacts(pairs.astype(np.uint32), force.astype(np.float32), angle.astype(np.float32))
