"""Numba's pool of threads: started when somebody first needs two, soon asleep when there is nothing to do, unused after a fork.

GNU's OpenMP, which Numba uses on Linux, has a thread that waits look for work 300,000 times, some milliseconds, before it sleeps:
so long it keeps a core from whoever it waits for. How often it looks is the environment variable GOMP_SPINCOUNT (manual of
libgomp, "Environment Variables"), read when the library is loaded, and Numba loads it when its pool starts. So it is there
while the pool starts, and only if the user has said nothing about waiting.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Iterator
from functools import cache

import numba

SPINS = 5_000
"""Looks for work before a thread sleeps. Not scanned: between 1,000 and 10,000, in docs/design/threads.md."""

_SAID_BY_USER = ("GOMP_SPINCOUNT", "OMP_WAIT_POLICY")

_starting = threading.Lock()

_orphaned = False


@contextlib.contextmanager
def _short_waits() -> Iterator[None]:
    if any(name in os.environ for name in _SAID_BY_USER):
        yield
        return
    os.environ["GOMP_SPINCOUNT"] = str(SPINS)
    try:
        yield
    finally:
        os.environ.pop("GOMP_SPINCOUNT", None)  # processes started from here are none of our business


@cache
def layer() -> str:
    """Start the threads; the name of who runs them: omp, tbb or workqueue."""
    with _starting, _short_waits():
        numba.get_num_threads()
    return str(numba.threading_layer())


def usable(count: int) -> int:
    """`count`; 1 in a fork of a process whose threads had been started, for a fork has none of them."""
    return 1 if _orphaned else count


def _in_child() -> None:
    """A fork begins. Locks may be held by threads that are not here, and GNU's OpenMP ends a fork that uses it again."""
    global _orphaned, _starting
    _starting = threading.Lock()
    with contextlib.suppress(ValueError):  # not started: the child may start its own
        numba.threading_layer()
        _orphaned = True


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_in_child)
