"""What circles push each other with, for pages that look: some frames a second are noted."""

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.laws.contact_records import Pushes
from pyverlet.world.world import World

AGAIN_S = 0.1  # from one look to the next, at least
SHARE = 6.0  # from one look to the next, in terms of the frame that was noted: it is no plain one, and nor is the next
MOST = 20_000  # circles: of more, the picture would stop while contacts are put in order


class Contacts(NamedTuple):
    """Contacts in the rows of a picture."""

    pairs: NDArray[np.uint32]  # (m, 2) circles; twice the same where one leans on a wall or an obstacle
    force: NDArray[np.float32]  # (m,) N
    angle: NDArray[np.float32]  # (m,) rad, of the normal out of the first


NONE = Contacts(np.empty((0, 2), np.uint32), np.empty(0, np.float32), np.empty(0, np.float32))


class Forces:
    """Forces of contacts in worlds side by side; `wanted`: whether a viewer shows them."""

    def __init__(self, worlds: Sequence[World]) -> None:
        self._worlds = worlds
        self._found: list[Pushes | None] = []
        self._due = 0.0
        self.wanted = False

    @contextmanager
    def look(self) -> Iterator[None]:
        """A frame is made; if it is time, what touches in it is noted."""
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
        """The contacts that were found last, between circles that are still there."""
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
