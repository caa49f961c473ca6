"""Commands on their way to the physics thread, from any number of others."""

from __future__ import annotations

import queue
from collections import deque
from collections.abc import Callable, Iterator

from pyverlet.viewers.commands import Command


class CommandQueue:
    """First come, first served. Filled from any thread, emptied by one."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Command | None] = queue.SimpleQueue()
        self._looked_at: deque[Command | None] = deque()

    def put(self, command: Command | None) -> None:
        """A command, or None, which only wakes whoever waits."""
        self._queue.put(command)

    def waiting(self, longest: float) -> Iterator[Command | None]:
        """All there is; if there is nothing, what comes within so many seconds and all behind it."""
        if not self._looked_at:
            try:
                self._looked_at.append(self._queue.get(timeout=longest))
            except queue.Empty:
                return
        yield from self.all()

    def all(self) -> Iterator[Command | None]:
        """All there is."""
        yield from self.while_(lambda command: True)

    def while_(self, may: Callable[[Command | None], bool]) -> Iterator[Command | None]:
        """What is there, up to the first that may not be taken yet, which stays."""
        while True:
            if not self._looked_at:
                try:
                    self._looked_at.append(self._queue.get_nowait())
                except queue.Empty:
                    return
            if not may(self._looked_at[0]):
                return
            yield self._looked_at.popleft()
