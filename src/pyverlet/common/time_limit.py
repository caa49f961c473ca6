"""A time limit for Python code, such as the user's, that may loop for ever."""

import contextlib
import ctypes
import threading
import time
from collections.abc import Iterator

LOOK_S = 0.2  # poll interval of the clock, in seconds


class TooLong(BaseException):
    """Raised in the code that took too long, at its current line."""


class TimeLimit:
    """Interrupts code in a `within` block that takes too long, between two of its Python instructions; one thread at a time.

    A thread that waits in C (`time.sleep`, a compiled kernel) is interrupted when it returns. Uses `PyThreadState_SetAsyncExc`
    of Python's C API.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._armed = threading.Event()
        self._deadline: float | None = None
        self._thread = 0
        self._watcher: threading.Thread | None = None

    @contextlib.contextmanager
    def within(self, seconds: float) -> Iterator[None]:
        """Raise `TooLong` in the calling thread if the block takes longer; repeated if the code continues nevertheless."""
        if self._watcher is None:
            self._watcher = threading.Thread(target=self._watch, name="pyverlet-time-limit", daemon=True)
            self._watcher.start()
        with self._lock:
            self._thread, self._deadline = threading.get_ident(), time.monotonic() + seconds
        self._armed.set()
        try:
            yield
        finally:
            late = True
            while late:
                with contextlib.suppress(TooLong):
                    late = self._stop()

    def _stop(self) -> bool:
        """Stop raising; an exception that was raised but has not arrived yet arrives here.

        Withdrawing it would make CPython 3.11 check for it at each instruction, and a profiler of such code would wait for ever.
        """
        with self._lock:
            self._deadline = None
            self._armed.clear()
            if late := self._thread < 0:
                self._thread = -self._thread
                _raise(self._thread, TooLong)  # only one is pending: this is the last
        while late:
            time.sleep(0)
        return late

    def _watch(self) -> None:
        while True:
            self._armed.wait()
            time.sleep(LOOK_S)
            with self._lock:
                if self._deadline is not None and time.monotonic() > self._deadline:
                    self._thread = -abs(self._thread)
                    _raise(abs(self._thread), TooLong)


def interrupt(thread: threading.Thread) -> None:
    """Raise `TooLong` in a thread whose result is no longer needed."""
    if thread.ident is not None and thread.is_alive():
        _raise(thread.ident, TooLong)


def _raise(thread: int, kind: type[BaseException]) -> None:
    ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(kind))
