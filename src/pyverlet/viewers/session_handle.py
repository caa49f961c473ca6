"""What other threads may ask of a session, at any time."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Self

from pyverlet.viewers.commands import Command
from pyverlet.viewers.frames import Frame
from pyverlet.viewers.task_queue import TaskQueue

KEEN = 10  # pictures that have velocities of their own after a viewer has asked for some
KEEN_ON_FORCES = 60  # the same for forces, which are worked out a few times a second
STOP_TIMEOUT_S = 10.0  # longest wait for a frame under way when a session stops


class SessionHandle(ABC):
    """The thread-safe interface of a session."""

    def __init__(self) -> None:
        self._tasks = TaskQueue()
        self._taken = self._velocity_until = self._force_until = 0  # numbers of pictures
        self._listeners: tuple[Callable[[], None], ...] = ()
        self._listeners_lock = threading.Lock()
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()

    @abstractmethod
    def run(self) -> None:
        """Step the worlds in the calling thread until `stop` is called."""

    def submit(self, command: Command) -> None:
        """Ask for something. Returns at once; the physics thread does it between two frames, in the order asked.

        A world that is slow takes another gravity, or where a pointer that is down moves, between two substeps.
        """
        self._tasks.put(command)

    def take(self, frame: Frame, *, velocity: bool = False) -> None:
        """Say that a viewer has this frame and would like the next: a world that is slow makes some between its substeps then.

        They have new velocities only if a viewer looks at `velocity`.
        """
        self._taken = max(self._taken, frame.seq)
        if velocity:
            self._velocity_until = max(self._velocity_until, frame.seq + KEEN)

    def want_forces(self, frame: Frame) -> None:
        """Say that a viewer that has this frame looks at forces between circles."""
        self._force_until = max(self._force_until, frame.seq + KEEN_ON_FORCES)

    def subscribe(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Have `listener()` called on the physics thread after every new frame; it must return at once and not raise.

        Returns a function that ends the subscription.
        """
        with self._listeners_lock:
            self._listeners = (*self._listeners, listener)

        def unsubscribe() -> None:
            with self._listeners_lock:
                self._listeners = tuple(other for other in self._listeners if other is not listener)

        return unsubscribe

    def held(self) -> AbstractContextManager[None]:
        """Meanwhile the worlds stand between two frames, and are the caller's."""
        return self._tasks.held()

    def start(self) -> None:
        """Run in a thread of the session's own."""
        if self._thread is not None:
            raise RuntimeError("a session starts once")
        # A daemon: should a frame ever hang, Ctrl-C still ends the process.
        self._thread = threading.Thread(target=self.run, name="pyverlet-physics", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Have the frame under way be the last; wait for it if the session has its own thread. Twice is once."""
        self._stopping.set()
        self._tasks.put(None)
        if self._thread is not None:
            self._thread.join(STOP_TIMEOUT_S)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
