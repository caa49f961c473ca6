"""Ctrl-C and SIGTERM within a frame are delayed to its end, so that the world is complete; a second one is not delayed."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from types import FrameType
from typing import Any

try:  # without the enumerations of the public module: 0.5 us instead of 10, twice per frame
    _signal: Any = import_module("_signal")
except ImportError:
    _signal = signal
_CTRL_C = int(signal.SIGINT)


class _WithoutInterrupts:
    """A context that delays Ctrl-C, with little overhead. Threads other than the main one receive no signals."""

    def __init__(self) -> None:
        self._depth = 0
        self._before: Any = None
        self._pressed: tuple[int, FrameType | None] | None = None

    def __enter__(self) -> None:
        if threading.get_ident() != threading.main_thread().ident:
            return
        if self._depth == 0:
            self._pressed, self._before = None, _signal.getsignal(_CTRL_C)
            if callable(self._before):
                _signal.signal(_CTRL_C, self._note)
        self._depth += 1

    def __exit__(self, *_: object) -> None:
        if threading.get_ident() != threading.main_thread().ident:
            return
        self._depth -= 1
        if self._depth == 0:
            if _signal.getsignal(_CTRL_C) == self._note:  # no other handler was set meanwhile
                _signal.signal(_CTRL_C, self._before)
            pressed, self._pressed = self._pressed, None
            if pressed:
                self._before(*pressed)

    def _note(self, number: int, frame: FrameType | None) -> None:
        # An exception during setup or teardown would leave this handler in place.
        if self._depth and self._pressed:
            self._pressed = None
            self._before(number, frame)
        else:
            self._pressed = number, frame


without_interrupts = _WithoutInterrupts()


@contextmanager
def first_signal(act: Callable[[int], object], *numbers: int) -> Iterator[None]:
    """Context in which the first of these signals calls `act(number)`; a second one acts as before. In the main thread only."""
    if threading.current_thread() is not threading.main_thread():
        yield  # other threads cannot handle signals
        return
    before = {number: signal.getsignal(number) for number in numbers}

    def restore() -> None:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)

    def first(number: int, frame: FrameType | None) -> None:
        restore()
        act(number)

    for number in numbers:
        signal.signal(number, first)
    try:
        yield
    finally:
        restore()
