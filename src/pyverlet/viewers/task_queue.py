"""What other threads want done by the one that steps the worlds, between two frames."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

AGAIN_S = 0.1
"""How often somebody who waits looks whether the session has ended."""


class TaskQueue:
    """Filled from any thread, run by one."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()
        self._runner: int | None = None
        self._holder: int | None = None

    def put(self, task: Callable[[], object]) -> None:
        """Have something done; returns at once."""
        self._queue.put(task)

    @property
    def here(self) -> bool:
        """Whether it is this thread that runs them."""
        return self._runner == threading.get_ident()

    def run(self) -> None:
        """Do what there is to do, here."""
        while True:
            try:
                task = self._queue.get_nowait()
            except queue.Empty:
                return
            task()

    @contextmanager
    def by_this_thread(self) -> Iterator[None]:
        """This thread calls `run` now and then, meanwhile."""
        self._runner = threading.get_ident()
        try:
            yield
        finally:
            self._runner = None
            self.run()  # nobody is left waiting

    @contextmanager
    def held(self, wake: Callable[[], object]) -> Iterator[None]:
        """Meanwhile the worlds stand between two frames, and are the caller's. In itself it is no further step.

        Args:
            wake: tells the runner that there is something to do.
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
        wake()
        while not reached.wait(AGAIN_S) and self._runner is not None:
            pass
        self._holder = me
        try:
            yield
        finally:
            self._holder = None
            done.set()
