"""Who wants to know when kernels begin to compile is told by Numba's events, and by those who wait for another process."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

from numba.core import event

_watchers: list[Callable[[], None]] = []


class _Listener(event.Listener):  # type: ignore[misc]
    def __init__(self, ours: set[Any], started: Callable[[], None]) -> None:
        self._ours = ours
        self._started = started

    def on_start(self, event: Any) -> None:
        if event.data["dispatcher"].py_func.__code__ in self._ours:
            self._started()

    def on_end(self, event: Any) -> None:
        pass


def tell() -> None:
    """One of our kernels is about to be waited for."""
    for started in _watchers.copy():
        started()


@contextlib.contextmanager
def told(ours: set[Any], started: Callable[[], None]) -> Iterator[None]:
    """Call `started` whenever a function with one of these codes begins to compile, and for each `tell`."""
    _watchers.append(started)
    try:
        with event.install_listener("numba:compile", _Listener(ours, started)):
            yield
    finally:
        _watchers.remove(started)
