"""What circles push each other with, for pages that look: some frames a second are noted, and worked out in a thread."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pyverlet.laws.network import Network, Pushes
from pyverlet.laws.touches import Noted

if TYPE_CHECKING:
    from pyverlet.world.world import World

AGAIN_S = 0.1
"""From one look to the next, at least."""

SHARE = 6.0
"""From one look to the next, in terms of the frame that was noted: it takes many times as long as others."""

MOST = 20_000
"""Circles: of more, the picture would stop while a frame is noted, which takes several times as long as others."""


class Contacts(NamedTuple):
    """Contacts in the rows of a picture."""

    pairs: NDArray[np.uint32]
    """(m, 2) circles; twice the same where one leans on a wall or an obstacle."""
    force: NDArray[np.float32]
    """(m,) N."""
    angle: NDArray[np.float32]
    """(m,) rad, of the normal out of the first."""


NONE = Contacts(np.empty((0, 2), np.uint32), np.empty(0, np.float32), np.empty(0, np.float32))


class Forces:
    """Of worlds side by side.

    Attributes:
        wanted: whether somebody looks.
    """

    def __init__(self, worlds: Sequence[World]) -> None:
        self._worlds = worlds
        self._networks = [Network() for _ in worlds]
        self._thread: ThreadPoolExecutor | None = None
        self._work: Future[list[Pushes]] | None = None
        self._found: list[Pushes] = []
        self._due = 0.0
        self.wanted = False

    @contextmanager
    def look(self) -> Iterator[None]:
        """A frame is made; if it is time, what touches in it is noted."""
        if not self.wanted or time.monotonic() < self._due or sum(map(len, self._worlds)) > MOST or not self._idle():
            yield
            return
        began = time.monotonic()
        with ExitStack() as stack:
            noting = [stack.enter_context(world.noting_contacts()) for world in self._worlds]
            yield
        now = time.monotonic()
        self._due = now + max(AGAIN_S, SHARE * (now - began))
        self._thread = self._thread or ThreadPoolExecutor(1, thread_name_prefix="pyverlet-forces")
        self._work = self._thread.submit(self._solve, [each.noted() for each in noting])

    def _idle(self) -> bool:
        if self._work is not None and self._work.done():
            self._found, self._work = self._work.result(), None
        return self._work is None

    def _solve(self, noted: list[Noted | None]) -> list[Pushes]:
        return [network.look(each) for network, each in zip(self._networks, noted, strict=True) if each is not None]

    def now(self) -> Contacts:
        """The contacts that were found last, between circles that are still there."""
        if not self.wanted:
            return NONE
        self._idle()
        if len(self._found) != len(self._worlds):
            return NONE
        pairs, force, angle, first = [], [], [], 0
        for world, found in zip(self._worlds, self._found, strict=True):
            number = world.number
            if len(number) and len(found.pairs):
                row = np.searchsorted(number, found.pairs).clip(max=len(number) - 1)
                there = (number[row] == found.pairs).all(axis=1) & (found.force > 0)
                pairs.append(row[there] + first)
                force.append(found.force[there])
                angle.append(found.angle[there])
            first += len(world)
        if not pairs:
            return NONE
        return Contacts(
            np.concatenate(pairs).astype(np.uint32),
            np.concatenate(force).astype(np.float32),
            np.concatenate(angle).astype(np.float32),
        )
