"""A multi-producer, single-consumer queue for the physics thread: commands of viewers and tasks of other threads."""

import queue
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from pyverlet.viewers.commands import Command

POLL_S = 0.1  # poll interval of waiting threads, s, to notice the end of the session

Task = Callable[[], object]
Item = Command | Task | None  # None only wakes the thread


class TaskQueue:
    """A first-in, first-out queue, filled from any thread and emptied by one."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Item] = queue.SimpleQueue()
        self._peeked: deque[Item] = deque()
        self._runner: int | None = None
        self._holder: int | None = None

    def put(self, item: Item) -> None:
        """Add an item; returns at once."""
        self._queue.put(item)

    def waiting(self, longest: float) -> Iterator[Item]:
        """Yield all items; if there are none, wait so many seconds for the next ones."""
        if not self._peeked:
            with suppress(queue.Empty):
                self._peeked.append(self._queue.get(timeout=longest))
        yield from self.all()

    def all(self) -> Iterator[Item]:
        """Yield all items."""
        yield from self.while_(lambda item: True)

    def while_(self, may: Callable[[Item], bool]) -> Iterator[Item]:
        """Yield items up to the first that may not be taken yet, which stays."""
        while True:
            if not self._peeked:
                try:
                    self._peeked.append(self._queue.get_nowait())
                except queue.Empty:
                    return
            if not may(self._peeked[0]):
                return
            yield self._peeked.popleft()

    @contextmanager
    def by_this_thread(self) -> Iterator[None]:
        """Context in which this thread empties the queue; at the end it runs the remaining tasks, so that no caller is stuck."""
        self._runner = threading.get_ident()
        try:
            yield
        finally:
            self._runner = None
            for item in self.all():
                if callable(item):
                    item()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Context in which the worlds stand between two frames and belong to the caller. May be nested.

        If no thread empties the queue, or this one does, the worlds belong to the caller already.
        """
        me = threading.get_ident()
        if self._runner is None or me in (self._runner, self._holder):
            yield
            return
        reached, done = threading.Event(), threading.Event()

        def stand() -> None:
            reached.set()
            done.wait()

        self.put(stand)
        while not reached.wait(POLL_S) and self._runner is not None:
            pass
        self._holder = me
        try:
            yield
        finally:
            self._holder = None
            done.set()
